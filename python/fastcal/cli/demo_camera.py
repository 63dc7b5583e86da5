# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal demo --camera`: an arm with a camera on its flange and a board on the table, in pictures drawn by fastcal.

The pictures are drawn by the lens model with blur and noise; from then on everything is as with anyone's pictures:
corners are found in them, and arm, camera and board identified together.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.simulation import perturbed
from fastcal.camera.opencv import opencv
from fastcal.camera.rendering import render
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.io.folder import atomic_folder
from fastcal.io.robot_file import load_robot, write_spec
from fastcal.io.tables import write_csv
from fastcal.io.yaml_text import yaml_text
from fastcal.place import joint_column
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

ARM = "ur5e"
HEAD = "Written by fastcal demo: a simulated arm, no real one was measured."
ROWS, TEST_ROWS = 36, 12
CAMERA: dict[str, Any] = {"size_px": [800, 600], "focal_px": [780.0, 781.0], "centre_px": [401.5, 298.0]}
CAMERA |= {"distortion": [-0.1, 0.06, 2e-4, -3e-4, 0.0], "model": "pinhole", "intrinsics": "known"}
WRIST = {"xyz_mm": [4.0, -66.0, 42.0], "rpy_deg": [-9.0, 1.5, 4.0]}  # where the camera is; the file says:
WRIST_SAID = {"xyz_mm": [0.0, -60.0, 40.0], "rpy_deg": [0.0, 0.0, 0.0]}
BOARD: dict[str, Any] = {"kind": "checkerboard", "columns": 10, "rows": 7, "square_mm": 20.0}
PLATE = {"xyz_mm": [-430.0, 120.0, 12.0], "rpy_deg": [178.5, 1.0, 20.0]}
PLATE_SAID = {"xyz_mm": [-450.0, 100.0, 0.0], "rpy_deg": [177.0, 0.0, 0.0]}
DISTANCE_MM, TILT_DEG, ROLL_DEG, ASIDE_MM = (280.0, 430.0), 32.0, 70.0, 45.0
REPEATABILITY_DEG = 0.001
_MARGIN_PX = 12
_MOST_TRIES = 4000


def write_session(output: Path, seed: int) -> None:
    """robot.yaml and cell.yaml as a user would have them, poses.csv, test_poses.csv, and a folder of pictures of each.

    Raises:
        InvalidInput: OpenCV, which writes the pictures, is not installed.
    """
    cv2 = opencv()
    nominal = load_robot(ARM)
    true = perturbed(nominal, seed=seed)
    cell = {
        "cell": "demo",
        "arms": {"arm": {"robot": "robot.yaml"}},
        "cameras": {"wrist": {"on": "arm", **WRIST_SAID, **CAMERA}},
        "boards": {"plate": {"on": "world", **PLATE_SAID, **BOARD}},
    }
    sets = {
        "": _session(nominal, true, ROWS, (seed, 0)),
        "test_": _session(nominal, true, TEST_ROWS, (seed, 1)),
    }
    with atomic_folder(output) as folder:
        write_spec(nominal.spec, folder / "robot.yaml", HEAD)
        (folder / "cell.yaml").write_text(f"# {HEAD}\n{yaml_text(cell)}", encoding="utf-8")
        for name, (q, _) in sets.items():
            angles = from_si(q, "deg")
            columns = {joint_column(k, "deg"): angles[:, k].round(6).tolist() for k in range(q.shape[1])}
            write_csv(folder / f"{name}poses.csv", columns)
    for name, (_, shown) in sets.items():
        with atomic_folder(output / f"{name}pictures") as folder:
            for k, T in enumerate(shown):
                picture = render(CAMERA, BOARD, T, seed=seed * ROWS + k)
                (folder / f"picture_{k:03d}.png").write_bytes(bytes(cv2.imencode(".png", picture)[1]))


def _session(nominal: Robot, true: Robot, rows: int, seed: tuple[int, int]) -> tuple[FloatArray, list[FloatArray]]:
    """Joint positions (rows, n) [rad], and T_camera_board in each, of views that show the whole board."""
    random = np.random.default_rng(seed)
    wrist, plate = pose(WRIST), pose(PLATE)
    q_all: list[FloatArray] = []
    shown: list[FloatArray] = []
    for _ in range(_MOST_TRIES // rows):
        targets = np.array([_view(random, plate) @ se3.inverse(wrist) for _ in range(rows)])
        found = inverse_kinematics(nominal, targets)
        for q, ok in zip(found.q, found.status == "reached", strict=True):
            if not ok:
                continue
            stands = q + to_si(REPEATABILITY_DEG, "deg") * random.standard_normal(len(q))
            T = se3.inverse(np.asarray(true.forward(stands[np.newaxis]))[0] @ wrist) @ plate
            if _whole(T):
                q_all.append(q)
                shown.append(T)
            if len(shown) == rows:
                return np.array(q_all), shown
    raise InvalidInput(f"only {len(shown)} of {rows} views of the board could be reached")


def _view(random: np.random.Generator, plate: FloatArray) -> FloatArray:
    """(4, 4) of a camera that looks at the board from above, slanted and turned."""
    middle = plate @ np.array([*board_corners(BOARD).mean(axis=0), 1.0])
    turn = [*random.uniform(-TILT_DEG, TILT_DEG, 2), random.uniform(-ROLL_DEG, ROLL_DEG)]
    R = plate[:3, :3] @ pose({"xyz_mm": [0.0] * 3, "rpy_deg": turn})[:3, :3]
    aside = np.array([*random.uniform(-ASIDE_MM, ASIDE_MM, 2), random.uniform(*DISTANCE_MM)])
    return se3.pose(R, middle[:3] - R @ to_si(aside, "mm"))


def _whole(T: FloatArray) -> bool:
    """Is the whole board in the picture?"""
    from fastcal import _core
    from fastcal.robot.rig import lens_numbers

    at = board_corners(BOARD) @ T[:3, :3].T + T[:3, 3]
    if not (at[:, 2] > 0).all():
        return False
    side = to_si(float(BOARD["square_mm"]), "mm") / float(at[:, 2].min()) * CAMERA["focal_px"][0]
    uv = np.asarray(_core.draw(CAMERA["model"], lens_numbers(CAMERA), at))
    least = _MARGIN_PX + side  # the outer squares belong to the board too
    return bool((uv > least).all() and (uv < np.array(CAMERA["size_px"]) - least).all())
