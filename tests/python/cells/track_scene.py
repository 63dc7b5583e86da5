# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm on a track that looks at a board on a turntable, drawn by numpy alone."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from . import camera_scene as camera

FloatArray = NDArray[np.float64]

TRACK, ARM, TABLE = ((0, 300, 150), (0, 0, 0)), ((0, 0, 0), (-90, 0, 0)), ((900, 0, -150), (0, 0, 0))
SECOND = ((1700.0, 0.0, 0.0), (0.0, 0.0, 180.0))
ON_TABLE, TABLE_HEIGHT, LENGTH = ((-75, -50, 20), (180, 0, 0)), 150.0, 800.0
COLUMNS = ["track.q1_mm", *(f"arm.q{k}_deg" for k in range(1, 7)), "table.q1_deg"]


class Scene:
    """Where all truly is: off the file by about 2 mm and 2 mrad, the arm by `arm_mm` in its second link."""

    def __init__(self, seed: int = 1, *, arm_mm: float = 0.6) -> None:
        self.random = np.random.default_rng(seed)
        self.arm_mm = arm_mm
        self.track, self.arm, self.table, self.board = (self._off(*of) for of in (TRACK, ARM, TABLE, ON_TABLE))

    def _off(self, xyz: Any, rpy_deg: Any) -> FloatArray:
        return camera.pose(xyz, rpy_deg) @ camera.pose(
            tuple(self.random.normal(0, 2, 3)), tuple(np.degrees(self.random.normal(0, 2e-3, 3)))
        )

    def picture(self, q: FloatArray) -> FloatArray | None:
        """(K, 2) px of one posture (8,); None where the board is not whole in the picture, or far away."""
        slide = camera.pose((0, 0, 0), (90, 0, 0)) @ camera.pose((0, 0, q[0]), (0, 0, 0))
        eye = self.track @ slide @ self.arm @ camera.flange(q[1:7], self.arm_mm) @ camera.WRIST
        return self._seen_from(eye, q[7])

    def second_picture(self, q: FloatArray, table_deg: float) -> FloatArray | None:
        """`picture` by a camera on an arm like the first (q (6,)) that stands at SECOND, as the file says."""
        return self._seen_from(camera.pose(*SECOND) @ camera.flange(q, self.arm_mm) @ camera.WRIST, table_deg)

    def _seen_from(self, eye: FloatArray, table_deg: float) -> FloatArray | None:
        T = np.linalg.inv(eye) @ self.table @ camera.pose((0, 0, TABLE_HEIGHT), (0, 0, table_deg)) @ self.board
        points = camera.corners() @ T[:3, :3].T + T[:3, 3]
        if (points[:, 2] < 150).any() or (points[:, 2] > 900).any():
            return None
        uv = camera.drawn(points)
        return uv if (uv > 0).all() and (uv < camera.SIZE).all() else None

    def postures(self, count: int) -> FloatArray:
        """(count, 8) [mm, deg] in which the whole board is in the picture."""
        out: list[FloatArray] = []
        while len(out) < count:
            q = np.array([400, 0, 10, 20, 0, 60, 0, 0.0])
            q += self.random.uniform(-1, 1, 8) * [400, 40, 25, 25, 60, 40, 170, 170]
            if self.picture(q) is not None:
                out.append(q)
        return np.array(out)

    def write(
        self, folder: Path, count: int, noise_px: float = 0.1, prefix: str = "", repeats_deg: float = 0.0
    ) -> FloatArray:
        """Writes the cell, poses.csv and corners.csv, by joints that repeat so far; the pictures (N, K, 2)."""
        joints = [
            {"type": "revolute", "theta_deg": t, "d_mm": d, "a_mm": a, "alpha_deg": r} for t, d, a, r in camera.DH
        ]
        slide = {
            "type": "prismatic",
            "theta_deg": 0,
            "d_mm": 0,
            "a_mm": 0,
            "alpha_deg": 90,
            "min_mm": 0,
            "max_mm": LENGTH,
        }
        turn = {"type": "revolute", "theta_deg": 0, "d_mm": TABLE_HEIGHT, "a_mm": 0, "alpha_deg": 0}
        chains = {"arm": ("dh", joints), "track": ("mdh", [slide]), "table": ("mdh", [turn])}
        for name, (kinematics, rows) in chains.items():
            content = {"name": name, "kinematics": kinematics, "joints": rows}
            (folder / f"{name}.yaml").write_text(yaml.safe_dump(content))
        (folder / "cell.yaml").write_text(yaml.safe_dump(cell()))
        q = self.postures(count)
        lines = [",".join(f"{value:.9f}" for value in row) for row in q]
        (folder / f"{prefix}poses.csv").write_text("\n".join([",".join(COLUMNS), *lines]) + "\n")
        there = q + repeats_deg * self.random.standard_normal(q.shape) * [0, *[1] * 7] if repeats_deg else q
        uv = np.array([self.picture(row) for row in there])
        uv += noise_px * self.random.standard_normal(uv.shape)
        camera.write_corners(folder, uv, f"{prefix}corners.csv")
        return uv


def cell(**changes: Any) -> dict[str, Any]:
    """The cell file, whose camera and board are far from where they are."""

    def place(of: Any, on: str) -> dict[str, Any]:
        return {"on": on, "xyz_mm": list(of[0]), "rpy_deg": list(of[1])}

    rig = camera.cell()
    rig["cameras"]["wrist"] |= {"xyz_mm": [300, 200, -100], "rpy_deg": [40, -30, 100]}
    rig["boards"]["plate"] |= {**place(ON_TABLE, "table"), "xyz_mm": [100, 40, 60]}
    arms = {
        "track": {"robot": "track.yaml", **place(TRACK, "world")},
        "arm": {"robot": "arm.yaml", **place(ARM, "track")},
        "table": {"robot": "table.yaml", **place(TABLE, "world")},
    }
    return {"cell": "track", "arms": arms, "cameras": rig["cameras"], "boards": rig["boards"], **changes}
