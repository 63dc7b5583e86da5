# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Hand-eye and robot-world calibration in closed form: X and Y of A_i X S_i = Y from poses A_i and S_i.

Turns: sum_i kron(R_Si, R_Ai) maps the columns of X^T to those of Y; its largest singular pair is X and Y (M. Shah,
"Solving the robot-world/hand-eye calibration problem using the Kronecker product", 2013). Then the places are linear:
R_Ai t_X - t_Y = -R_Ai R_X t_Si - t_Ai.

Up to half of the poses may be wrong: of all poses and of small subsets, each followed by those poses that agree with it
best, that solution counts which a share of all poses agrees with best (least trimmed squares by concentration,
P. Rousseeuw and K. Van Driessen 2006); then all poses that agree with it are used.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal.measurements.rotations import nearest_rotation

FloatArray = NDArray[np.float64]

FEWEST = 3  # poses
_SHARE = 0.4  # of the poses that are surely right
_FEWEST_RIGHT = 5  # of few poses so many: fewer agree in many ways
_SUBSETS, _SUBSET = 200, 4  # drawn, and poses of each
_CONCENTRATIONS = 3
_ROUNDS = 6
_GROSS = 10.0  # the same: no noise makes such a pose
_FAR = 4.0  # times the misfit of the right ones' last: such a pose is left out of the next round


