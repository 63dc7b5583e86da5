# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Boards of every kind before a camera with a lens that bends, and where their corners are in its pictures."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners

FloatArray = NDArray[np.float64]

CAMERA: dict[str, Any] = {
    "model": "pinhole",
    "size_px": [1280, 960],
    "focal_px": [1100.0, 1102.0],
    "centre_px": [640.0, 480.0],
    "distortion": [-0.1, 0.05, 1e-4, -2e-4, 0.0],
}
POINTS = [[0, 0, 0], [100, 0, 0], [200, 10, 0], [190, 120, 0], [60, 140, 0], [-10, 90, 0], [80, 60, 0], [130, 80, 0]]
BOARDS: dict[str, dict[str, Any]] = {
    "checkerboard": {"kind": "checkerboard", "columns": 10, "rows": 7, "square_mm": 25.0},
    "charuco": {
        "kind": "charuco",
        "columns": 10,
        "rows": 7,
        "square_mm": 25.0,
        "marker_mm": 18.75,
        "dictionary": "5X5_250",
    },
    "april_grid": {"kind": "april_grid", "columns": 6, "rows": 5, "tag_mm": 30.0, "gap_mm": 9.0, "dictionary": "36h11"},
    "circles": {"kind": "circles", "columns": 10, "rows": 7, "square_mm": 25.0},
    "asymmetric circles": {"kind": "circles", "columns": 4, "rows": 11, "square_mm": 20.0, "asymmetric": True},
    "points": {"kind": "points", "points_mm": [[float(x) for x in point] for point in POINTS]},
}


def before_camera(board: dict[str, Any], rpy_deg: list[float], middle_m: list[float]) -> FloatArray:
    """(4, 4) T_camera_board of a board whose middle is there, turned so from facing the camera."""
    R = pose({"xyz_mm": [0.0] * 3, "rpy_deg": rpy_deg})[:3, :3]
    if board["kind"] == "april_grid":
        R = R @ np.diag([1.0, -1.0, -1.0])  # y up
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, np.array(middle_m) - R @ board_corners(board).mean(axis=0)
    return T


def drawn(board: dict[str, Any], T: FloatArray, camera: dict[str, Any] | None = None) -> FloatArray:
    """(K, 2) px by OpenCV's formula, written out here."""
    of = camera or CAMERA
    points = board_corners(board) @ T[:3, :3].T + T[:3, 3]
    x, y = points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]
    s = x**2 + y**2
    k1, k2, p1, p2, k3 = of["distortion"]
    a = 1 + k1 * s + k2 * s**2 + k3 * s**3
    u = a * x + 2 * p1 * x * y + p2 * (s + 2 * x**2)
    v = a * y + p1 * (s + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([of["focal_px"][0] * u + of["centre_px"][0], of["focal_px"][1] * v + of["centre_px"][1]])


def views(board: dict[str, Any], count: int, seed: int) -> list[FloatArray]:
    """T_camera_board of slanted boards, near and far, any way up."""
    random = np.random.default_rng(seed)
    out = []
    while len(out) < count:
        rpy = [*random.uniform(-35, 35, 2), random.uniform(-180, 180)]
        T = before_camera(board, rpy, [*random.uniform(-0.06, 0.06, 2), random.uniform(0.45, 0.8)])
        uv = drawn(board, T)
        if (uv > 25).all() and (uv < np.array(CAMERA["size_px"]) - 25).all():
            out.append(T)
    return out
