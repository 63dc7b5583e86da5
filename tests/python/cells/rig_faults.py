# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures by a camera that is late, reads line after line, hangs on a bracket that gives, or was knocked."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from . import camera_scene as camera
from .camera_scene import FloatArray

DOWN = np.array([0.0, 0.0, -1.0])
STILL = np.zeros(3)


def before_camera(q_deg: FloatArray, bracket_deg: float, camera_mm: FloatArray, board_mm: FloatArray) -> FloatArray:
    """(K, 3) corners in the frame of a camera whose bracket turns by its weight, about the flange, as a beam does.

    Camera and board are shifted, and turned by 0.05 degrees a mm, in their own frames.
    """
    flange = camera.flange(q_deg)
    lever = camera.WRIST[:3, 3] / np.linalg.norm(camera.WRIST[:3, 3])
    moment = np.cross(lever, flange[:3, :3].T @ DOWN)
    bent = np.eye(4)
    bent[:3, :3] = Rotation.from_rotvec(np.radians(bracket_deg) * moment).as_matrix()
    T = np.linalg.inv(flange @ bent @ camera.WRIST @ knocked(camera_mm)) @ camera.PLATE @ knocked(board_mm)
    return np.asarray(camera.corners() @ T[:3, :3].T + T[:3, 3])


def knocked(shift_mm: FloatArray) -> FloatArray:
    """(4, 4) shift, and turn by 0.05 degrees a mm."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(np.radians(0.05) * shift_mm).as_matrix()
    T[:3, 3] = shift_mm
    return T


def picture(
    q_deg: FloatArray,
    speed_deg_s: FloatArray,
    *,
    bracket_deg: float = 0,
    delay_s: float = 0,
    readout_s: float = 0,
    camera_mm: FloatArray = STILL,
    board_mm: FloatArray = STILL,
) -> FloatArray:
    """(K, 2) px: each corner where it is when its own line is read, the middle line `delay_s` after the joints."""
    out = np.zeros((len(camera.corners()), 2))
    late = np.full(len(out), delay_s)
    for _ in range(4):  # a line's moment depends on the line
        for k, seconds in enumerate(late):
            out[k] = camera.drawn(
                before_camera(q_deg + seconds * speed_deg_s, bracket_deg, camera_mm, board_mm)[k : k + 1]
            )[0]
        late = delay_s + readout_s * (out[:, 1] / camera.SIZE[1] - 0.5)
        if readout_s == 0:
            break
    return out


def write(
    folder: Path,
    count: int,
    seed: int,
    *,
    noise_px: float = 0.1,
    joint_noise_deg: float = 0.0006,
    fast_deg_s: float = 8.0,
    at_row: int = 0,
    **fault: Any,
) -> None:
    """cell.yaml, arm.yaml, poses.csv with speeds and corners.csv; `fault` as of `picture`, in rows before `at_row`."""
    camera.write(folder, count, seed)
    (folder / "cell.yaml").write_text(yaml.safe_dump(camera.cell()))
    random = np.random.default_rng(seed + 1000)
    q = camera.postures(count, seed)
    speed = random.uniform(-fast_deg_s, fast_deg_s, q.shape)
    true = q + joint_noise_deg * random.standard_normal(q.shape)
    wrong = [fault if not at_row or i < at_row else {} for i in range(count)]
    uv = np.array([picture(a, b, **own) for a, b, own in zip(true, speed, wrong, strict=True)])
    camera.write_corners(folder, uv + noise_px * random.standard_normal(uv.shape))
    names = [f"arm.q{k}_deg" for k in range(1, 7)] + [f"arm.qd{k}_deg_s" for k in range(1, 7)]
    rows = [",".join(f"{v:.9f}" for v in row) for row in np.hstack([q, speed])]
    (folder / "poses.csv").write_text("\n".join([",".join(names), *rows]) + "\n")
