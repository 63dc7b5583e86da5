# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cross-validation of a fit: each fold of the poses predicted from the others, linearized at the fit.

With A the whitened rows with their priors, F the fitted rows of the other folds and r what the fit leaves,
    b = (A_F^T A_F)^-1 A_F^T r_F,   e = r - A b   in the rows of the fold.
Geometry that is pulled beside curves is pulled to what the other folds alone make of it without the curves: its fit to
all rows has seen the fold.
Every measured row is predicted, also those that the fit leaves out: a model may not win by leaving out what it misses.
Where a place is that none of the fitted rows touch, its own rows say (`touched_places`), and so they do where a station
or a mount stands of which the fitted rows are the lesser part: who moves an instrument places it anew.
A gross row counts, but decides nothing: beyond LOSS_SIZE typical rows its loss grows with its size and no more with the
square (P. Huber 1964).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal.calibration.columns import column_lengths
from fastcal.calibration.parallel import each
from fastcal.calibration.pose_folds import measuring_place, pose_folds
from fastcal.calibration.repeatability import place_groups
from fastcal.calibration.touched_places import beside_own
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.noise_scales import numbers_of, observation_of, sigmas
from fastcal.diagnosis.priors import held
from fastcal.diagnosis.problem import Problem
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import Kind
from fastcal.measurements.splits import deal
from fastcal.place import joint_name, place_of

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Parts of a joint's range that are held out as one, where what errs by its position is judged: rows near each other
# share what is wrong with them, and many more would leave neighbours of each.
POSITION_BINS = 40
# Positions of a joint of which one that is held out still has neighbours on both sides.
FEWEST_POSITIONS = 5

STRETCHES = "stretches"  # of the order of measuring: an owner of folds
REGIONS = "regions"  # of the workspace, another one
PLACES = "places"  # sockets, balls or planes that are touched, each held out whole: a third one
_RIDGE = 1e-10  # on unit columns: for those that the others span
_UNSEEN = 1e-9  # of the squares of a unit column, by rows that do not show it: rounding
_LESSER = 0.5  # of the squares of a unit column of a station or mount


def folds(problem: Problem, owner: str | None = None) -> NDArray[np.intp]:
    """(N,) fold of each fitted row: all visits of a pose in one, whichever rows are fitted.

    With an `owner`, a joint: all rows near one of its positions in one. What errs by a joint's own position must be
    predicted where the joint has not been; rows of a grid share positions, and other folds of poses hold them all.
    """
    measured = problem.data.measured
    out = np.full(len(measured), -1, dtype=np.intp)
    if owner == PLACES and problem.touched is not None:
        places = int(problem.touched.max()) + 1
        out[measured] = deal(places, rules.FOLDS, np.random.default_rng(0))[problem.touched[measured]]
    else:
        out[measured] = fold_of(problem.data.select(measured), owner)
    return out[problem.used]


def fold_of(data: Dataset, owner: str | None = None) -> NDArray[np.intp]:
    """(N,) fold of each row: by its pose (along a path its stretch), a joint's position, STRETCHES or REGIONS."""
    if owner == STRETCHES:
        return measuring_place(data) * rules.FOLDS // max(len(data), 1)
    if owner == REGIONS:
        part = _regions(data)
        return np.asarray(deal(int(part.max(initial=-1)) + 1, rules.FOLDS, np.random.default_rng(0))[part])
    random = np.random.default_rng(0)
    if owner is None:
        return pose_folds(data, rules.FOLDS, random)
    part = positions(data, owner)
    return np.asarray(deal(int(part.max()) + 1, rules.FOLDS, random)[part])


