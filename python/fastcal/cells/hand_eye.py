# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Hand-eye and robot-world calibration in closed form: X and Y of A_i X S_i = Y from poses A_i and S_i.

Turns: sum_i kron(R_Si, R_Ai) maps the columns of X^T to those of Y; its largest singular pair is X and Y (M. Shah,
"Solving the robot-world/hand-eye calibration problem using the Kronecker product", 2013). Then the places are linear:
R_Ai t_X - t_Y = -R_Ai R_X t_Si - t_Ai. Poses that do not agree are left out, round by round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

FEWEST = 3  # poses
_ROUNDS = 6
_LEAST_KEPT = 0.6  # of the poses: fewer agree in many ways
_FAR = 4.0  # times the median misfit: such a pose is left out of the next round


def hand_eye(A: FloatArray, S: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """(4, 4) X and Y of poses A, S (N, 4, 4) [m]; None from fewer than three."""
    if len(A) < FEWEST:
        return None
    used = np.ones(len(A), dtype=bool)
    X, Y = np.eye(4), np.eye(4)
    for _ in range(_ROUNDS):
        X, Y = _solved(A[used], S[used])
        misfit = np.linalg.norm(A @ X @ S - Y, axis=(1, 2))
        kept = misfit <= _FAR * max(float(np.median(misfit)), 1e-9)
        if kept.sum() < max(FEWEST, _LEAST_KEPT * len(A)) or (kept == used).all():
            break
        used = kept
    return X, Y


def _solved(A: FloatArray, S: FloatArray) -> tuple[FloatArray, FloatArray]:
    """All poses alike."""
    RA, RS = A[:, :3, :3], S[:, :3, :3]
    # vec (column by column) of R_A R_X R_S = R_Y: kron(R_S^T, R_A) vec(R_X) = vec(R_Y).
    K = np.mean([np.kron(s.T, a) for s, a in zip(RS, RA, strict=True)], axis=0)
    left, _, right = np.linalg.svd(K)
    RX = _turn(right[0].reshape(3, 3, order="F"))
    RY = _turn(left[:, 0].reshape(3, 3, order="F"))
    if np.linalg.norm(RA @ RX @ RS - RY) > np.linalg.norm(RA @ RX @ RS - _nearest(np.mean(RA @ RX @ RS, axis=0))):
        RY = _nearest(np.mean(RA @ RX @ RS, axis=0))
    columns = np.concatenate([np.concatenate([a, -np.eye(3)], axis=1) for a in RA])
    right_side = -(np.einsum("nij,jk,nk->ni", RA, RX, S[:, :3, 3]) + A[:, :3, 3]).ravel()
    t = np.linalg.lstsq(columns, right_side, rcond=None)[0]
    X, Y = np.eye(4), np.eye(4)
    X[:3, :3], X[:3, 3], Y[:3, :3], Y[:3, 3] = RX, t[:3], RY, t[3:]
    return X, Y


def _turn(M: FloatArray) -> FloatArray:
    """The rotation of a matrix that is one but for its size and sign."""
    return _nearest(M if np.linalg.det(M) > 0 else -M)


def _nearest(M: FloatArray) -> FloatArray:
    """The rotation nearest to a matrix (3, 3)."""
    u, _, vt = np.linalg.svd(M)
    return np.asarray(u @ np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ vt)))]) @ vt)
