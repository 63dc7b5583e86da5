# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise with heavy tails: the model that is written weighs each row by how far it is off.

Least squares is unbiased whatever the tails, and so are the search and its tests, but the few rows that err more than
the others move its parameters more than they should. Of a row with d studentized numbers e,
    w = (nu + d) / (nu + |e|^2 / s^2),   s^2 = sum w |e|^2 / sum d,
is the step of EM for Student's t with nu degrees of freedom (K. Lange, R. Little, J. Taylor, "Robust statistical
modeling using the t distribution", 1989). The covariance is that of an M-estimator (P. Huber, "Robust Statistics",
1981, section 7.6): mean (w e)^2 / (mean of d(w e)/de)^2 (J^T J)^-1, with J^T J = J^T W J / mean w.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import special

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.parallel import each
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.problem import Problem
from fastcal.diagnosis.robust_rows import studentized_residuals

_NU = (3.0, 4.0, 6.0, 10.0, 20.0)
_ROUNDS, _SETTLED = 100, 1e-6  # of EM for the scale
_REFITS = 3
_NONE = np.zeros(0, dtype=np.intp)


def weighed(problem: Problem, found: Fit) -> Problem:
    """The problem with weights of its rows, by what a fit leaves of them; as it is where normal noise would do.

    Noise with a memory is left alone: no row of it errs by itself. So are rows whose weighed fit does not converge.
    """
    if not problem.noise.is_white:
        return problem
    rows = _Rows.of(found)
    if rows.worth < rules.HEAVY_TAILS_GAIN:
        return problem
    out = problem
    for _ in range(_REFITS):
        weight = np.ones(len(problem.used))
        weight[found.problem.rows[rows.at]] = rows.weight
        out = replace(problem, weight=weight, noise=replace(problem.noise, factor=rows.factor))
        found = fit(out, found.added, found)
        if not found.converged:
            return problem
        rows = _Rows.of(found)
    return out


@dataclass(frozen=True, eq=False)
class _Rows:
    """What a fit leaves of its rows, as the t noise that makes it likeliest.

    Attributes:
        at: (N,) fitted rows that hold numbers.
        count: (N,) d of each.
        square: (N,) |e|^2, for `Noise.factor` 1 and without the weights of the fit.
        nu: Degrees of freedom of t.
        scale: s^2.
        worth: Twice the log of its likelihood over that of normal noise, each with its own scale.
    """

    at: IndexArray
    count: IndexArray
    square: FloatArray
    nu: float
    scale: float
    worth: float

    @staticmethod
    def of(found: Fit) -> _Rows:
        """The rows of a fit."""
        problem = found.problem
        square, count = studentized_residuals(*found.whitened, _NONE)
        at = np.flatnonzero(count)
        square, count = square[at] * problem.noise.factor**2, count[at]
        if problem.weight is not None:
            square = square / problem.weight[problem.rows[at]]
        nu, scale, worth = max(each(partial(_likeliest, square, count), _NU), key=lambda of: of[2])
        return _Rows(at, count, square, nu, scale, worth)

    @property
    def weight(self) -> FloatArray:
        """(N,) w."""
        return np.asarray((self.nu + self.count) / (self.nu + self.square / self.scale))

    @property
    def factor(self) -> float:
        """`Noise.factor` with which the covariance of a fit with these weights is that of an M-estimator."""
        w, d = self.weight, self.count
        slope = d * w - 2 * w**2 / (self.nu + d) * self.square / self.scale
        return float(np.sqrt(np.sum(w**2 * self.square) * np.sum(d * w)) / np.sum(slope))


def _likeliest(square: FloatArray, d: IndexArray, nu: float) -> tuple[float, float, float]:
    """Degrees of freedom, scale and worth, as `_Rows` has them, of t noise with these degrees of freedom."""
    numbers = d.sum()
    scale = normal = float(square.sum() / numbers)
    for _ in range(_ROUNDS):
        before, scale = scale, float(np.sum((nu + d) / (nu + square / scale) * square) / numbers)
        if abs(scale / before - 1) < _SETTLED:
            break
    shape = special.gammaln((nu + d) / 2) - special.gammaln(nu / 2) - d / 2 * np.log(nu * np.pi * scale)
    tails = 2 * np.sum(shape) - np.sum((nu + d) * np.log1p(square / scale / nu))
    return nu, scale, float(tails + numbers * (np.log(2 * np.pi * normal) + 1))
