# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Serially correlated noise: the errors of successive rows are similar, which every fit and test takes into account.

Temperature, air and drift make noise that changes slowly: AR(1), numbers of rows s and t correlated by rho^|s - t|
along the order of measuring. Its whitening is generalized least squares (P. Prais, C. Winsten 1954): each number less
rho^k times that of the row k places before it, over sqrt(1 - rho^2k). Fits, score tests and standard deviations then
are those of white noise. rho is found beside the rich model (`noise.py`): a missing drift is no memory.

Rows of one stay in a posture (several targets, repeated readings) share what the arm misses there: that is no memory,
which is asked of the stays' means and lasts from stay to stay. Any two of n rows of a stay are correlated by w; in the
chain above their neighbours have the correlation at which the mean of n rows has the same variance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import special

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.columns import without_nil
from fastcal.calibration.pose_folds import along_a_path, measuring_place
from fastcal.calibration.serial_correlation import DEVIATIONS, MOST, neighbour_correlation
from fastcal.calibration.stay_correlation import of_stays, stay_correlation
from fastcal.calibration.tall import taken
from fastcal.diagnosis import rules
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.said import joined, said
from fastcal.units import from_si

# Successive poses nearer than this share of the distance of poses half the set apart are a path, as a grid is measured:
# what is missing is alike in successive rows too, and only plain correlation counts as memory.
NEAR_STEPS = 0.6


def memory(problem: Problem, X: FloatArray, r: FloatArray, row: IndexArray, wrong: IndexArray) -> float:
    """Correlation of neighbouring postures in what a model leaves; 0 where white noise would do.

    Args:
        problem: Whose rows these are.
        X: (m, p) columns of the model.
        r: (m,) what it is to explain.
        row: (m,) fitted row of each number, -1 a prior's.
        wrong: Rows that do not fit.
    """
    order = _measured(problem, row, wrong)
    if len(order) <= X.shape[1]:
        return 0.0
    columns, left, place = without_nil(taken(X, order)), r[order], problem.stays[problem.rows[row[order]]]
    if not _moves_on(problem, row[order]):
        columns, left, place = of_stays(columns, left, row[order], problem.stays[problem.rows])
    beside_fit = not along_a_path(problem.data, NEAR_STEPS)
    deviations = -float(special.ndtri(rules.ALPHA_MEMORY)) if beside_fit else DEVIATIONS
    count = int(problem.stays.max()) + 1
    return neighbour_correlation(columns, left, place, count, deviations, beside_fit=beside_fit) or 0.0


def shared(problem: Problem, X: FloatArray, r: FloatArray, row: IndexArray, wrong: IndexArray) -> float:
    """Correlation of neighbouring rows of one stay in what a model leaves; 0 where white noise would do.

    The arguments as of `memory`.
    """
    order = _measured(problem, row, wrong)
    if len(order) <= X.shape[1] or _moves_on(problem, row[order]):
        return 0.0
    stay = problem.stays[problem.rows]
    found = stay_correlation(without_nil(taken(X, order)), r[order], row[order], stay)
    if found is None:
        return 0.0
    counts = np.unique(stay[np.unique(row[order])], return_counts=True)[1]
    return _of_neighbours(found.rho, round(float(np.mean(counts[counts > 1]))))


def _measured(problem: Problem, row: IndexArray, wrong: IndexArray) -> IndexArray:
    """The numbers of rows that are not `wrong`, in the order of measuring; none of priors."""
    place = measuring_place(problem.data)[problem.rows]
    measured = np.flatnonzero((row >= 0) & ~np.isin(row, wrong))
    return measured[np.argsort(place[row[measured]], kind="stable")]


def _moves_on(problem: Problem, row: IndexArray) -> bool:
    """Is each of these rows in a posture of its own, or at least in another one than the row before it?"""
    rows = problem.rows[np.unique(row)]
    return len(np.unique(problem.stays[rows])) == len(rows)


