# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pose of a flat board in each picture, without an initial guess: homography, then least squares in pixels.

The homography H = [h1 h2 h3] of corners (x, y, 1) to directions (X / Z, Y / Z, 1) is c [r1 r2 t] (Z. Zhang, "A flexible
new technique for camera calibration", 2000); the rotation nearest to [r1 r2 r1 x r2] starts the fit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.errors import InvalidInput
from fastcal.measurements.rotations import nearest_rotation
from fastcal.robot.rig import board_corners, lens_numbers
from fastcal.robot.se3 import pose

FloatArray = NDArray[np.float64]

_FEWEST = 6  # corners
_ROUNDS = 20  # of undoing the lens
_STEPS, _GAIN = 20, 1e-9  # of the pose at most, and the share of the squares below which it is found
_DIFFERENCE = 1e-6  # of a derivative [board sizes, rad]


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


def drawn_board(camera: Mapping[str, Any], board: Mapping[str, Any], T: FloatArray) -> FloatArray:
    """(N, K, 2) where corners are seen [px] with T_camera_board (N, 4, 4) [m]; infinite behind the camera."""
    points = np.einsum("nij,kj->nki", T[:, :3, :3], board_corners(board)) + T[:, np.newaxis, :3, 3]
    flat = np.ascontiguousarray(points.reshape(-1, 3))
    before = flat[:, 2] > 0
    out = np.full((len(flat), 2), np.inf)
    out[before] = _core.draw(camera["model"], lens_numbers(camera), np.ascontiguousarray(flat[before]))
    return out.reshape(*points.shape[:2], 2)


def planar_misfit(camera: Mapping[str, Any], points: FloatArray, seen: FloatArray) -> float | None:
    """RMS that a homography leaves [px] of points (K, 2) of a plane, seen at (K, 2) px; None from too few."""
    known = np.isfinite(seen).all(axis=1)
    if known.sum() < _FEWEST or _on_a_line(points[known]):
        return None
    xy, (plane, _, _) = _directions(camera, seen[known]), _centred(points[known])
    p = np.column_stack([plane, np.ones(len(plane))]) @ _homography(plane, xy).T
    r = (p[:, :2] / p[:, 2:] - xy) * np.array(camera["focal_px"])
    return float(np.sqrt(np.mean(np.sum(r**2, axis=1))))


def _on_a_line(xy: FloatArray) -> bool:
    size = np.linalg.svd(xy - xy.mean(axis=0), compute_uv=False)
    return bool(size[1] < 1e-4 * size[0])


def _pose(camera: Mapping[str, Any], points: FloatArray, seen: FloatArray) -> FloatArray:
    """(4, 4) T_camera_board by Gauss' and Newton's steps from the homography, in sizes of the board."""
    lens, size = lens_numbers(camera), float(np.ptp(points))
    at = points / size
    T = _of_homography(at[:, :2], _directions(camera, seen))
    best, least = T, np.inf
    for _ in range(_STEPS):
        tried = np.array([moved(T, _DIFFERENCE * e) for e in np.vstack([np.zeros(6), np.eye(6)])])
        before = np.einsum("nij,kj->nki", tried[:, :3, :3], at) + tried[:, np.newaxis, :3, 3]
        drawn = np.asarray(_core.draw(camera["model"], lens, np.ascontiguousarray(before.reshape(-1, 3))))
        r = drawn.reshape(7, -1) - seen.ravel()
        cost = float(np.sum(r[0] ** 2))
        if not cost < least:
            break
        is_done = cost > (1 - _GAIN) * least
        best, least = T, cost
        if is_done:
            break
        T = moved(T, -np.linalg.lstsq((r[1:] - r[0]).T / _DIFFERENCE, r[0], rcond=None)[0])
    out = best.copy()
    out[:3, 3] *= size
    return out


def moved(T: FloatArray, by: FloatArray) -> FloatArray:
    """The pose shifted by (3,) and turned by (3,) [rad] in its own axes."""
    out = T.copy()
    out[:3, :3] = T[:3, :3] @ np.asarray(_core.exp_so3(by[3:]))
    out[:3, 3] += by[:3]
    return out


def _directions(camera: Mapping[str, Any], seen: FloatArray) -> FloatArray:
    """(K, 2) X / Z and Y / Z of what is seen at (K, 2) px."""
    lens = lens_numbers(camera)
    focal = np.array(lens[:2])
    xy = (seen - np.array(lens[2:4])) / focal
    with np.errstate(over="ignore", invalid="ignore"):  # a lens that turns back before it comes there
        for _ in range(_ROUNDS):
            drawn = np.asarray(_core.draw(camera["model"], lens, np.column_stack([xy, np.ones(len(xy))])))
            xy = xy + (seen - drawn) / focal
    return xy if np.isfinite(xy).all() else np.asarray((seen - np.array(lens[2:4])) / focal)


def _centred(points: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Points (K, 2) about their middle in sizes of their spread; the middle, and the size."""
    middle, size = points.mean(axis=0), float(np.ptp(points))
    return (points - middle) / size, middle, size


def _homography(p: FloatArray, xy: FloatArray) -> FloatArray:
    """(3, 3) H of p (K, 2) to xy (K, 2), of any size."""
    rows = []
    for (a, b), (x, y) in zip(p, xy, strict=True):
        rows += [[a, b, 1, 0, 0, 0, -x * a, -x * b, -x], [0, 0, 0, a, b, 1, -y * a, -y * b, -y]]
    return np.asarray(np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3))


def _of_homography(points: FloatArray, xy: FloatArray) -> FloatArray:
    """(4, 4) the pose in which points (K, 2) of a plane are seen in directions (K, 2)."""
    p, middle, size = _centred(points)
    H = _homography(p, xy)
    H = H / np.sqrt(np.linalg.norm(H[:, 0]) * np.linalg.norm(H[:, 1]))
    H = H if H[2, 2] > 0 else -H  # before the camera
    frame = np.column_stack([H[:, 0], H[:, 1], np.cross(H[:, 0], H[:, 1])])
    R = nearest_rotation(frame)
    return pose(R, size * H[:, 2] - R[:, :2] @ middle)
