# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Profile-likelihood intervals, for fits that are not linear within their confidence intervals.

The profile of parameter k is the least sum of squares over all other parameters, F_k(u) = min |r(theta)|^2 at
theta_k = u. Its interval ends where

    F_k(u) = F (1 + t^2 / (m - p)),   F = |r|^2 of the fit, t Student's for m - p degrees of freedom,

which is theta_k -+ t s_k of a straight fit, whatever the parameters are (D. Bates and D. Watts, Nonlinear Regression
Analysis, 1988, ch. 6). Each end is found by Newton's steps (D. Venzon and S. Moolgavkar 1988, Appl. Statist. 37): with
J = QR at the last point, C = (J^T J)^-1, b = -R^-1 Q^T r the step to the least square of its straight rows, D what is
still allowed above that,

    d = b + C e_k (u - b_k) / C_kk,   u = b_k -+ sqrt(C_kk D),   D = F (1 + t^2 / (m - p)) - |r|^2 + |Q^T r|^2.
"""

from __future__ import annotations

import numpy as np
from scipy import linalg, special

from fastcal.arrays import FloatArray
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals

LEVEL = 0.95
_STEPS = 25
_LONGEST = 0.5  # of a step [half an interval of the straight fit]
_CLOSE = 0.01  # the same: an end that is found
_FARTHEST = 10.0  # the same: beyond, the rows do not object


class _Rows:
    """The kept rows near a fit, by its free parameters over the halves of their straight intervals."""

    def __init__(self, near: Residuals, problem: CalibrationProblem) -> None:
        self._near, self._problem = near, problem
        J, self.r = near.J[near.kept][:, near.free], near.residual[near.kept]
        self.freedom = len(self.r) - J.shape[1]
        t = float(special.stdtrit(self.freedom, 0.5 + LEVEL / 2))
        square = float(self.r @ self.r)
        self.allowed = square * (1 + t**2 / self.freedom)
        length = np.linalg.norm(J, axis=0)
        R = linalg.qr(J / length, mode="r", check_finite=False)[0][: J.shape[1]]
        std = np.linalg.norm(linalg.solve_triangular(R, np.eye(len(R))), axis=1) / length
        self._half = t * std * np.sqrt(square / self.freedom)
        self.J = J * self._half

    def at(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """J (m, p) and r (m,) away from the fit by x (p,)."""
        theta = self._near.theta.copy()
        theta[self._near.free] += x * self._half
        there = self._problem.linearize(theta, self._near.noise)
        kept = self._near.place[self._near.kept]
        return np.asarray(there.J)[kept][:, self._near.free] * self._half, np.asarray(there.r)[kept]


def reaches(near: Residuals, problem: CalibrationProblem) -> FloatArray:
    """(p, 2) how far the intervals of the free parameters reach down and up, over the half of those of a straight fit.

    1 where an end is not found; infinite where it is beyond _FARTHEST halves.
    """
    rows = _Rows(near, problem)
    return np.array([[_reach(rows, k, sign) for sign in (-1.0, 1.0)] for k in range(rows.J.shape[1])])


def _reach(rows: _Rows, k: int, sign: float) -> float:
    """Of one parameter, down (sign -1) or up (1)."""
    x, J, r = np.zeros(rows.J.shape[1]), rows.J, rows.r
    for _ in range(_STEPS):
        Q, R = linalg.qr(J, mode="economic", check_finite=False)
        along = Q.T @ r
        best = -linalg.solve_triangular(R, along)
        spread = linalg.solve_triangular(R, linalg.solve_triangular(R, np.eye(len(R))[k], trans="T"))
        allowed = max(rows.allowed - float(r @ r) + float(along @ along), 0.0)
        u = best[k] + sign * np.sqrt(spread[k] * allowed)
        step = best + spread * (u - best[k]) / spread[k]
        longest = float(np.abs(step).max())
        x = x + step * _LONGEST / max(longest, _LONGEST)
        if abs(x[k]) > _FARTHEST:
            return np.inf
        if longest < _CLOSE:
            return float(max(sign * x[k], 0.0))
        J, r = rows.at(x)
        if not (np.isfinite(J).all() and np.isfinite(r).all()):
            break
    return 1.0
