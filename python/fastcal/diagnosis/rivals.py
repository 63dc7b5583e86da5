# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where something remains: what was found against the plain models that anyone would try, on rows held out of each.

Each model is fitted to four fifths of the poses and judged on the others, linearized at its fit to all of them, its
outliers, noise and options (orders, corners, curvatures) as there: of two models that differ in those only, this says
little; between names and curves it says which predicts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.evaluation import pose_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.adaptation import values
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.library import Hypothesis
from fastcal.diagnosis.problem import Problem, core_entry, prepared_problem
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.effects.entries import curve_of
from fastcal.robot.robot import Robot, Spec

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """A set of names, and joint profiles beside it.

    Attributes:
        state: The set.
        profiles: Entries of the profiles; empty: none.
        calibration: With the profiles, which `fit` is the whitened problem of; without any None and that of the set.
    """

    state: SearchNode
    profiles: list[Spec]
    calibration: CalibrationResult | None
    fit: Fit


def best_predicting(robot: Robot, search: Search, best: SearchNode, curved: Sequence[Spec]) -> Model:
    """The set that was found, or the rival that predicts held-out rows better.

    Args:
        robot: As it came.
        search: Where the set was found.
        best: The set.
        curved: Profiles of the joints that err by their own position beyond it.
    """
    every = [profile(f"joint{i + 1}") for i, kind in enumerate(robot.joint_types) if kind == "revolute"]
    rivals = [(best, list(curved)), (search.start, every), *((state, every) for state in search.yielding_joints())]
    chosen = Model(best, [], None, best.fit)
    least = held_out_squares(chosen.fit)
    for state, profiles in rivals:
        rival = _with_profiles(robot, state, profiles) if profiles else None
        if rival is None:
            continue
        own = held_out_squares(rival.fit)
        if _is_better(own, least):  # also than the smaller rivals before it
            chosen, least = rival, own
    return chosen


def profile(owner: str) -> Spec:
    """A curve over the joint's own position."""
    return {"effect": curve_of("joint"), "owner": owner}


def _is_better(rival: FloatArray, incumbent: FloatArray) -> bool:
    gain = incumbent - rival
    return bool(gain.mean() > rules.MIN_RIVAL_GAIN * gain.std(ddof=1) / np.sqrt(len(gain)))


def _with_profiles(robot: Robot, state: SearchNode, profiles: list[Spec]) -> Model | None:
    """The set and profiles, calibrated: how curved they are and what is geometry's is for the calibration to find.

    None where it does not converge, or where an effect of the set has size zero beside the profiles.
    """
    problem = state.fit.problem
    entries = [core_entry(entry) for entry in state.fit.entries]
    # Outliers are known and left out: a robust loss would have nothing left to do.
    found = calibrate(
        Robot(dict(robot.spec) | {"effects": [*entries, *profiles]}),
        problem.data.select(problem.used),
        loss="none",
        as_read=True,
        threads=problem.threads,
    )
    if found.status != "converged" or any(_is_nil(found.model, name) for name in state.names):
        return None
    again: Problem = prepared_problem(found.model, problem.data, problem.names, problem.noise, problem.threads)
    return Model(state, profiles, found, fit(again.with_rows(problem.used), []))


def _is_nil(model: Robot, name: Hypothesis) -> bool:
    """Is an effect of a calibrated robot at a bound of zero?"""
    return not any(value.value for value in values(model, name.entry).values())


def folds(problem: Problem) -> NDArray[np.intp]:
    """(N,) fold of each fitted row: all visits of a pose in one."""
    groups = pose_groups(problem.kept)
    order = np.random.default_rng(0).permutation(groups.max() + 1)
    return np.asarray(order[groups] % rules.FOLDS, dtype=np.intp)


def held_out_squares(at: Fit) -> FloatArray:
    """(rows,) whitened squared error of each measured row as the other folds predict it."""
    A, r, row = at.whitened
    length = np.linalg.norm(A, axis=0)
    A = A / length
    fold = folds(at.problem)[row]
    fold[row < 0] = -1
    out = np.zeros(at.problem.kept.q.shape[0])
    for k in range(rules.FOLDS):
        fitted, left = fold != k, fold == k
        R = np.asarray(np.linalg.qr(A[fitted], mode="r"))
        step = np.linalg.lstsq(R.T @ R, A[fitted].T @ r[fitted], rcond=1e-14)[0]
        out += np.bincount(row[left], (r[left] - A[left] @ step) ** 2, len(out))
    return np.asarray(out[np.unique(row[row >= 0])])
