# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Is a step between two rows one in time, or the work of a condition that changed along with it?

Fifty rows without a load, then fifty with one: what changed in between may be the load's work. Rows that were measured
joint by joint, as a grid is, change their positions along the way: a step in time then looks like an effect of where
the arm stands, and only rows that break the order tell the two apart.
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.columns import unit_columns
from fastcal.diagnosis import rules
from fastcal.diagnosis.blocks import columns_at
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.generic import polynomials
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.projection import score_tests
from fastcal.diagnosis.robust_rows import ridged_basis
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.variants import effect_has_moment, from_the_beginning, order_of_rows
from fastcal.measurements.dataset import Dataset

# Share of a step (of its variance) that positions, payload, stations and mounts of the rows may explain: where they
# change with it, it is no step in time.
MAX_STEP_SHARE = 0.5
# Owners of steps that may be told apart from positions: a joint's own errors go with positions, whatever their form.
PLACED = ("base", "tool")
# Powers of each joint's position that may stand for the step, beside a jump at one position of each joint.
POWERS_OF_POSITION = 3
# Of the rows, by the position that goes with the step.
PARTS = 12


def is_a_condition(name: Hypothesis, at: Fit, tried: int) -> bool:
    """Is it a step between rows that differ in where the arm stands, what it carries, or who looks?

    Args:
        name: Of any effect; what is no step in time is no condition.
        at: A fit without it.
        tried: Names that it is the likeliest of.
    """
    moment = name.entry.get("at_s", name.entry.get("at_row"))
    if moment is None or not effect_has_moment(name.effect):
        return False
    data = at.problem.kept
    step = (order_of_rows(data) >= moment).astype(float)
    others = _conditions(data)
    if _share(step, np.hstack([others, data.q])) <= MAX_STEP_SHARE:
        return False
    if _share(step, others) > MAX_STEP_SHARE or not is_placed(name):
        return True
    return not _outlasts_positions(name, step, at, tried)


def is_placed(name: Hypothesis) -> bool:
    """Is it of the base or the tool, whose steps may be told apart from what positions of joints do?"""
    return name.owner in PLACED


def _conditions(data: Dataset) -> FloatArray:
    """(N, k) 1, payload, station, mount, approach and sensors of the rows: all but their positions."""
    labels = [own[:, np.newaxis] == np.unique(own) for own in (data.station, data.mount) if own is not None]
    numbers = [data.payload[:, np.newaxis], *labels, *(v[:, np.newaxis] for v in data.sensors.values())]
    if data.approach is not None:
        numbers.append(data.approach)
    return np.column_stack([np.ones(len(data)), *(np.nan_to_num(part.astype(float)) for part in numbers)])


def _share(step: FloatArray, X: FloatArray) -> float:
    """Of the variance of a step (N,) that columns X (N, k), the first of them 1, explain; 0 for rows on one side."""
    left = step - X @ np.linalg.lstsq(X, step, rcond=1e-9)[0]
    variance = float(np.sum((step - step.mean()) ** 2))
    return 1.0 - float(left @ left) / variance if variance > 0 else 0.0


def _outlasts_positions(name: Hypothesis, step: FloatArray, at: Fit, tried: int) -> bool:
    """Is the step significant beside the same motion as any smooth function of the positions, and jumps at one of them?

    Errors of successive rows that are correlated by rho count as (1 - rho) / (1 + rho) of as many.
    """
    A, r, row = at.standardized
    measured = row >= 0
    data = at.problem.kept
    always = from_the_beginning(name.bare, data)
    own, whole = (columns_at(at, [one], as_measured=True).values[: int(measured.sum())] for one in (name, always))
    courses = _of_positions(data.q, step)[row[measured]]
    follow = np.zeros((len(row), whole.shape[1] * courses.shape[1]))
    follow[measured] = (whole[:, :, np.newaxis] * courses[:, np.newaxis]).reshape(len(whole), -1)
    beside = np.zeros((len(row), own.shape[1]))
    beside[measured] = own
    X = unit_columns(A, follow)
    if X.shape[1] > rules.RICH_MODEL_SHARE * len(r):
        return False  # too few rows to tell
    freedom = len(r) - X.shape[1] - own.shape[1]
    Q = ridged_basis(X)
    left = r - Q @ (Q.T @ r)
    scores = score_tests(Q, beside, left, [own.shape[1]]).scores
    statistic, rank = np.asarray(scores.statistic), np.asarray(scores.rank)
    rho = at.problem.noise.memory
    scale = max(float(left @ left - statistic[0]) / freedom, 1.0) * (1 + rho) / (1 - rho)
    p = float(p_values(statistic / scale, rank, at.problem.noise.freedom)[0])
    return bool(rank[0] > 0) and p * tried < rules.ALPHA_SCAN


def _of_positions(q: FloatArray, step: FloatArray) -> FloatArray:
    """(N, k) powers of each joint's position and its jump at the position where it is most like a step.

    Of the joint that is most like it, whether the position is in each of PARTS parts of as many rows, and where in it,
    too: a jump up and one down are a bump.
    """
    courses, likeness = [polynomials(own, POWERS_OF_POSITION) for own in q.T], []
    for own in q.T:
        order = np.argsort(own, kind="stable")
        below = np.abs(np.cumsum(step[order] - step.mean()))
        likeness.append(float(below.max()))
        courses.append((own > own[order[int(np.argmax(below))]]).astype(float)[:, np.newaxis])
    likest = q[:, int(np.argmax(likeness))]
    part = np.searchsorted(np.quantile(likest, np.arange(1, PARTS) / PARTS), likest)
    inside = (part[:, np.newaxis] == np.arange(1, PARTS)).astype(float)
    return np.hstack([*courses, inside, inside * likest[:, np.newaxis]])
