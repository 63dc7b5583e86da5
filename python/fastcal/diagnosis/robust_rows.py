# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows that a linear model cannot fit, and the residuals of the others.

With Z an orthonormal basis of all rows of X, the fit without some numbers w follows from that to all:  with
G = 1 - Z_w Z_w^T,  left = left_all + Z Z_w^T G^-1 left_all,w  and  h = Z (1 + Z_w^T G^-1 Z_w) Z^T, whatever rows are
left out. (R. D. Cook, S. Weisberg, "Residuals and Influence in Regression", 1982, section 3.3.)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg, special

from fastcal.arrays import BoolArray, FloatArray, IndexArray
from fastcal.calibration.columns import unit_columns
from fastcal.calibration.joint_noise import Hats
from fastcal.calibration.parallel import each
from fastcal.calibration.row_weights import huber
from fastcal.calibration.tall import gram, inner, moved, over, single, summed, times
from fastcal.diagnosis import rules

# Rounds of reweighting and of rejecting rows, each.
NOISE_ROUNDS = 6
# Sizes of a row from which on Huber's weights fall and Tukey's end [medians of a row]: the usual corners.
HUBER_SIZE = 1.5
TUKEY_SIZE = 5.0
# Weight below which a row is a suspect.
SUSPECT_WEIGHT = 0.05
# Least share of a number that the other rows leave to chance (its redundancy): below, it is fitted whatever it is.
MIN_REDUNDANCY = 0.05
# Ridge on unit columns of the rich model, which may be dependent.
RIDGE = 1e-9


_ITERATIONS, _ENOUGH = 60, 1e-3  # of conjugate gradients between two sets of weights, and their residual


@dataclass(frozen=True, eq=False)
class RichFit:
    """What the rich model leaves.

    Attributes:
        wrong: Rows that do not fit.
        off: (k,) mean square of the numbers of each of these, studentized.
        left: (m,) what is left of the numbers and priors, 0 of rows that do not fit.
        shares: (m,) their parts of the degrees of freedom.
        hats: Of the rows that fit.
    """

    wrong: IndexArray
    off: FloatArray
    left: FloatArray
    shares: FloatArray
    hats: Hats = ()

    @cached_property
    def squares(self) -> FloatArray:
        """(m,) of `left`."""
        return self.left**2

    @cached_property
    def freedom(self) -> float:
        """Degrees of freedom of the rows that fit."""
        return max(float(self.shares.sum()), 1.0)

    @cached_property
    def mean_square(self) -> float:
        """Of the rows that fit."""
        return float(self.squares.sum()) / self.freedom

    @property
    def gross(self) -> IndexArray:
        """Those of the wrong rows that are off by GROSS_SIZE and more of what the others are."""
        return self.wrong[self.off > rules.GROSS_SIZE**2 * self.mean_square]

    def of(self, numbers: BoolArray) -> tuple[float, float]:
        """Mean square and degrees of freedom of some numbers (m,)."""
        freedom = float(self.shares[numbers].sum())
        return float(self.squares[numbers].sum()) / max(freedom, 1.0), freedom


class Leverage:
    """How far each row bends a fit: h = Z Z^T of the numbers of a row, once for all sets of rows that are left out."""

    def __init__(self, Z: FloatArray, row: IndexArray) -> None:
        self.power = row_squares(Z)
        self._count = np.bincount(row[row >= 0])
        order = np.argsort(row, kind="stable")
        first = np.searchsorted(row[order], np.arange(len(self._count)))

        def group(rows: IndexArray) -> tuple[IndexArray, IndexArray, FloatArray]:
            own = order[first[rows][:, np.newaxis] + np.arange(self._count[rows[0]])]
            return rows, own, _products(_at(Z, own))

        sizes = [np.flatnonzero(self._count == size) for size in np.unique(self._count[self._count > 0])]
        parts = [rows[part] for rows in sizes for part in moved(len(rows), Z.shape[1] * int(self._count[rows[0]]))]
        self._groups = each(group, parts)  # rows with as many numbers, the places of these, and h

    def hats(self, wrong: IndexArray) -> Hats:
        """Of the rows that are not `wrong`."""
        kept = [(~np.isin(rows, wrong), own, h) for rows, own, h in self._groups]
        return [(own[fits], h[fits]) for fits, own, h in kept]

    def studentized(
        self, left: FloatArray, more: FloatArray | None, wrong: IndexArray
    ) -> tuple[FloatArray, IndexArray]:
        """(N,) square of what each row is off, as a chi square of noise 1, and (N,) how many numbers it holds.

        A fitted row: e^T (1 - h)^-1 e; one that was left out: e^T (1 + h)^-1 e; h = Z Z^T + more more^T.
        """
        square = np.zeros(len(self._count))
        left_out = np.isin(np.arange(len(square)), wrong)

        def weigh(group: tuple[IndexArray, IndexArray, FloatArray]) -> None:
            rows, own, all_in = group
            h = all_in if more is None else all_in + _products(_at(more, own))
            V = np.eye(own.shape[1]) + np.where(left_out[rows], 1.0, -1.0)[:, np.newaxis, np.newaxis] * h
            values, vectors = np.linalg.eigh(V)
            along = np.einsum("nji,nj->ni", vectors, left[own])
            square[rows] = np.sum(along**2 / np.maximum(values, MIN_REDUNDANCY), axis=1)

        each(weigh, self._groups)
        return square, self._count


