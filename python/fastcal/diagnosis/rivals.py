# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where something remains: what was found against the plain models that anyone would try, on rows held out of each.

Each model is fitted to four fifths of the poses and judged on the others, linearized at its fit to all of them, its
outliers, noise and options (orders, corners, curvatures) as there: of two models that differ in those only, this says
little; between names and curves it says which predicts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.evaluation import pose_groups
from fastcal.diagnosis import rules
from fastcal.diagnosis.curves import with_curvatures
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.library import Hypothesis, without_masses
from fastcal.diagnosis.noise import isolated_rows
from fastcal.diagnosis.periodic import forward, many_waves
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.robust_rows import without_outliers
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.effects.entries import curve_of
from fastcal.robot.robot import Spec

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """A set of names, and joint profiles beside it.

    Attributes:
        state: The set.
        profiles: Entries of the profiles; empty: none.
        fit: Of both together.
        noise: As the set shows it, or what the profiles leave where that is less.
    """

    state: SearchNode
    profiles: list[Spec]
    fit: Fit
    noise: Noise


@dataclass(eq=False)
class Rivals:
    """The plain models of a search, each fitted once.

    Attributes:
        search: Of the names.
        curves_leave: Sum of squares that profiles of all joints alone leave of held-out rows; it does not depend on the
            names, so that a search with more names takes over what is known of it.
    """

    search: Search
    curves_leave: float | None = None
    fitted: dict[tuple[tuple[str, ...], ...], Model | None] = field(default_factory=dict)

    def best_predicting(self, best: SearchNode, curved: Sequence[Spec]) -> Model:
        """The set that was found, or the rival that predicts held-out rows better.

        Args:
            best: The set.
            curved: Profiles of the joints that err by their own position beyond it.
        """
        start = self.search.start
        every = self.every
        rivals = [(best, list(curved)), (start, every), *((s, every) for s in self.search.yielding_joints())]
        chosen = Model(best, [], best.fit, best.fit.problem.noise)
        least = held_out_squares(chosen.fit)
        for state, profiles in rivals:
            rival = self.with_profiles(state, profiles) if profiles else None
            if rival is None:
                continue
            own = held_out_squares(rival.fit)
            if _is_better(own, least):  # also than the smaller rivals before it
                chosen, least = rival, own
        return chosen

    @property
    def every(self) -> list[Spec]:
        """Profiles of all joints that turn."""
        kinds = self.search.problem.start.robot.joint_types
        return [profile(f"joint{i + 1}") for i, kind in enumerate(kinds) if kind == "revolute"]

    def with_profiles(self, state: SearchNode, profiles: Sequence[Spec]) -> Model | None:
        """A set and profiles beside it; None where they make no model."""
        key = (state.key, tuple(p["owner"] for p in profiles))
        if key not in self.fitted:
            self.fitted[key] = _with_profiles(state, profiles)
        return self.fitted[key]

    @property
    def names_are_hopeless(self) -> bool:
        """Would the most names that a set may have explain too little to be given, or less than profiles predict?

        As the score tests have it, each name beside those before it: far cheaper than to fit the sets. Rows held out
        from profiles against rows that the names are fitted to: names that are the cause do not lose that.
        """
        start = self.search.start
        if start.suffices or without_masses(self.search.problem.start.robot):
            return False  # without masses the score of a compliance lacks the sag that comes with it
        tests = start.blocks.tests
        names = many_waves(self.search) or forward(start, list(range(start.blocks.count)), rules.MAX_EFFECTS_GROWN)
        left = tests.given(names)
        p = p_values(np.asarray(left.statistic), np.asarray(left.rank), self.search.problem.noise.freedom)
        if not (p < rules.ALPHA_FURTHER / (start.family.named + start.family.generic)).any():
            return False
        remaining = tests.remaining_with(names)[0]
        if remaining > rules.HOPELESS_SHARE * tests.remaining:
            return True
        if self.curves_leave is None:
            curves = self.with_profiles(start, self.every)
            self.curves_leave = np.inf if curves is None else float(np.nansum(held_out_squares(curves.fit)))
        return bool(self.curves_leave < remaining * self.search.problem.noise.factor**2)


def profile(owner: str) -> Spec:
    """A curve over the joint's own position."""
    return {"effect": curve_of("joint"), "owner": owner}


def _is_better(rival: FloatArray, incumbent: FloatArray) -> bool:
    gain = (incumbent - rival)[np.isfinite(incumbent) & np.isfinite(rival)]
    return bool(gain.mean() > rules.MIN_RIVAL_GAIN * gain.std(ddof=1) / np.sqrt(len(gain)))


def _with_profiles(state: SearchNode, profiles: Sequence[Spec]) -> Model | None:
    """The set and profiles of the joints that move, refitted until the rows that it reaches stand still.

    None where the fit does not converge, or where an effect of the set has size zero beside the profiles.
    """
    q = state.fit.problem.kept.q
    moving = [p for p in profiles if np.ptp(q[:, int(p["owner"].removeprefix("joint")) - 1]) > 0]
    at = state.fit
    for _ in range(rules.MAX_REFITS):
        curves = with_curvatures(at, moving)
        found = fit(at.problem, [*state.names, *map(Hypothesis, curves)], at, pulled=True)
        if not found.converged or any(not found.value(name).any() for name in state.names):
            return None
        again = reached(found)
        if np.array_equal(again.used, at.problem.used):
            break
        at = fit(again, state.names, at)
    return Model(state, curves, found, again.noise)


def reached(at: Fit) -> Problem:
    """The problem with the rows that a fit reaches, and with the noise that it leaves where that is less.

    A rich model that lacks a curve takes some of it for noise, and a lone pose for an outlier.
    """
    every, (A, r, row) = at.on_every_row
    length = np.linalg.norm(A, axis=0)
    left = without_outliers(A[:, length > 0] / length[length > 0], r, row)
    used = every.used.copy()
    used[every.rows[isolated_rows(left.wrong, every.kept)]] = False
    noise = every.noise
    calmer = replace(noise, factor=noise.factor * float(np.sqrt(left.mean_square)), freedom=left.freedom)
    return replace(every, used=used, noise=calmer if left.mean_square < 1 else noise)


def folds(problem: Problem) -> NDArray[np.intp]:
    """(N,) fold of each fitted row: all visits of a pose in one."""
    groups = pose_groups(problem.kept)
    order = np.random.default_rng(0).permutation(groups.max() + 1)
    return np.asarray(order[groups] % rules.FOLDS, dtype=np.intp)


def held_out_squares(at: Fit) -> FloatArray:
    """(N,) squared error of each row as the other folds predict it, whitened but for `factor`; NaN: not used."""
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
    whole = np.full(len(at.problem.data), np.nan)
    rows = np.unique(row[row >= 0])
    whole[at.problem.rows[rows]] = out[rows] * at.problem.noise.factor**2
    return whole