def hand_eye(A: FloatArray, S: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """(4, 4) X and Y of poses A, S (N, 4, 4) [m]; None from fewer than three."""
    if len(A) < FEWEST:
        return None
    right = _right(len(A))
    random = np.random.default_rng(0)  # always the same subsets
    subsets = [random.choice(len(A), _SUBSET, replace=False) for _ in range(_SUBSETS)] if right < len(A) else []
    agreeing, least = np.arange(len(A)), np.inf
    for start in [agreeing[np.newaxis], *([np.array(subsets)] if subsets else [])]:
        used: NDArray[np.intp] = start
        for _ in range(_CONCENTRATIONS):
            misfit = _misfits(A, S, used)
            used = np.argpartition(misfit, right - 1, axis=1)[:, :right]
            costs = np.sum(np.take_along_axis(misfit, used, axis=1) ** 2, axis=1)
            if costs.min() < least:
                agreeing, least = used[int(np.argmin(costs))], float(costs.min())
    for _ in range(_ROUNDS):
        kept = np.flatnonzero(~_beyond(_misfits(A, S, agreeing[np.newaxis])[0], _FAR))
        if np.array_equal(kept, agreeing):
            break
        agreeing = kept
    return solved_alike(A[agreeing], S[agreeing])


def gross(A: FloatArray, S: FloatArray, X: FloatArray, Y: FloatArray) -> NDArray[np.bool_]:
    """(N,) poses that are so far from A X S = Y that they are of something else."""
    return _beyond(np.asarray(np.linalg.norm(A @ X @ S - Y, axis=(1, 2))), _GROSS)


def disagreement(A: FloatArray, S: FloatArray) -> float:
    """Median misfit of the poses with the places that most agree with [m, a turn of 1 rad counting as 1 m]."""
    solved = hand_eye(A, S)
    if solved is None:
        return np.inf
    return float(np.median(np.linalg.norm(A @ solved[0] @ S - solved[1], axis=(1, 2))))


def with_lengths(S: FloatArray, scale: float) -> FloatArray:
    """Poses (N, 4, 4) whose lengths are so many times as large."""
    out = S.copy()
    out[:, :3, 3] *= scale
    return out


def length_ratio(A: FloatArray, S: FloatArray) -> float | None:
    """How many times as large the lengths of S would have to be; None where turns do not agree, or show no length.

    With the turns of X and Y, R_A t_X - t_Y + s R_A R_X t_S = -t_A is linear in the places and s.
    """
    turns_A, turns_S = A.copy(), S.copy()
    turns_A[:, :3, 3], turns_S[:, :3, 3] = 0.0, 0.0
    solved = hand_eye(turns_A, turns_S)
    if solved is None:
        return None
    RX = solved[0][:3, :3]
    off = np.linalg.norm(turns_A @ solved[0] @ turns_S - solved[1], axis=(1, 2))
    good = off <= max(4 * float(np.median(off)), 1e-6)
    RA, n = A[good, :3, :3], int(good.sum())
    if n < FEWEST:
        return None
    moved = np.einsum("nij,jk,nk->ni", RA, RX, S[good, :3, 3])
    unit = np.broadcast_to(-np.eye(3), RA.shape)
    columns = np.concatenate([RA, unit, moved[:, :, np.newaxis]], axis=2).reshape(3 * n, 7)
    x, _, rank, _ = np.linalg.lstsq(columns, -A[good, :3, 3].ravel(), rcond=1e-9)
    return float(x[-1]) if rank == columns.shape[1] and x[-1] > 0 else None


def _right(count: int) -> int:
    """How many of so many poses are surely right."""
    return max(min(count, _FEWEST_RIGHT), int(np.ceil(_SHARE * count)))


def _beyond(misfit: FloatArray, times: float) -> NDArray[np.bool_]:
    right = _right(len(misfit)) - 1
    return np.asarray(misfit > times * max(float(np.partition(misfit, right)[right]), 1e-9))


def _misfits(A: FloatArray, S: FloatArray, used: NDArray[np.intp]) -> FloatArray:
    """(B, N) of all poses, with X and Y of each of the subsets used (B, m); 1 rad counts as 1 m."""
    X, Y = solved_sets(A[used], S[used])
    return np.asarray(np.linalg.norm(A @ X[:, np.newaxis] @ S - Y[:, np.newaxis], axis=(2, 3)))


def solved_alike(A: FloatArray, S: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(4, 4) X and Y, all poses (N, 4, 4) alike."""
    X, Y = solved_sets(A[np.newaxis], S[np.newaxis])
    return X[0], Y[0]


def solved_sets(A: FloatArray, S: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(B, 4, 4) X and Y of sets of poses (B, m, 4, 4), those of a set alike."""
    RA, RS = A[..., :3, :3], S[..., :3, :3]
    # vec (column by column) of R_A R_X R_S = R_Y: kron(R_S^T, R_A) vec(R_X) = vec(R_Y).
    K = np.einsum("bnji,bnkl->bikjl", RS, RA).reshape(-1, 9, 9)
    left, _, right = np.linalg.svd(K)
    RX = _turn(right[:, 0].reshape(-1, 3, 3).transpose(0, 2, 1))[:, np.newaxis]
    RY = _turn(left[:, :, 0].reshape(-1, 3, 3).transpose(0, 2, 1))
    turned = RA @ RX @ RS
    mean = nearest_rotation(np.mean(turned, axis=1))
    off, off_mean = (np.sum((turned - R[:, np.newaxis]) ** 2, axis=(1, 2, 3)) for R in (RY, mean))
    RY = np.where((off > off_mean)[:, np.newaxis, np.newaxis], mean, RY)
    columns = np.concatenate([RA, np.broadcast_to(-np.eye(3), RA.shape)], axis=3).reshape(len(A), -1, 6)
    right_side = -(np.einsum("bnij,bnj->bni", RA @ RX, S[..., :3, 3]) + A[..., :3, 3]).reshape(len(A), -1)
    t = np.einsum("bij,bj->bi", np.linalg.pinv(columns), right_side)
    X, Y = np.tile(np.eye(4), (2, len(A), 1, 1))
    X[:, :3, :3], X[:, :3, 3], Y[:, :3, :3], Y[:, :3, 3] = RX[:, 0], t[:, :3], RY, t[:, 3:]
    return X, Y


def _turn(M: FloatArray) -> FloatArray:
    """The rotations (B, 3, 3) of matrices that are such but for their size and sign."""
    return nearest_rotation(M * np.sign(np.linalg.det(M))[:, np.newaxis, np.newaxis])