def _regions(data: Dataset) -> NDArray[np.intp]:
    """(N,) region of each row: cut in halves across the widest way, and these again, while they hold enough rows.

    By points where all rows have one, else by joint positions, each in shares of its range.
    """
    at = data.q / np.maximum(np.ptp(data.q, axis=0), np.finfo(np.float64).tiny)
    if np.isfinite(data.points).all():
        at = data.points
    parts = [np.arange(len(data))]
    while len(parts) < rules.REGIONS and min(map(len, parts)) >= 2 * rules.MIN_REGION_ROWS:
        halves: list[NDArray[np.intp]] = []
        for part in parts:
            way = int(np.argmax(np.ptp(at[part], axis=0)))
            order = part[np.argsort(at[part, way], kind="stable")]
            halves += [order[: len(order) // 2], order[len(order) // 2 :]]
        parts = halves
    out = np.empty(len(data), dtype=np.intp)
    for k, part in enumerate(parts):
        out[part] = k
    return out


def last_stretch(data: Dataset) -> BoolArray:
    """(N,) measured rows of the last of the STRETCHES."""
    last = data.measured.copy()
    last[last] = fold_of(data.select(last), STRETCHES) == rules.FOLDS - 1
    return last


def positions(data: Dataset, owner: str) -> NDArray[np.intp]:
    """(N,) position of a joint as one of POSITION_BINS, in each row."""
    joint = place_of(owner).index
    return place_groups(data.q[:, [joint]], POSITION_BINS)


def shows_between(data: Dataset) -> bool:
    """Does some joint stand at FEWEST_POSITIONS or more? In a grid of fewer, rows held out repeat those fitted to."""
    joints = range(data.q.shape[1])
    return any(len(np.unique(positions(data, joint_name(joint)))) >= FEWEST_POSITIONS for joint in joints)


class HeldOut:
    """Held-out rows of one fit.

    Args:
        at: The fit.
        fitted: (N,) rows of the data that the predictions are fitted to; None: those of the fit.
        more: (m, k) further columns over the numbers and priors of the fit, after its own; the rows that it leaves out
            are not predicted then.
        owner: A joint: the folds hold out its positions. STRETCHES: parts of the order of measuring. REGIONS: of the
            workspace. PLACES: that are touched.
        as_measured: Judge the rows as they were measured, where the fit takes out what noise with a memory shares: so
            that fits of different noise compare.
    """

    def __init__(
        self,
        at: Fit,
        fitted: BoolArray | None = None,
        more: FloatArray | None = None,
        owner: str | None = None,
        *,
        as_measured: bool = False,
    ) -> None:
        whole = at.on_every_row if more is None else at
        every, (A, r, row) = whole.problem, whole.whitened
        value = at.theta[at.free]
        if more is not None:
            A, value = np.hstack([A, more]), np.append(value, np.zeros(more.shape[1]))
        length = column_lengths(A)
        self._value = value * length
        self._factor = at.problem.noise.factor
        self._rows = every.rows
        self._count = len(at.problem.data)
        fold = folds(every, owner)
        used = (at.problem.used if fitted is None else fitted)[every.rows]
        # Fold by fold, in each what is fitted first, the priors last: parts of A are then parts of memory.
        place = np.where(row < 0, 2 * rules.FOLDS, 2 * fold[row] + ~used[row])
        self._order = order = np.argsort(place, kind="stable")
        ends = np.searchsorted(place[order], np.arange(2 * rules.FOLDS + 1))
        self._A = A[order]
        self._A /= np.where(length > 0, length, 1.0)
        self._r, self._row = r[order], row[order]
        self._number = np.append(whole.near.number, np.full(len(row) - len(whole.near.number), -1))[order]
        self._problem = every
        self._judged = self._A, self._r
        if as_measured and not at.problem.noise.is_white:
            A, r, _ = whole.standardized
            self._judged = A[order] / np.where(length > 0, length, 1.0), r[order]
        self._numbers = [slice(a, b) for a, b in zip(ends[:-1:2], ends[2::2], strict=True)]
        self._fitted = [slice(a, b) for a, b in zip(ends[:-1:2], ends[1::2], strict=True)]
        self._priors = slice(ends[-1], None)
        self._prior = column_lengths(self._A[self._priors])  # one row a parameter
        normal = each(self._squared, self._fitted)
        whole = np.sum(normal, axis=0) + np.diag(self._prior**2)
        self._others = [whole - own for own in normal]
        self._is_pulled = np.zeros(A.shape[1], dtype=bool)
        self._is_pulled[: len(at.free)] = np.isfinite(at.pull[at.free])
        self._of_places = np.zeros(A.shape[1], dtype=bool)
        self._of_places[: len(at.free)] = np.array(at.free) >= len(at.model.parameters)
        self._of_setups = [k for k, i in enumerate(at.free) if i in at.of_setups]
        self._whole = whole - np.diag(self._prior**2)
        self._beside = [i for name in at.added if name.traits.role == "curve" for i in at.columns(name)]
        self._beside += range(len(at.free), A.shape[1])
        self._slack = np.ones(A.shape[1])  # of a prior and a pull, the prior's part
        self._slack[: len(at.free)] = (held(at.prior, at.pull) / at.prior)[at.free]

    def squares(self, without: Sequence[int] = ()) -> FloatArray:
        """(N,) squared error of each measured row in units of its claimed noise; NaN where nothing was measured.

        Args:
            without: Columns of the fit, as it counts its free parameters, that are left out at the value 0.
        """
        square = np.bincount(self._row[: self._priors.start], self._errors(without) ** 2, len(self._rows))
        found = np.full(self._count, np.nan)
        found[self._rows] = square * self._factor**2
        return found

    def _errors(self, without: Sequence[int] = ()) -> FloatArray:
        """(m',) of the measured numbers, fold by fold, over their standard deviations."""
        A, kept = self._A, np.setdiff1d(np.arange(self._A.shape[1]), without)
        r = self._left_without(without)
        B, left = self._judged[0], self._left_without(without, *self._judged)
        g = [A[n].T @ r[n] for n in self._fitted]
        whole = np.sum(g, axis=0) + A[self._priors].T @ r[self._priors]
        centres = self._centres(without)

        def of_fold(k: int) -> FloatArray:
            out, step = self._numbers[k], np.zeros(A.shape[1])
            right = whole - g[k] + self._prior**2 * centres[k]
            step[kept] = _solved(self._others[k], right, kept)
            return beside_own(left[out] - B[out] @ step, B[out] @ self._said_by_own_rows(k))

        return np.concatenate(each(of_fold, range(rules.FOLDS)))

    def _said_by_own_rows(self, k: int) -> FloatArray:
        """(p, n) moves of places and set-ups that a fold's own rows say, in columns: the others hardly show them.

        Of stations and mounts those v of base, tool and what these are off in another set-up that have
        v' N_others v < LESSER v' N v: without the rows of the first station no other one shows where the base is.
        """
        others = self._others[k] - np.diag(self._prior**2)
        unseen = np.flatnonzero(self._of_places & (np.diag(others) < _UNSEEN))
        out = np.eye(len(others))[:, unseen]
        if not self._of_setups:
            return out
        among = np.ix_(self._of_setups, self._of_setups)
        share, ways = linalg.eigh(others[among], self._whole[among] + _RIDGE * np.eye(len(self._of_setups)))
        moves = np.zeros((len(others), int(np.sum(share < _LESSER))))
        moves[self._of_setups] = ways[:, share < _LESSER]
        return np.hstack([out, moves])

    def rms(self, rows: BoolArray, kind: Kind, fitted: FloatArray) -> float:
        """RMS of the error of held-out readings of a kind, SI, over rows (N,); NaN where none of them has any.

        Args:
            rows: (N,) of the data.
            kind: Of the readings.
            fitted: (N, k) errors of its readings that the fit leaves, SI. Corners of a picture, many readings for six
                numbers, err by as much more as these do.
        """
        of = observation_of(self._problem, kind)
        measured = slice(0, self._priors.start)
        row = self._rows[self._row[measured]]
        own = rows[row] & np.isin(self._number[measured], numbers_of(of))
        size = self._problem.noise.factor * sigmas(self._problem, row[own], self._number[measured][own], of)
        if self._problem.weight is not None:
            size /= np.sqrt(self._problem.weight[row[own]])
        if not own.any():
            return float("nan")
        squares = self._squares_of(self._errors(), own, size)
        if of.reading_count == 1:
            return float(np.sqrt(squares / len(np.unique(row[own]))))
        more = squares - self._squares_of(self._judged[1][measured], own, size)
        corners = fitted[rows][np.isfinite(fitted[rows])]
        return float(np.sqrt(max(float(corners @ corners) + more, 0.0) / len(corners)))

    def _squares_of(self, errors: FloatArray, own: BoolArray, size: FloatArray) -> float:
        """Sum of squares of numbers `own` of whitened errors (m',), times their deviations `size`: as measured."""
        if self._problem.pictures is not None:
            order = self._order[: len(errors)]
            e = np.empty_like(errors)
            e[order] = errors
            errors = self._problem.pictures.as_seen(e)[order]
        return float(np.sum((errors[own] * size) ** 2))

    def _left_without(self, own: Sequence[int], A: FloatArray | None = None, r: FloatArray | None = None) -> FloatArray:
        """(m,) what the fit leaves where these columns are left out; of A and r, as it was fitted or is judged."""
        A, r = self._A if A is None else A, self._r if r is None else r
        if len(own) == 0:
            return r
        value = np.zeros(len(self._value))
        value[list(own)] = self._value[list(own)]
        return np.asarray(r + A @ value)

    def _centres(self, without: Sequence[int]) -> list[FloatArray]:
        """By fold, how far what is pulled moves from its centre in the fit of the other folds, curves left out."""
        if not self._is_pulled.any():
            return [np.zeros(self._A.shape[1])] * rules.FOLDS
        out = sorted({*self._beside, *without})
        kept = np.setdiff1d(np.arange(self._A.shape[1]), out)
        r = self._left_without(out)
        g = [self._A[n].T @ r[n] for n in self._fitted]
        weak = self._slack**2
        right = np.sum(g, axis=0) + weak * (self._A[self._priors].T @ r[self._priors])
        pulls = (1 - weak) * self._prior**2
        pulled = np.flatnonzero(self._is_pulled)
        before = self._r[self._priors][pulled] / self._prior[pulled]

        def moved(k: int) -> FloatArray:
            step, away = np.zeros(self._A.shape[1]), np.zeros(self._A.shape[1])
            step[kept] = _solved(self._others[k], right - g[k], kept, pulls)
            away[pulled] = step[pulled] - before
            return away

        return each(moved, range(rules.FOLDS))

    def _squared(self, rows: slice) -> FloatArray:
        """(p, p) products of the columns over some rows."""
        A = self._A[rows]
        return np.asarray(A.T @ A)


def _solved(
    normal: FloatArray, right: FloatArray, kept: NDArray[np.intp], pulls: FloatArray | float = 0.0
) -> FloatArray:
    """The solution of the normal equations of some columns, without `pulls` (p,) on the diagonal."""
    part = normal.copy() if len(kept) == len(normal) else np.take(np.take(normal, kept, axis=0), kept, axis=1)
    part[np.diag_indices_from(part)] += _RIDGE - np.broadcast_to(pulls, len(normal))[kept]
    root = np.linalg.cholesky(part).T  # without Python's lock, which scipy's holds
    return np.asarray(linalg.cho_solve((root, False), right[kept], check_finite=False))


def squares(at: Fit) -> FloatArray:
    """(N,) squared error of each measured row as a fit has it, in the unit of `HeldOut.squares`."""
    _, r, row = at.on_every_row.whitened
    measured = row >= 0
    own = np.bincount(row[measured], r[measured] ** 2, len(at.on_every_row.problem.rows))
    out = np.full(len(at.problem.data), np.nan)
    out[at.on_every_row.problem.rows] = own * at.problem.noise.factor**2
    return out


def lead(rival: FloatArray, incumbent: FloatArray, among: BoolArray) -> float:
    """Standard errors by which the sum of a rival's squares (N,), of some rows (N,), is less than another one's."""
    less = (incumbent - rival)[among & np.isfinite(incumbent) & np.isfinite(rival)]
    error = float(np.std(less, ddof=1)) * np.sqrt(len(less)) if len(less) > 1 else 0.0
    return float(less.sum()) / error if error > 0 else 0.0


def gain(rival: FloatArray, incumbent: FloatArray, group: NDArray[np.intp] | None = None) -> tuple[float, float]:
    """By how much a rival's squares (N,) are less than another one's, a row, and its standard error.

    Both as a share of what the other one leaves. A row's loss is its square up to LOSS_SIZE typical rows. Rows of one
    `group` (N,) may err alike: the standard error is that of independent groups.
    """
    known = np.isfinite(incumbent) & np.isfinite(rival)
    limit = rules.LOSS_SIZE * float(np.sqrt(np.median(np.concatenate([incumbent[known], rival[known]]))))

    def loss(square: FloatArray) -> FloatArray:
        return np.where(square <= limit**2, square, 2 * limit * np.sqrt(np.maximum(square, 0.0)) - limit**2)

    before = loss(incumbent[known])
    less = before - loss(rival[known])
    scale = max(float(before.mean()), 1e-300)
    away = less - less.mean()
    sums = away if group is None else np.bincount(np.unique(group[known], return_inverse=True)[1], away)
    error = np.sqrt(np.sum(sums**2) * len(sums) / max(len(sums) - 1, 1)) / len(less)
    return float(less.mean()) / scale, float(error) / scale


def wins(rival: FloatArray, incumbent: FloatArray, group: NDArray[np.intp]) -> bool:
    """Are most groups of rows (N,) predicted better, by MIN_GAIN standard deviations of a sign test?

    Of curves that are held out at a joint's positions: beyond the last of them any curve may be far off.
    """
    known = np.isfinite(incumbent) & np.isfinite(rival)
    each = np.unique(group[known], return_inverse=True)[1]
    sign = np.sign(np.bincount(each, incumbent[known] - rival[known]))
    return bool(sign.sum() > rules.MIN_GAIN * np.sqrt(len(sign)))


def is_better(rival: FloatArray, incumbent: FloatArray) -> bool:
    """Does a rival with these squares (N,) predict held-out rows better by MIN_RIVAL_GAIN standard errors?"""
    less, error = gain(rival, incumbent)
    return less > rules.MIN_RIVAL_GAIN * error
