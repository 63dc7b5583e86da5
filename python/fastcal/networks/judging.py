# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How good a residual model is where it was not trained: out-of-fold errors with the guard and the limit in force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IndexArray
from fastcal.correction.applicability import Guard, coordinates, margins
from fastcal.correction.correction import Correction, limited_twist, spread
from fastcal.correction.experts import Expert
from fastcal.correction.uncertainty import DEVIATIONS, Uncertainty
from fastcal.networks.problem import Problem
from fastcal.units import to_si

MARGIN_DEG = 5.0  # beyond the trained interval of a joint, as a joint profile
FAR = 1.5  # times the distance up to which a correction helps: where it is zero
BIN_ROWS = 20


@dataclass(frozen=True, eq=False)
class Judged:
    """A residual model on rows that it was not trained on.

    Attributes:
        members: Of all folds together.
        errors: (N, k) what is left with guard and limit [m; rad].
        correction: The whole, as it would be saved.
        coverage: Share of held-out coordinates within their 90 % interval, the interval fitted on the other folds.
        weight: (N,) of the guard.
    """

    members: tuple[Expert, ...]
    errors: FloatArray
    correction: Correction
    coverage: float
    weight: FloatArray


def judge(name: str, problem: Problem, experts: Sequence[Sequence[Expert]]) -> Judged:
    """Holds the experts of each fold against the fold's own rows, and fits guard and uncertainty to what they show."""
    predicted, apart = np.empty((len(problem), 6)), np.empty((len(problem), 6))
    distance = np.empty(len(problem))
    guards = [guard_of(problem, own) for own in problem.training_rows()]
    for fold, members in enumerate(experts):
        held = np.flatnonzero(problem.folds == fold)
        part = problem.inputs.select(held)
        each = np.array([member.twist(part) for member in members])
        predicted[held], apart[held] = each.mean(axis=0), spread(each)
        distance[held] = guards[fold].distance(part)
    every = np.arange(len(problem))
    limits = _limits(problem)
    predicted = limited_twist(predicted, *limits)
    before, after = problem.lengths(problem.residuals), problem.lengths(problem.left(predicted, every))
    near = helpful_distance(distance, before, after)
    weight = np.empty(len(problem))
    for fold, guard in enumerate(guards):
        held = np.flatnonzero(problem.folds == fold)
        weight[held] = with_distance(guard, near).weight(problem.inputs.select(held))
    errors = problem.left(weight[:, np.newaxis] * predicted, every)
    inside = weight > 0.5
    trusted = inside if problem.measured[inside].any(axis=0).all() else np.ones(len(problem), dtype=bool)
    uncertainty = _uncertainty(problem, errors, apart, trusted, every)
    members = tuple(member for fold in experts for member in fold)
    correction = Correction(
        name, members, with_distance(guard_of(problem, every), near), *limits, uncertainty, {}, problem.any_load
    )
    return Judged(members, errors, correction, _coverage(problem, errors, apart, weight, trusted), weight)


def _limits(problem: Problem) -> tuple[float, float]:
    """The longest residual [m] and the largest turn [rad].

    The turn is 0 where points alone were measured: joint errors that explain points may turn the tool wrongly, as no
    point tells a wrist joint's error from what its neighbours do.
    """
    longest, largest = (
        np.linalg.norm(part, axis=1).max(initial=0.0) for part in (problem.residuals[:, :3], problem.residuals[:, 3:])
    )
    return float(longest), float(largest)


def _uncertainty(
    problem: Problem, errors: FloatArray, apart: FloatArray, trusted: NDArray[Any], rows: NDArray[Any]
) -> Uncertainty:
    """What the errors of the trusted rows show, beside the residuals of `rows`; unmeasured numbers show nothing."""
    known = np.where(problem.measured, errors, np.nan)
    before = np.where(problem.measured, problem.residuals, np.nan)
    return Uncertainty.fitted(known[trusted], apart[trusted], before[rows])


def guard_of(problem: Problem, own: IndexArray) -> Guard:
    """The guard of some training rows; its distances are still to be found."""
    inputs = problem.inputs.select(own)
    turning = np.array([float(kind == "revolute") for kind in problem.robot.joint_types])
    low, high = inputs.columns.min(axis=0), inputs.columns.max(axis=0)
    margin = margins(low, high, turning, to_si(MARGIN_DEG, "deg"))
    return Guard(low, high, margin, turning, coordinates(inputs, low, high, turning), 0.0, 1.0)


def with_distance(guard: Guard, near: float) -> Guard:
    """The guard that begins to hold back at a distance."""
    return Guard(guard.low, guard.high, guard.margin, guard.turning, guard.rows, near, FAR * near)


def helpful_distance(distance: FloatArray, before: FloatArray, after: FloatArray) -> float:
    """The distance to trained rows up to which held-out rows get better, in bins of about twenty rows from the nearest.

    Args:
        distance: (N,) of held-out rows.
        before: (N,) lengths of their residuals.
        after: (N,) the same with the correction.
    """
    order = np.argsort(distance, kind="stable")
    near = float(distance[order[0]])
    for rows in np.array_split(order, max(1, len(order) // BIN_ROWS)):
        if after[rows].mean() > before[rows].mean():
            break
        near = float(distance[rows[-1]])
    return max(near, 1e-9)


def _coverage(
    problem: Problem, errors: FloatArray, apart: FloatArray, weight: FloatArray, trusted: NDArray[np.bool_]
) -> float:
    """Of each fold's rows, with the uncertainty that the other folds give."""
    hits, count = 0, 0
    for fold in range(problem.fold_count):
        own, held = trusted & (problem.folds != fold), problem.folds == fold
        if not problem.measured[own].any(axis=0).all():
            continue
        fitted = _uncertainty(problem, errors, apart, own, problem.folds != fold)
        measured, k = problem.measured[held], len(problem.axes)
        inside = np.abs(errors[held]) <= DEVIATIONS * fitted.sigma(apart[held], weight[held])[:, :k]
        hits, count = hits + int(inside[measured].sum()), count + int(measured.sum())
    return hits / max(count, 1)
