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

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

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
    known = np.asarray(np.isfinite(uv).all(axis=2))
    rows = np.flatnonzero(known.sum(axis=1) >= _FEWEST)
    rows = rows[~_on_a_line(points[:, :2], known[rows])]
    if not len(rows):
        return rows, np.zeros((0, 4, 4))
    return rows, _poses(camera, points, uv[rows], known[rows])


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
    known = np.asarray(np.isfinite(seen).all(axis=1))
    if known.sum() < _FEWEST or _on_a_line(points, known[np.newaxis])[0]:
        return None
    all_of = np.ones((1, int(known.sum())), dtype=bool)
    xy, (plane, _, _) = _directions(camera, seen[np.newaxis, known]), _centred(points[known], all_of)
    p = np.column_stack([plane[0], np.ones(len(plane[0]))]) @ _homographies(plane, xy, all_of)[0].T
    with np.errstate(divide="ignore", invalid="ignore"):  # corners in another order may lie on its horizon
        r = (p[:, :2] / p[:, 2:] - xy[0]) * np.array(camera["focal_px"])
    left = float(np.sqrt(np.mean(np.sum(r**2, axis=1))))
    return left if np.isfinite(left) else np.inf


def _on_a_line(points: FloatArray, known: BoolArray) -> BoolArray:
    """(M,) do those of the points (K, 2) that a picture knows (M, K) lie on a line?"""
    about = _centred(points, known)[0]
    size = np.linalg.svd(np.where(known[..., np.newaxis], about, 0.0), compute_uv=False)
    return np.asarray(size[:, 1] < 1e-4 * size[:, 0])


def _poses(camera: Mapping[str, Any], points: FloatArray, seen: FloatArray, known: BoolArray) -> FloatArray:
    """(M, 4, 4) T_camera_board by Gauss' and Newton's steps from the homography, in sizes of the board.

    Args:
        camera: As a robot file has it.
        points: (K, 3) of the board [m].
        seen: (M, K, 2) of each picture [px], where it is known (M, K).
        known: Of each picture at least _FEWEST, not on a line.
    """
    lens, size = lens_numbers(camera), float(np.ptp(points))
    at = points / size
    seen = np.where(known[..., np.newaxis], seen, np.array(lens[2:4]))
    best = _of_homographies(at[:, :2], _directions(camera, seen), known)
    T, least, going = best.copy(), np.full(len(best), np.inf), np.arange(len(best))
    differences = [moved(np.eye(4), _DIFFERENCE * e) for e in np.vstack([np.zeros(6), np.eye(6)])]
    turns, shifts = (np.array([D[:3, part] for D in differences]) for part in (slice(0, 3), 3))
    for _ in range(_STEPS):
        R, t = T[going, np.newaxis, :3, :3] @ turns, T[going, np.newaxis, :3, 3] + shifts
        before = at @ R.swapaxes(-1, -2) + t[:, :, np.newaxis]  # (m, 7, K, 3)
        drawn = np.asarray(_core.draw(camera["model"], lens, before.reshape(-1, 3))).reshape(*before.shape[:3], 2)
        r = np.where(known[going, np.newaxis, :, np.newaxis], drawn - seen[going, np.newaxis], 0.0)
        r = r.reshape(len(going), len(differences), -1)
        cost = np.sum(r[:, 0] ** 2, axis=1)
        is_better = cost < least[going]
        is_done = ~is_better | (cost > (1 - _GAIN) * least[going])
        best[going[is_better]], least[going[is_better]] = T[going[is_better]], cost[is_better]
        going, r = going[~is_done], r[~is_done]
        if not len(going):
            break
        J = ((r[:, 1:] - r[:, :1]) / _DIFFERENCE).swapaxes(1, 2)
        by = -(np.linalg.pinv(J) @ r[:, 0, :, np.newaxis])[..., 0]
        T[going] = [moved(of, step) for of, step in zip(T[going], by, strict=True)]
    best[:, :3, 3] *= size
    return best


def moved(T: FloatArray, by: FloatArray) -> FloatArray:
    """The pose shifted by (3,) and turned by (3,) [rad] in its own axes."""
    out = T.copy()
    out[:3, :3] = T[:3, :3] @ np.asarray(_core.exp_so3(by[3:]))
    out[:3, 3] += by[:3]
    return out


def _directions(camera: Mapping[str, Any], seen: FloatArray) -> FloatArray:
    """(M, K, 2) X / Z and Y / Z of what is seen at (M, K, 2) px."""
    lens = lens_numbers(camera)
    focal = np.array(lens[:2])
    straight = (seen - np.array(lens[2:4])) / focal
    xy, flat = straight.reshape(-1, 2), seen.reshape(-1, 2)
    with np.errstate(over="ignore", invalid="ignore"):  # a lens that turns back before it comes there
        for _ in range(_ROUNDS):
            drawn = np.asarray(_core.draw(camera["model"], lens, np.column_stack([xy, np.ones(len(xy))])))
            xy = xy + (flat - drawn) / focal
    found = xy.reshape(seen.shape)
    return np.asarray(np.where(np.isfinite(found).all(axis=(1, 2), keepdims=True), found, straight))


def _centred(points: FloatArray, known: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(M, K, 2) points (K, 2) about the middle of those known (M, K), in sizes of these; middles (M, 2), sizes (M,)."""
    of = np.where(known[..., np.newaxis], points, np.nan)
    middle = np.nanmean(of, axis=1)
    size = np.nanmax(of, axis=(1, 2)) - np.nanmin(of, axis=(1, 2))
    return (points - middle[:, np.newaxis]) / size[:, np.newaxis, np.newaxis], middle, size


def _homographies(p: FloatArray, xy: FloatArray, known: BoolArray) -> FloatArray:
    """(M, 3, 3) H of p (M, K, 2) to xy (M, K, 2), where known (M, K), of any size."""
    one = np.concatenate([p, np.ones((*p.shape[:2], 1))], axis=2)
    none = np.zeros_like(one)
    rows = [
        np.concatenate([*(before, after), -xy[..., axis : axis + 1] * one], axis=2)
        for axis, (before, after) in enumerate(((one, none), (none, one)))
    ]
    columns = np.where(known[..., np.newaxis], rows, 0.0)  # (2, M, K, 9)
    M, K = p.shape[:2]
    every = columns.swapaxes(0, 1).reshape(M, 2 * K, 9)
    return np.asarray(np.linalg.svd(every, full_matrices=False)[2][:, -1].reshape(M, 3, 3))


def _of_homographies(points: FloatArray, xy: FloatArray, known: BoolArray) -> FloatArray:
    """(M, 4, 4) the poses in which points (K, 2) of a plane are seen in directions (M, K, 2), where known (M, K)."""
    p, middle, size = _centred(points, known)
    H = _homographies(p, xy, known)
    H = H / np.sqrt(np.linalg.norm(H[:, :, 0], axis=1) * np.linalg.norm(H[:, :, 1], axis=1))[:, np.newaxis, np.newaxis]
    H = np.where(H[:, 2:, 2:] > 0, H, -H)  # before the camera
    out = np.tile(np.eye(4), (len(H), 1, 1))
    out[:, :3, :3] = nearest_rotation(np.stack([H[..., 0], H[..., 1], np.cross(H[..., 0], H[..., 1])], axis=2))
    out[:, :3, 3] = size[:, np.newaxis] * H[..., 2] - np.einsum("nij,nj->ni", out[:, :3, :2], middle)
    return out