def row_squares(Z: FloatArray) -> FloatArray:
    """(m,) square of the length of each row of Z (m, p)."""
    return np.concatenate(each(lambda rows: np.einsum("ij,ij->i", Z[rows], Z[rows]), moved(*Z.shape)))


def _at(Z: FloatArray, own: IndexArray) -> FloatArray:
    """(n, s, k) rows `own` (n, s) of Z (m, k); a view where they follow each other, as those of most data do."""
    at = own.ravel()
    if np.array_equal(at, np.arange(at[0], at[0] + len(at))):
        return Z[at[0] : at[0] + len(at)].reshape(*own.shape, -1)
    return np.take(Z, own, axis=0)


def _products(Z: FloatArray) -> FloatArray:
    """(n, s, s) of (n, s, k): Z Z^T, row by row."""
    return np.asarray(Z @ Z.transpose(0, 2, 1))


def without_outliers(
    X: FloatArray, r: FloatArray, row: IndexArray, begun: IndexArray | None = None, normal: FloatArray | None = None
) -> RichFit:
    """A fit of X (m, p), about unit columns, to the rows that it reaches; `row` (m,) of each number, -1 a prior's.

    `begun`: rows that nearly the same model did not reach, to begin with; None: the suspects. `normal` is X^T X.
    """
    Z = ridged_basis(X, normal)
    leverage, left_by_all = Leverage(Z, row), r - times(Z, inner(Z, r))
    wrong = _largest(_suspects(Z, r, row) if begun is None else begun, None, row)
    for _ in range(NOISE_ROUNDS):
        is_out = np.isin(row, wrong)
        left, more = _without(Z, left_by_all, is_out)
        kept = ~is_out & (row >= 0)
        taken = leverage.power if more is None else leverage.power + row_squares(more)
        square, count = leverage.studentized(left, more, wrong)
        off = square[wrong] / np.maximum(count[wrong], 1)
        found = RichFit(wrong, off, np.where(kept, left, 0.0), np.where(kept, 1.0 - taken, 0.0), leverage.hats(wrong))
        several = max((count > 0).sum(), 1)
        limit = found.mean_square * special.chdtri(np.maximum(count, 1), rules.ALPHA_OUTLIER / several)
        now = _largest(np.flatnonzero((count > 0) & (square > limit)), square, row)
        if np.array_equal(now, wrong):
            break
        wrong = now
    return found


def gross_rows(X: FloatArray, r: FloatArray, row: IndexArray) -> IndexArray:
    """`RichFit.gross` of a fit that left no row out; where no row is far off to begin with, without another fit."""
    held = row >= 0
    square = np.bincount(row[held], r[held] ** 2)
    count = np.bincount(row[held])
    mean = square[count > 0] / count[count > 0]
    if not (mean > TUKEY_SIZE**2 * np.median(mean)).any():
        return np.zeros(0, dtype=np.intp)
    return without_outliers(unit_columns(X), r, row).gross


def suspects(X: FloatArray, r: FloatArray, row: IndexArray) -> IndexArray:
    """Rows to which iteratively reweighted least squares (Huber, then Tukey) gives hardly any weight."""
    return _suspects(ridged_basis(X), r, row)


