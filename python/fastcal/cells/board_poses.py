# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a flat board is in each picture, without a guess: a homography from its corners, and the pixels' least squares.

The homography H = [h1 h2 h3] of corners (x, y, 1) to directions (X / Z, Y / Z, 1) is c [r1 r2 t] (Z. Zhang, "A flexible
new technique for camera calibration", 2000); the rotation nearest to [r1 r2 r1 x r2] starts the fit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fastcal import _core
from fastcal.errors import InvalidInput
from fastcal.robot.rig import board_corners, lens_numbers

FloatArray = NDArray[np.float64]

_FEWEST = 6  # corners
_ROUNDS = 20  # of undoing the lens


def board_poses(
    camera: Mapping[str, Any], board: Mapping[str, Any], corners: FloatArray, part: slice
) -> tuple[NDArray[np.intp], FloatArray]:
    """Rows in which enough was seen (M,), and T_camera_board (M, 4, 4) [m] there.

    Args:
        camera: As a robot file has it.
        board: As a robot file has it.
        corners: (N, 2 K) of all pictures of a row [px], NaN where not seen.
        part: Those of this camera and board among the K.

    Raises:
        InvalidInput: The board is not flat.
    """
    points = board_corners(board)
    if np.ptp(points[:, 2]) > 0:
        raise InvalidInput("a board that is not flat does not give its pose by a homography; give a flat one")
    uv = corners.reshape(len(corners), -1, 2)[:, part]
    rows, poses = [], []
    for row, seen in enumerate(uv):
        known = np.isfinite(seen).all(axis=1)
        if known.sum() < _FEWEST or _on_a_line(points[known, :2]):
            continue
        rows.append(row)
        poses.append(_pose(camera, points[known], seen[known]))
    return np.array(rows, dtype=np.intp), np.array(poses).reshape(-1, 4, 4)


def _on_a_line(xy: FloatArray) -> bool:
    size = np.linalg.svd(xy - xy.mean(axis=0), compute_uv=False)
    return bool(size[1] < 1e-4 * size[0])


def _pose(camera: Mapping[str, Any], points: FloatArray, seen: FloatArray) -> FloatArray:
    lens = lens_numbers(camera)

    def draw(at: FloatArray) -> FloatArray:
        return np.asarray(_core.draw(camera["model"], lens, np.ascontiguousarray(at)))

    focal = np.array(lens[:2])
    xy = (seen - np.array(lens[2:4])) / focal
    for _ in range(_ROUNDS):
        xy = xy + (seen - draw(np.column_stack([xy, np.ones(len(xy))]))) / focal
    T = _of_homography(points[:, :2], xy)

    def moved(x: FloatArray) -> FloatArray:
        out = T.copy()
        out[:3, :3] = T[:3, :3] @ np.asarray(_core.exp_so3(x[3:]))
        out[:3, 3] += x[:3]
        return out

    def residual(x: FloatArray) -> FloatArray:
        of = moved(x)
        return (draw(points @ of[:3, :3].T + of[:3, 3]) - seen).ravel()

    return moved(least_squares(residual, np.zeros(6), x_scale=[0.1] * 6, method="lm").x)


def _of_homography(points: FloatArray, xy: FloatArray) -> FloatArray:
    """(4, 4) the pose in which points (K, 2) of a plane are seen in directions (K, 2)."""
    middle, size = points.mean(axis=0), float(np.ptp(points))
    p = (points - middle) / size
    rows = []
    for (a, b), (x, y) in zip(p, xy, strict=True):
        rows += [[a, b, 1, 0, 0, 0, -x * a, -x * b, -x], [0, 0, 0, a, b, 1, -y * a, -y * b, -y]]
    H = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    H = H / np.sqrt(np.linalg.norm(H[:, 0]) * np.linalg.norm(H[:, 1]))
    H = H if H[2, 2] > 0 else -H  # before the camera
    frame = np.column_stack([H[:, 0], H[:, 1], np.cross(H[:, 0], H[:, 1])])
    u, _, vt = np.linalg.svd(frame)
    T = np.eye(4)
    T[:3, :3] = u @ np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ vt)))]) @ vt
    T[:3, 3] = size * H[:, 2] - T[:3, :2] @ middle
    return T
