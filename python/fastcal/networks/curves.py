# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A smooth curve of error over each joint, all at once: ridge regression of residuals on harmonics.

    min_c  sum |r_k - sum_i J_i (c_i . h(phase_i))|^2 / unit^2 + ridge |c|^2

Order and ridge are the ones with the least mean error on held-out folds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import linalg

from fastcal.arrays import FloatArray, IndexArray
from fastcal.correction.joints import Phases, harmonics
from fastcal.networks.problem import Problem

ORDERS = (4, 16, 48, 120)  # the highest sees one cycle a motor turn behind a usual reduction
RIDGES = (1e-3, 1e-2, 1e-1, 1.0, 10.0)
CORNER = 10.0


def phases_of(problem: Problem) -> Phases:
    """Phases of the arm's joints, and the load's scale, for the rows of a problem."""
    turning = np.array([kind == "revolute" for kind in problem.robot.joint_types])
    q = problem.inputs.q
    low, high = q.min(axis=0), q.max(axis=0)
    rate = np.where(turning, 1.0, np.pi / (2 * np.maximum(high - low, 1e-9)))
    payload = problem.inputs.payload
    spread = float(payload.std())
    gain = 1 / spread if spread > 1e-9 else 0.0
    return Phases(rate, np.where(turning, 0.0, -rate * (low + high) / 2), float(payload.mean()), gain)


def columns(phases: Phases, problem: Problem, order: int) -> FloatArray:
    """(N, k, n 2 H): what each coefficient adds to the residuals in units."""
    h, J = harmonics(phases(problem.inputs), order, CORNER), problem.J
    return np.asarray(np.einsum("nij,njk->nijk", J, h).reshape(*J.shape[:2], -1))


class Ridge:
    """Ridge regression on the columns A (N, k, K), for any of the rows and again and again for other residuals.

    Args:
        A: What each coefficient adds to each row.
    """

    def __init__(self, A: FloatArray) -> None:
        self._rows = A
        self._A = A.reshape(-1, A.shape[2])
        self._G = self._A.T @ self._A

    def gram(self, own: IndexArray) -> FloatArray:
        """(K, K) A^T A of some rows; the others are taken away from all, since they are fewer."""
        other = np.setdiff1d(np.arange(len(self._rows)), own)
        others = self._rows[other].reshape(-1, self._A.shape[1])
        return np.asarray(self._G - others.T @ others)

    def right(self, own: IndexArray, wanted: FloatArray) -> FloatArray:
        """(K,) A^T r of some rows, wanted (N, k)."""
        alone = np.zeros_like(wanted)
        alone[own] = wanted[own]
        return np.asarray(self._A.T @ alone.ravel())

    def factor(self, gram: FloatArray, ridge: float) -> Any:
        """For `linalg.cho_solve`."""
        least = 1e-13 * np.trace(gram)  # below it, rounding decides
        held = gram.copy()
        held[np.diag_indices_from(held)] += max(ridge, least)
        # A symmetric matrix is its transpose, which is in LAPACK's order and needs no copy.
        return linalg.cho_factor(held.T, overwrite_a=True, check_finite=False)


def choose(problem: Problem, phases: Phases, wanted: FloatArray) -> tuple[int, float]:
    """Order and ridge of least mean error over the folds, for wanted (N, k) in units.

    Orders with more coefficients than half the measured numbers are left out.
    """
    best, least = (ORDERS[0], RIDGES[-1]), np.inf
    joints = problem.robot.joint_count
    fitting = [order for order in ORDERS if 2 * joints * order <= problem.measured.sum() / 2]
    for order in fitting or ORDERS[:1]:
        A = columns(phases, problem, order)
        regression = Ridge(A)
        left = {ridge: np.empty_like(wanted) for ridge in RIDGES}
        for fold, own in enumerate(problem.training_rows()):
            held = np.flatnonzero(problem.folds == fold)
            gram, right = regression.gram(own), regression.right(own, wanted)
            for ridge in RIDGES:
                left[ridge][held] = wanted[held] - A[held] @ linalg.cho_solve(regression.factor(gram, ridge), right)
        for ridge, errors in left.items():
            mean = float(np.linalg.norm(errors, axis=1).mean())
            if mean < least:
                best, least = (order, ridge), mean
    return best