def studentized_residuals(
    A: FloatArray, r: FloatArray, row: IndexArray, wrong: IndexArray
) -> tuple[FloatArray, IndexArray]:
    """`Leverage.studentized` for a linear problem that is fitted to all rows but those that are `wrong`."""
    Z = ridged_basis(unit_columns(A))
    left, more = _without(Z, r - times(Z, inner(Z, r)), np.isin(row, wrong))
    return Leverage(Z, row).studentized(left, more, wrong)


def ridged_basis(X: FloatArray, normal: FloatArray | None = None) -> FloatArray:
    """Z (m, p) of unit columns, orthonormal but for the ridge: a fraction of the work of a QR; `normal` is X^T X."""
    return over(X, _ridged_root(gram(X) if normal is None else normal.copy()))


def ridged_residual(X: FloatArray, r: FloatArray) -> FloatArray:
    """(m,) r - Z Z^T r, Z the `ridged_basis` of X (m, p)."""
    size = linalg.cho_solve((_ridged_root(gram(X)), True), inner(X, r), check_finite=False)
    return np.asarray(r - times(X, size))


def _ridged_root(normal: FloatArray) -> FloatArray:
    """Lower triangular L (p, p) of the products of unit columns with the ridge; `normal` is spoilt."""
    normal[np.diag_indices(len(normal))] += RIDGE
    return np.asarray(linalg.cholesky(normal, lower=True, overwrite_a=True, check_finite=False))


def _without(Z: FloatArray, left: FloatArray, is_out: BoolArray) -> tuple[FloatArray, FloatArray | None]:
    """What a fit without some numbers leaves of all, from what the fit of all leaves, and the columns beside Z in h."""
    if not is_out.any():
        return left, None
    out = Z[is_out]
    G = np.eye(len(out)) - out @ out.T
    G[np.diag_indices(len(out))] += RIDGE
    L = linalg.cholesky(G, lower=True, check_finite=False)
    more = over(times(Z, out.T), L)
    return left + more @ linalg.solve_triangular(L, left[is_out], lower=True, check_finite=False), more


def _suspects(Z: FloatArray, r: FloatArray, row: IndexArray) -> IndexArray:
    """`suspects` by an orthonormal basis Z; in single precision, ample for a guess that the next rounds mend."""
    Z, r = single(Z), r.astype(np.float32)
    rows, place, count = np.unique(row, return_inverse=True, return_counts=True)
    weight = np.ones(len(rows))
    b = inner(Z, r)
    for round_ in range(NOISE_ROUNDS):
        left = r - times(Z, b)
        size = np.sqrt(np.bincount(place, left**2) / count)
        scale = float(np.median(size[rows >= 0]))
        u = size / max(scale, 1e-300)
        if round_ < NOISE_ROUNDS // 2:
            weight = huber(u, HUBER_SIZE)
        else:
            weight = np.where(u < TUKEY_SIZE, (1 - (u / TUKEY_SIZE) ** 2) ** 2, 0.0)
        weight[rows < 0] = 1.0
        if round_ < NOISE_ROUNDS - 1:
            b = _weighted(Z, r, weight[place].astype(np.float32), b)
    return np.asarray(rows[weight < SUSPECT_WEIGHT])


def _weighted(Z: FloatArray, r: FloatArray, weight: FloatArray, b: FloatArray) -> FloatArray:
    """Weighted least squares from a near solution b, by conjugate gradients: Z^T W Z is as good as its weights."""

    def times_normal(p: FloatArray) -> FloatArray:
        return summed(lambda rows: Z[rows].T @ (weight[rows] * (Z[rows] @ p)), moved(*Z.shape))

    g = inner(Z, weight * (r - times(Z, b)))
    p, square = g, float(g @ g)
    enough = _ENOUGH**2 * float(np.sum(inner(Z, weight * r) ** 2))
    for _ in range(_ITERATIONS):
        if square <= enough:
            break
        Ap = times_normal(p) + RIDGE * p
        step = square / float(p @ Ap)
        b, g = b + step * p, g - step * Ap
        before, square = square, float(g @ g)
        p = g + square / before * p
    return b


def _largest(far: IndexArray, square: FloatArray | None, row: IndexArray) -> IndexArray:
    """Those rows, the largest ones where they are more than outliers can be; sorted."""
    most = int(rules.MAX_OUTLIER_SHARE * len(np.unique(row[row >= 0])))
    if square is not None and len(far) > most:
        far = far[np.argsort(-square[far], kind="stable")[:most]]
    return np.sort(far).astype(np.intp)
