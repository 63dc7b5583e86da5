# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a fit predicts of rows that it has not seen: each fold of the poses by the others, linearized at the fit.

With A the whitened rows with their priors, F the fitted rows of the other folds and r what the fit leaves,
    b = (A_F^T A_F)^-1 A_F^T r_F,   e = r - A b   in the rows of the fold.
Every measured row is predicted, also those that the fit leaves out: a model may not win by leaving out what it misses.
A gross row counts, but decides nothing: beyond LOSS_SIZE typical rows its loss grows with its size and no more with the
square (P. Huber 1964).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal.calibration.repeatability import pose_folds
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.problem import Problem

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_RIDGE = 1e-10  # on unit columns: for those that the others span


def folds(problem: Problem) -> NDArray[np.intp]:
    """(N,) fold of each fitted row: all visits of a pose in one, whichever rows are fitted."""
    measured = problem.data.measured
    out = np.full(len(measured), -1, dtype=np.intp)
    out[measured] = pose_folds(problem.data.select(measured), rules.FOLDS, np.random.default_rng(0))
    return out[problem.used]


class HeldOut:
    """Held-out rows of one fit.

    Args:
        at: The fit.
        fitted: (N,) rows of the data that the predictions are fitted to; None: those of the fit.
        more: (m, k) further columns over the numbers and priors of the fit, after its own; the rows that it leaves out
            are not predicted then.
    """

    def __init__(self, at: Fit, fitted: BoolArray | None = None, more: FloatArray | None = None) -> None:
        every, (A, self._r, row) = at.on_every_row if more is None else (at.problem, at.whitened)
        value = at.theta[at.free]
        if more is not None:
            A, value = np.hstack([A, more]), np.append(value, np.zeros(more.shape[1]))
        length = np.linalg.norm(A, axis=0)
        self._A = A / np.where(length > 0, length, 1.0)
        self._value = value * length
        self._factor = at.problem.noise.factor
        self._rows = every.rows
        self._row = row
        self._count = len(at.problem.data)
        fold = folds(every)
        used = (at.problem.used if fitted is None else fitted)[every.rows]
        self._numbers = [np.flatnonzero((row >= 0) & (fold[row] == k)) for k in range(rules.FOLDS)]
        self._fitted = [n[used[row[n]]] for n in self._numbers]
        self._priors = np.flatnonzero(row < 0)
        parts = [self._A[n] for n in self._fitted]
        self._normal = [part.T @ part for part in parts]
        prior = self._A[self._priors]
        self._whole = np.sum(self._normal, axis=0) + prior.T @ prior

    def squares(self, without: Sequence[int] = ()) -> FloatArray:
        """(N,) squared error of each measured row in units of its claimed noise; NaN where nothing was measured.

        Args:
            without: Columns of the fit, as it counts its free parameters, that are left out at the value 0.
        """
        A, kept = self._A, np.setdiff1d(np.arange(self._A.shape[1]), without)
        own = list(without)
        r = self._r + A[:, own] @ self._value[own]
        g = [A[n].T @ r[n] for n in self._fitted]
        whole = np.sum(g, axis=0) + A[self._priors].T @ r[self._priors]
        square = np.zeros(len(self._rows))
        for k, out in enumerate(self._numbers):
            normal = (self._whole - self._normal[k])[np.ix_(kept, kept)]
            normal[np.diag_indices_from(normal)] += _RIDGE
            step = np.zeros(A.shape[1])
            step[kept] = linalg.solve(normal, (whole - g[k])[kept], assume_a="pos", check_finite=False)
            square += np.bincount(self._row[out], (r[out] - A[out] @ step) ** 2, len(square))
        found = np.full(self._count, np.nan)
        found[self._rows] = square * self._factor**2
        return found


def gain(rival: FloatArray, incumbent: FloatArray) -> tuple[float, float]:
    """By how much a rival's squares (N,) are less than another one's, a row, and its standard error.

    Both as a share of what the other one leaves. A row's loss is its square up to LOSS_SIZE typical rows.
    """
    known = np.isfinite(incumbent) & np.isfinite(rival)
    limit = rules.LOSS_SIZE * float(np.sqrt(np.median(np.concatenate([incumbent[known], rival[known]]))))

    def loss(square: FloatArray) -> FloatArray:
        return np.where(square <= limit**2, square, 2 * limit * np.sqrt(np.maximum(square, 0.0)) - limit**2)

    before = loss(incumbent[known])
    less = before - loss(rival[known])
    scale = max(float(before.mean()), 1e-300)
    return float(less.mean()) / scale, float(less.std(ddof=1) / np.sqrt(len(less))) / scale


def is_better(rival: FloatArray, incumbent: FloatArray) -> bool:
    """Does a rival with these squares (N,) predict held-out rows better by MIN_RIVAL_GAIN standard errors?"""
    less, error = gain(rival, incumbent)
    return less > rules.MIN_RIVAL_GAIN * error
