# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Smoothness of penalized effects: the curvature that predicts held-out rows best, on the linearized problem.

Coefficient k of an effect has the prior N(0, s^2 / w_k), w_k its penalty: for joint profiles s is the RMS curvature
[rad / rad^2] that is expected. One s for all effects, then one each where that predicts better still, and never a
rougher one than the held-out rows ask for. (S. Wold, "Spline functions in data analysis", 1974.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fastcal.arrays import FloatArray, IntArray
from fastcal.calibration.parallel import each
from fastcal.calibration.row_weights import huber_weights
from fastcal.calibration.tall import over
from fastcal.measurements.splits import deal

Solver = Callable[[FloatArray], FloatArray]

FOLDS = 5
_LIMITS = (-6.0, 1.0)  # of log10 of s
_GRID = np.arange(-6.0, 1.01, 0.5)
_NEAR = np.arange(-1.0, 1.01, 0.5)
_FINE = 0.25
_STEP = 0.5
_SEED = 0
_ROUNDING = (
    1e-13  # of a column's square: a smaller pull is lost in the sums, and the factor of a singular problem fails
)


def prior_deviations(curvature: float, penalty: FloatArray) -> FloatArray:
    """(p,) standard deviations s / sqrt(w_k); infinite where w_k = 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(curvature / np.sqrt(penalty))


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """A whitened linear problem of which some blocks of parameters are penalized.

    Attributes:
        J: (m, p) Jacobian.
        residual: (m,) predicted less measured.
        row: (m,) row of the data of each number; rows are held out whole.
        blocks: For each penalized effect the columns that are its.
        penalties: Their w_k.
        weak: (p,) standard deviations so large that they only keep singular problems solvable.
    """

    J: FloatArray
    residual: FloatArray
    row: IntArray
    blocks: Sequence[IntArray]
    penalties: Sequence[FloatArray]
    weak: FloatArray


def choose_curvatures(problem: LinearProblem, start: Sequence[float] | None = None) -> list[float]:
    """The s of each block, from a `start` where it is given. Rounded to three digits: folds know no more."""
    search = _Search(problem)
    near = search.common(_GRID) if start is None else np.log10(start)
    search.weigh(huber_weights(search.left(near), problem.row))  # outliers are known once the rest fits
    tried = _GRID if start is None else _FINE * np.round(np.median(near) / _FINE) + _NEAR
    return [float(f"{10.0**s:.3g}") for s in search.each(search.common(tried))]


class _Search:
    """Held-out errors by normal equations, summed once a fold."""

    def __init__(self, problem: LinearProblem) -> None:
        self._problem = problem
        rows = np.unique(problem.row)
        fold_of = np.empty(int(rows.max()) + 1, dtype=np.int64)
        fold_of[rows] = deal(len(rows), FOLDS, np.random.default_rng(_SEED))
        self._fold = fold_of[problem.row]
        self._weak = problem.weak**-2.0
        self._block, self._penalty = np.zeros(len(self._weak), dtype=np.intp), np.zeros(len(self._weak))
        for k, (columns, penalty) in enumerate(zip(problem.blocks, problem.penalties, strict=True)):
            self._block[columns], self._penalty[columns] = k, penalty
        self.weigh(np.ones(len(problem.residual)))

    def weigh(self, weight: FloatArray) -> None:
        """Sums the normal equations of each fold at weights (m,)."""
        self._known: dict[tuple[float, ...], float] = {}

        def squares(fold: int) -> tuple[FloatArray, FloatArray, float]:
            of = np.flatnonzero(self._fold == fold)
            root = np.sqrt(weight[of])
            J, r = np.take(self._problem.J, of, axis=0), self._problem.residual[of] * root
            J *= root[:, np.newaxis]
            return J.T @ J, J.T @ r, float(r @ r)

        self._folds = each(squares, range(FOLDS))
        self._A = np.sum([A for A, _, _ in self._folds], axis=0)
        self._least = np.maximum(self._weak, _ROUNDING * np.diag(self._A))
        self._g = np.sum([g for _, g, _ in self._folds], axis=0)
        self._others = [(self._A - A, self._g - g) for A, g, _ in self._folds]

    def common(self, tried: FloatArray) -> FloatArray:
        """log10 of the best s that all blocks share, one each: among those `tried`, ascending, then beside the best.

        Of those every other one, and what lies beside each valley of these.
        """
        blocks = len(self._problem.blocks)
        grid = np.unique(np.clip(tried, *_LIMITS))
        errors = {s: self._error(np.full(blocks, s)) for s in grid[::2]}
        coarse = np.array([np.inf, *errors.values(), np.inf])
        valleys = 2 * np.flatnonzero((coarse[1:-1] <= coarse[:-2]) & (coarse[1:-1] <= coarse[2:]))
        beside = np.unique(np.clip([valleys - 1, valleys + 1], 0, len(grid) - 1))
        errors |= {s: self._error(np.full(blocks, s)) for s in grid[beside]}
        best = min(errors, key=errors.__getitem__)
        errors |= {s: self._error(np.full(blocks, s)) for s in (best - _FINE, best + _FINE)}
        return np.full(blocks, min(errors, key=errors.__getitem__))

    def each(self, log_s: FloatArray) -> FloatArray:
        """From a common start every s by itself: down while it costs nothing, up while it gains."""
        best, least = log_s.copy(), self._error(log_s)
        nothing = least / len(self._problem.residual)  # what one number's noise adds
        for block in range(len(best)):
            solve = each(partial(self._beside, block, best), range(FOLDS))
            for direction, slack in ((-_STEP, nothing), (_STEP, -nothing)):
                while True:
                    trial = best.copy()
                    trial[block] = np.clip(trial[block] + direction, *_LIMITS)
                    if trial[block] == best[block] or (error := self._error(trial, solve)) > least + slack:
                        break
                    best, least = trial, min(error, least)
        return best

    def left(self, log_s: FloatArray) -> FloatArray:
        """(m,) what a fit to all rows leaves."""
        return self._problem.residual - self._problem.J @ self._solve(self._A, self._g, log_s)

    def _error(self, log_s: FloatArray, solve: Sequence[Solver] | None = None) -> float:
        """Weighted sum of squares of the rows of every fold, fitted to the others; each worked out once.

        `solve` finds the coefficients, fold by fold, where another way than `_solve` does.
        """
        key = tuple(np.round(log_s, 6).tolist())
        if key in self._known:
            return self._known[key]

        def squares_of(fold: int) -> float:
            A, g, squares = self._folds[fold]
            b = self._solve(*self._others[fold], log_s) if solve is None else solve[fold](log_s)
            return float(squares - 2 * b @ g + b @ A @ b)

        self._known[key] = sum(each(squares_of, range(FOLDS)))
        return self._known[key]

    def _solve(self, A: FloatArray, g: FloatArray, log_s: FloatArray) -> FloatArray:
        """(A + S^-2)^-1 g, S the priors' deviations; a Cholesky is as accurate in these units as in b / S."""
        from scipy import linalg  # takes longer to import than a fit, and few models have curves

        normal = A.copy()
        normal[np.diag_indices_from(normal)] += self._precision(log_s)
        root = np.linalg.cholesky(normal).T  # without Python's lock, which scipy's holds
        return np.asarray(linalg.cho_solve((root, False), g, check_finite=False))

    def _beside(self, block: int, log_s: FloatArray, fold: int) -> Solver:
        """Solves for a fold's others as `_solve`, at another s of one block: the rest is eliminated once."""
        from scipy import linalg

        A, g = self._others[fold]
        own = self._problem.blocks[block]
        rest = np.setdiff1d(np.arange(len(g)), own)
        normal = np.take(np.take(A, rest, axis=0), rest, axis=1)
        normal[np.diag_indices_from(normal)] += self._precision(log_s)[rest]
        L = np.linalg.cholesky(normal)
        eliminated = over(np.vstack([A[np.ix_(own, rest)], g[rest]]), L)
        W, y = eliminated[:-1], eliminated[-1]
        left, right = A[np.ix_(own, own)] - W @ W.T, g[own] - W @ y

        def solved(log_s: FloatArray) -> FloatArray:
            b = np.empty(len(g))
            b[own] = np.linalg.solve(left + np.diag(self._precision(log_s)[own]), right)
            b[rest] = linalg.solve_triangular(L.T, y - b[own] @ W, check_finite=False)
            return b

        return solved

    def _precision(self, log_s: FloatArray) -> FloatArray:
        """(p,) S^-2 of `_solve`."""
        return np.asarray(self._least + self._penalty * (10.0 ** (-2.0 * log_s))[self._block])