def _of_neighbours(any_two: float, count: int) -> float:
    """Rho of neighbours at which the mean of n rows varies as with the same correlation of any two of them.

    1 + 2 sum over k < n of (1 - k / n) rho^k = 1 + (n - 1) w, by bisection.
    """
    lag = np.arange(1, count)
    low, high = any_two, 1.0
    for _ in range(30):
        middle = (low + high) / 2
        is_less = 2 * float((1 - lag / count) @ middle**lag) < (count - 1) * any_two
        low, high = (middle, high) if is_less else (low, middle)
    return min(low, MOST)


def without_memory(problem: Problem, values: FloatArray, row: IndexArray) -> FloatArray:
    """Numbers (m, ...) of measured rows, decorrelated; the same where the noise has no memory."""
    if not problem.noise.follows:
        return values
    here, share = _followed(problem, row)
    before = np.flatnonzero(share) - here[share != 0]
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    if len(before) and (before == before[0]).all():  # the rows are in the order of measuring
        first = int(before[0])
        out = np.empty_like(values)
        out[:first] = values[:first]
        np.multiply(values[:-first], -share[first:], out=out[first:])
        out[first:] += values[first:]
    else:
        is_by_row = values.flags.c_contiguous
        out = np.take(values, here, axis=0) if is_by_row else np.take(values.T, here, axis=-1).T
        out *= -share
        out += values
    out /= np.sqrt(1 - share**2)
    return out


def log_determinant(problem: Problem, row: IndexArray) -> float:
    """Of the correlation of numbers of measured rows: what white noise of the same size lacks in -2 log likelihood."""
    return float(np.sum(np.log1p(-(_followed(problem, row)[1] ** 2)))) if problem.noise.follows else 0.0


def _followed(problem: Problem, row: IndexArray) -> tuple[IndexArray, FloatArray]:
    """(m,) the number that each follows on, and its correlation with that, 0 where it begins again.

    A row that holds as many numbers as the one before it follows on that one; any other starts again.
    """
    known = problem.successions
    key = row.tobytes()
    if key not in known:
        known[key] = _succession(problem, row)
    return known[key]


def _succession(problem: Problem, row: IndexArray) -> tuple[IndexArray, FloatArray]:
    """`_followed`, worked out."""
    place, stay = measuring_place(problem.data)[problem.rows], problem.stays[problem.rows]
    first = np.searchsorted(row, np.arange(len(place)))
    count = np.bincount(row, minlength=len(place))
    order = np.argsort(place, kind="stable")
    order = order[count[order] > 0]
    before, after = order[:-1], order[1:]
    follows = count[before] == count[after]
    source, share = np.arange(len(place)), np.zeros(len(place))  # by row
    source[after[follows]] = before[follows]
    steps = (stay[after] - stay[before])[follows]
    of = problem.noise
    share[after[follows]] = np.where(steps == 0, max(of.shared, of.memory), of.memory ** steps.astype(float))
    return np.arange(len(row)) + (first[source] - first)[row], share[row]


def with_memory_named(note: str, noise: Noise) -> str:
    """A sentence about the noise, with what rows share in it where the tests allow for that."""
    clauses = [note]
    if noise.repeatability > 0:
        size = float(from_si(noise.repeatability * noise.factor, "mrad"))
        clauses.append(
            said(
                "the joints repeat to about {size:.2g} mrad: errors grow with reach, rows measured in one posture "
                "share them, and all tests and stated deviations allow for it",
                size=size,
            )
            if noise.by_stay
            else said(
                "the joints repeat to about {size:.2g} mrad: errors grow with reach, and all tests and stated "
                "deviations allow for it",
                size=size,
            )
        )
    if noise.memory > 0:
        clauses.append(
            said(
                "errors of successive rows are correlated ({memory:.2f}), and all tests and stated deviations allow "
                "for it",
                memory=float(noise.memory),
            )
        )
    if noise.shared > 0:
        clauses.append(
            said(
                "rows measured in one posture, one after the other, share errors ({shared:.2f}), and all tests and "
                "stated deviations allow for it",
                shared=float(noise.shared),
            )
        )
    return joined("; ", clauses)


def remembering(problem: Problem, rho: float) -> Problem:
    """The problem with noise of this memory."""
    return problem.with_noise(replace(problem.noise, memory=rho))
