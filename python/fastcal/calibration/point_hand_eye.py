# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a sensor that reads points, and the point that it reads, stand on their frames, without an initial guess.

A_k X s_k = b of readings k: s_k a point in the sensor, X the sensor on its frame, A_k that frame in the target's frame,
b the target there. Linear in R_X, t_X and b; of the rotation nearest to that R_X, and of those that turn axes into
axes, the ones that leave least are refined.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal.calibration.picture_readings import BETTER, SLIPS
from fastcal.measurements.rotations import nearest_rotation
from fastcal.robot.se3 import inverses, pose, skew

FloatArray = NDArray[np.float64]

FEWEST = 4  # readings, of which each gives three equations for nine unknowns
_REFINED, _STEPS = 6, 30  # starts, and steps of each
_GROSS = 5e-3  # [m] from which on a reading counts linearly
_MOST = 200  # readings that say enough
_ENOUGH = 8  # readings that nine numbers do not fit by chance
_FAR = 0.02  # [m]


def point_hand_eye(A: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """(4, 4) X and (3,) b [m] of poses (N, 4, 4) and points (N, 3) [m]; None from too few readings."""
    if len(A) < FEWEST:
        return None
    some = np.unique(np.linspace(0, len(A) - 1, min(len(A), _MOST)).astype(int))
    R_A, t_A, s = A[some, :3, :3], A[some, :3, 3], s[some]
    starts = [(R, *_shifts(R_A, t_A, s, R)) for R in (*Rotation.create_group("O").as_matrix(), _linear(R_A, t_A, s))]
    starts.sort(key=lambda of: _cost(_left(R_A, t_A, s, *of)))
    found = [_refined(R_A, t_A, s, *of) for of in starts[:_REFINED]]
    R, t, b = min(found, key=lambda of: _cost(_left(R_A, t_A, s, *of)))
    return pose(R, t), b


def _left(R_A: FloatArray, t_A: FloatArray, s: FloatArray, R: FloatArray, t: FloatArray, b: FloatArray) -> FloatArray:
    """(N, 3) A X s - b."""
    return np.asarray(np.einsum("nij,nj->ni", R_A, s @ R.T + t) + t_A - b)


def _cost(left: FloatArray) -> float:
    """Squares of small distances, and large ones by their size."""
    return float(np.sum(np.sqrt(1 + np.sum(left**2, axis=1) / _GROSS**2) - 1))


def _refined(
    R_A: FloatArray, t_A: FloatArray, s: FloatArray, R: FloatArray, t: FloatArray, b: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gauss' and Newton's steps of R exp([w]), t and b, each reading by its weight in `_cost`."""
    best = R, t, b
    for _ in range(_STEPS):
        left = _left(R_A, t_A, s, R, t, b)
        if not _cost(left) <= _cost(_left(R_A, t_A, s, *best)):
            break
        best = R, t, b
        root = (1 + np.sum(left**2, axis=1) / _GROSS**2)[:, np.newaxis] ** -0.25
        turned = -R_A @ R @ np.array([skew(point) for point in s])
        J = np.concatenate([turned, R_A, np.broadcast_to(-np.eye(3), R_A.shape)], axis=2) * root[:, :, np.newaxis]
        step = np.linalg.lstsq(J.reshape(-1, 9), -(root * left).ravel(), rcond=1e-9)[0]
        R, t, b = R @ Rotation.from_rotvec(step[:3]).as_matrix(), t + step[3:6], b + step[6:]
    return best


def meant_by_points(A: FloatArray, s: FloatArray) -> str | None:
    """What was meant where points are far from A X s = b: which end moves, their rows or unit; None: nothing fits."""
    if len(A) < _ENOUGH or (as_given := _missed(A, s)) < _FAR:
        return None
    ends = "does the sensor stand where the file has the target, and the target there, or are the arm's poses inverse"
    tried = [(ends, inverses(A), s)]
    for slip in SLIPS[1:]:
        rows = np.arange(max(slip, 0), len(A) + min(slip, 0))
        if len(rows) >= _ENOUGH:
            tried.append((f"are the points shifted by {slip} rows", A[rows - slip], s[rows]))
    unit = "are the points' lengths {:.4g} times those of the arm, in another unit"
    tried += [(unit.format(1 / times), A, times * s) for times in (1e-3, 1e3)]
    least, words = min((_missed(of, points), words) for words, of, points in tried)
    return f"{words}?" if least * BETTER < as_given else None


def _missed(A: FloatArray, s: FloatArray) -> float:
    """Median of what readings miss [m]."""
    found = point_hand_eye(A, s)
    if found is None:
        return np.inf
    X, b = found
    at = np.einsum("nij,nj->ni", A[:, :3, :3] @ X[:3, :3], s) + (A @ X)[:, :3, 3]
    return float(np.median(np.linalg.norm(at - b, axis=1)))


def _linear(R_A: FloatArray, t_A: FloatArray, s: FloatArray) -> FloatArray:
    """(3, 3) the rotation nearest to the least squares of all fifteen unknowns."""
    of_R = np.einsum("nij,nk->nikj", R_A, s).reshape(-1, 9)  # R_A R s, R column by column
    one = np.broadcast_to(np.eye(3), R_A.shape).reshape(-1, 3)
    x = np.linalg.lstsq(np.hstack([of_R, R_A.reshape(-1, 3), -one]), -t_A.ravel(), rcond=1e-9)[0]
    return nearest_rotation(x[:9].reshape(3, 3).T)


def _shifts(R_A: FloatArray, t_A: FloatArray, s: FloatArray, R: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(3,) t_X and (3,) b with a rotation that is known."""
    one = np.broadcast_to(np.eye(3), R_A.shape).reshape(-1, 3)
    right = -(t_A + np.einsum("nij,nj->ni", R_A @ R, s)).ravel()
    x = np.linalg.lstsq(np.hstack([R_A.reshape(-1, 3), -one]), right, rcond=1e-9)[0]
    return x[:3], x[3:]
