# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How good a residual model is where it was not trained: out-of-fold errors with the guard and the limit in force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.applicability import Guard, coordinates, margins
from fastcal.correction.correction import Correction, limited, spread
from fastcal.correction.experts import Expert
from fastcal.correction.uncertainty import DEVIATIONS, Uncertainty
from fastcal.networks.problem import Problem
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

MARGIN_DEG = 5.0  # beyond the trained interval of a joint, as a joint profile
FAR = 1.5  # times the distance up to which a correction helps: where it is zero
BIN_ROWS = 20


@dataclass(frozen=True, eq=False)
class Judged:
    """A residual model on rows that it was not trained on.

    Attributes:
        members: Of all folds together.
        errors: (N, 3) what is left with guard and limit [m].
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
    limit = float(np.linalg.norm(problem.residuals, axis=1).max())
    predicted, apart = np.empty_like(problem.residuals), np.empty_like(problem.residuals)
    distance = np.empty(len(problem))
    guards = [guard_of(problem, own) for own in problem.training_rows()]
    for fold, members in enumerate(experts):
        held = np.flatnonzero(problem.folds == fold)
        part = problem.inputs.select(held)
        each = np.array([member.displacement(part) for member in members])
        predicted[held], apart[held] = limited(each.mean(axis=0), limit), spread(each)
        distance[held] = guards[fold].distance(part)
    before = np.linalg.norm(problem.residuals, axis=1)
    near = helpful_distance(distance, before, np.linalg.norm(problem.residuals - predicted, axis=1))
    weight = np.empty(len(problem))
    for fold, guard in enumerate(guards):
        held = np.flatnonzero(problem.folds == fold)
        weight[held] = with_distance(guard, near).weight(problem.inputs.select(held))
    errors = problem.residuals - weight[:, np.newaxis] * predicted
    every = np.arange(len(problem))
    inside = weight > 0.5
    trusted = inside if inside.any() else np.ones(len(problem), dtype=bool)
    uncertainty = Uncertainty.fitted(errors[trusted], apart[trusted], problem.residuals)
    members = tuple(member for fold in experts for member in fold)
    correction = Correction(
        name, members, with_distance(guard_of(problem, every), near), limit, uncertainty, {}, problem.any_load
    )
    return Judged(members, errors, correction, _coverage(problem, errors, apart, weight, trusted), weight)


def guard_of(problem: Problem, own: IntArray) -> Guard:
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
        if not own.any():
            continue
        fitted = Uncertainty.fitted(errors[own], apart[own], problem.residuals[problem.folds != fold])
        inside = np.abs(errors[held]) <= DEVIATIONS * fitted.sigma(apart[held], weight[held])
        hits, count = hits + int(inside.sum()), count + inside.size
    return hits / max(count, 1)
