# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""If an error remains: the effects found against the plain models that anyone would try, on held-out rows.

Each model is judged by `held_out`, its options (orders, corners, curvatures) as its fit to all rows has them: of two
models that differ in those only, this says little; between names and curves it says which predicts. What has no name
must then lead with curvatures that are chosen again (`leads`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.columns import unit_columns, unit_products
from fastcal.calibration.extrapolation_notes import still_joints
from fastcal.diagnosis import rules
from fastcal.diagnosis.curves import with_curvatures, with_finer_knots
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.held_arm import arm_size, holding
from fastcal.diagnosis.held_out import HeldOut, folds, gain, is_better, lead, positions, squares, wins
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import without_masses
from fastcal.diagnosis.noise import left_out
from fastcal.diagnosis.periodic import forward
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.robust_rows import without_outliers
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.effects.entries import curve_of
from fastcal.place import joint_name, place_of
from fastcal.robot.robot import Spec

FloatArray = NDArray[np.float64]
Key = tuple[tuple[str, ...], tuple[str, ...]]

# Share of the misfit that the most names leave, by their score tests, from which on no set is searched for: too little
# explained to be given, with a margin for what fits add to score tests.
HOPELESS_SHARE = 0.6


@dataclass(frozen=True, eq=False)
class Model:
    """A set of names, and joint profiles beside it.

    Attributes:
        state: The set.
        profiles: Entries of the profiles; empty: none.
        fit: Of both together.
        noise: As the set shows it, or what the profiles leave where that is less.
        reaches: (N,) rows of the data that it reaches; a fit of profiles may hold more.
        names: The set alone, fitted to the rows of `fit` from its own, where that was done; or None.
    """

    state: SearchNode
    profiles: list[Spec]
    fit: Fit
    noise: Noise
    reaches: NDArray[np.bool_]
    names: Fit | None = None

    @cached_property
    def held(self) -> HeldOut:
        """Rows held out of its fit."""
        return HeldOut(self.fit)

    @cached_property
    def predicted(self) -> FloatArray:
        """(N,) their squares: `HeldOut.squares`."""
        return self.held.squares()


@dataclass(eq=False)
class Rivals:
    """The plain models of a search, each fitted once.

    Attributes:
        search: Of the names.
        fitted: Sets and profiles beside them that were fitted, by `_key`.
    """

    search: Search
    fitted: dict[Key, Model | None] = field(default_factory=dict)

    def again(self, problem: Problem) -> Rivals:
        """Those of a search with more names or other noise; what only more names leave as it is needs no new fit."""
        after = Rivals(self.search.again(problem))
        plain = self.fitted.get(_key(self.search.start, self.every))
        if plain is not None and problem.noise is self.search.problem.noise:
            fit = replace(plain.fit, problem=replace(plain.fit.problem, names=problem.names))
            after.fitted[_key(after.search.start, self.every)] = replace(
                plain, state=after.search.start, fit=fit, names=None
            )
        return after

    def best_predicting(self, best: SearchNode, curved: Sequence[Spec]) -> Model:
        """The set that was found, or a rival that predicts held-out rows better, less what does not help it to.

        The simpler rivals come first: each must be better than those before it, and one with curves at most positions
        of their joints as well. What takes the place of the set, and is no part of it, must lead clearly.

        Args:
            best: The set.
            curved: Profiles of the joints that err by their own position beyond it.
        """
        start, every, yielding = self.search.start, self.every, self.search.yielding_joints()
        curved = [entry for entry in curved if entry in every]
        is_begun = _key(start, every) in self.fitted and best is start  # all profiles, less those that do not help
        beside = [] if is_begun else [(best, list(curved))]
        rivals = [*((s, []) for s in (start, *yielding)), *beside, *((s, every) for s in (start, *yielding))]
        chosen = plain = bare(best)
        for state, profiles in rivals:
            rival = self.with_profiles(state, profiles) if profiles else bare(state)
            if rival is None or rival.fit is chosen.fit:
                continue
            if is_better(rival.predicted, chosen.predicted):
                chosen = rival
                plain = plain if rival.profiles else rival
        if chosen.profiles:
            fewer = self.with_what_helps(chosen)
            if fewer.profiles and _holds_elsewhere(fewer, plain) and leads(fewer, plain) and self._leads_held(fewer):
                return _finer(fewer)
            plain = plain if fewer.profiles else fewer
        if all(name in best.names for name in plain.state.names):
            return plain
        fewer, simpler = self.with_what_helps(plain), bare(best)
        simpler = bare(start) if is_better(bare(start).predicted, simpler.predicted) else simpler
        return fewer if leads(fewer, simpler) else simpler

    def with_what_helps(self, model: Model) -> Model:
        """The model less the names and curves without which held-out rows are predicted as well, the least first."""
        held, gone = model.held, list[Hypothesis]()
        left = model.predicted
        names = model.state.names if len(model.state.names) <= rules.MAX_EFFECTS_GROWN else ()
        members = [*names, *model.fit.added[len(model.state.names) :]]
        alone = {id(m): gain(left, held.squares(model.fit.columns(m))) for m in members}
        for member in sorted(members, key=lambda m: alone[id(m)][0]):
            without = held.squares([i for m in (*gone, member) for i in model.fit.columns(m)])
            less, error = gain(left, without)
            if less < rules.MIN_RIVAL_GAIN * error:
                gone, left = [*gone, member], without
        if not gone:
            return model
        kept = [name for name in model.state.names if not any(name is m for m in gone)]
        idle = {m.key for m in gone if m not in model.state.names}
        state = self.search.state(kept, model.state) if kept else self.search.start
        curves = [entry for entry in model.profiles if (entry["effect"], entry["owner"]) not in idle]
        if not curves:
            fewer = bare(state)
        else:
            found = _fitted(state, curves, model.fit.problem, model.fit)
            fewer = model if found is None else replace(model, state=state, profiles=curves, fit=found, names=None)
        return model if is_better(model.predicted, fewer.predicted) else fewer

    @property
    def every(self) -> list[Spec]:
        """Profiles of all joints that turn the tool, in the rows too, and have none in the model that was given."""
        problem, robot = self.search.problem, self.search.problem.start.robot
        has = {entry["owner"] for entry in problem.given if entry["effect"] == curve_of("joint")}
        beside = {*robot.beside, *robot.passive}
        turning = [i for i, kind in enumerate(robot.joint_types) if kind == "revolute" and i not in beside]
        still = {*has, *still_joints(robot, problem.kept)}
        return [profile(joint) for joint in map(joint_name, turning) if joint not in still]

    def with_profiles(self, state: SearchNode, profiles: Sequence[Spec]) -> Model | None:
        """A set and profiles beside it; None where there are none, or where they make no model."""
        key = _key(state, profiles)
        if key not in self.fitted:
            self.fitted[key] = _with_profiles(state, profiles) if profiles else None
        return self.fitted[key]

    def is_known(self, state: SearchNode, profiles: Sequence[Spec]) -> bool:
        """Was this fitted already?"""
        return _key(state, profiles) in self.fitted

    @cached_property
    def arm_size(self) -> float | None:
        """`held_arm.arm_size`; None for many rows as well."""
        start = self.search.start.fit
        return arm_size(start) if len(start.problem.rows) <= rules.CHOSEN_AGAIN_ROWS else None

    def _leads_held(self, model: Model) -> bool:
        """Does a model lead the geometry held near nominal as well, where the rows do not fix that?"""
        if self.arm_size is None:
            return True
        start, held = self.search.start, holding(self.search.problem, self.arm_size, self.search.start.fit)
        return leads(model, bare(SearchNode(fit(held, [], start.fit), start.family)))

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
        names = self.search.many_waves or forward(start, list(range(start.blocks.count)), rules.MAX_EFFECTS_GROWN)
        left = tests.given(names)
        p = p_values(np.asarray(left.statistic), np.asarray(left.rank), self.search.problem.noise.freedom)
        if not (p < rules.ALPHA_FURTHER / (start.family.named + start.family.generic)).any():
            return False
        remaining = tests.remaining_with(names)[0]
        if remaining > HOPELESS_SHARE * tests.remaining:
            return True
        return bool(self.curves_leave < remaining * self.search.problem.noise.factor**2)

    @property
    def curves_leave(self) -> float:
        """Sum of squares that profiles of all joints leave of held-out rows, of those that they reach."""
        curves = self.with_profiles(self.search.start, self.every)
        return np.inf if curves is None else float(np.sum(curves.predicted[curves.reaches]))


def _holds_elsewhere(rival: Model, other: Model) -> bool:
    """Does a rival predict better at most positions where the joints that it has curves of have not been?

    Rows that share positions of a joint share what is wrong with them: a curve that repeats it predicts other poses
    of the same positions, and nothing else.
    """
    for entry in rival.profiles:
        own, its = (HeldOut(model.fit, owner=entry["owner"]).squares() for model in (rival, other))
        if not wins(own, its, positions(rival.fit.problem.data, entry["owner"])):
            return False
    return True


def leads(model: Model, other: Model) -> bool:
    """Are rows held out predicted better by UNNAMED_LEAD standard errors by a model than by a simpler one?

    By plain squares, of all rows but gross ones: a loss that spares large errors prefers a curve through most rows to
    one through the mean of all.
    """
    before = other.predicted
    among = before < rules.GROSS_SIZE**2 * np.nanmedian(before)
    return lead(_chosen_again(model), before, among) >= rules.UNNAMED_LEAD


def _chosen_again(model: Model) -> FloatArray:
    """(N,) `predicted`, of curves that are as curved as the other folds ask for: all rows have seen those held out."""
    every = model.fit.on_every_row.problem
    if not model.profiles or len(every.rows) > rules.CHOSEN_AGAIN_ROWS:
        return model.predicted
    fold = folds(every)
    out = np.full(len(every.data), np.nan)
    for k in range(rules.FOLDS):
        held = every.rows[fold == k]
        used = model.fit.problem.used.copy()
        used[held] = False
        names = fit(model.fit.problem.with_rows(used), model.state.names, model.state.fit)
        curves = map(Hypothesis, with_curvatures(names, model.profiles))
        out[held] = squares(fit(names.problem, [*model.state.names, *curves], names, pulled=True))[held]
    return out


def profile(owner: str) -> Spec:
    """A curve over the joint's own position."""
    return {"effect": curve_of("joint"), "owner": owner}


def _key(state: SearchNode, profiles: Sequence[Spec]) -> Key:
    return state.key, tuple(p["owner"] for p in profiles)


def bare(state: SearchNode) -> Model:
    """A set without profiles."""
    return Model(state, [], state.fit, state.fit.problem.noise, state.fit.problem.used)


def refitted(model: Model, problem: Problem) -> Fit:
    """The fit of a model to the rows of a problem; its own where that does not converge."""
    if not model.profiles:
        return fit(problem, model.state.names, model.fit)
    found = _fitted(model.state, model.profiles, problem, model.fit)
    return model.fit if found is None else found


def _with_profiles(state: SearchNode, profiles: Sequence[Spec]) -> Model | None:
    """The set and profiles of the joints that move, refitted until the rows that it reaches no longer change.

    None where the fit does not converge, or where an effect of the set has size zero beside the profiles.
    """
    q = state.fit.problem.kept.q
    moving = [p for p in profiles if np.ptp(q[:, place_of(p["owner"]).index]) > 0]
    curves = with_curvatures(state.fit, moving)
    at, problem = state.fit, state.fit.problem
    for _ in range(rules.MAX_REFITS):
        found = _fitted(state, curves, problem, at)
        if found is None:
            return None
        problem, at = reached(found), found
        if np.array_equal(problem.used, found.problem.used):
            break
    return _on_more_rows(Model(state, curves, at, problem.noise, problem.used))


def _fitted(state: SearchNode, curves: list[Spec], problem: Problem, near: Fit, names: Fit | None = None) -> Fit | None:
    """The set and these curves beside it, on the rows of a problem; None as `_with_profiles`.

    `names` is the set alone on these rows, where that has been fitted.
    """
    if names is None:
        names = near if near is state.fit else fit(problem, state.names, near)
    are_pulled = any(entry["effect"] == curve_of("joint") for entry in curves)
    found = fit(problem, [*state.names, *map(Hypothesis, curves)], names, pulled=are_pulled)
    return found if found.converged and all(found.value(name).any() for name in state.names) else None


def with_entries(state: SearchNode, entries: Sequence[Spec], problem: Problem) -> Model | None:
    """A set with entries beside it, on the rows of a problem; None as `_fitted`."""
    names = state.fit if problem is state.fit.problem else fit(problem, state.names, state.fit)
    found = _fitted(state, list(entries), problem, names, names)
    return None if found is None else Model(state, list(entries), found, problem.noise, problem.used, names)


def _on_more_rows(model: Model) -> Model:
    """The model fitted to what it leaves out as well, but for gross rows, unless held-out rows are predicted worse.

    Rows beside a step or a kink are hard to reach, and no outliers: without them the curve is drawn too smooth.
    """
    at, before = model.fit, model.predicted
    more = at.problem.used | (before < rules.GROSS_SIZE**2 * np.nanmedian(before))
    if np.array_equal(more, at.problem.used) or is_better(before, HeldOut(at, more).squares()):
        return model
    problem = at.problem.with_rows(more)
    names = fit(problem, model.state.names, model.state.fit)
    curves = with_curvatures(names, model.profiles)
    found = _fitted(model.state, curves, problem, names, names)
    if found is None:
        return model
    fuller = replace(model, profiles=curves, fit=found, names=names)
    return model if is_better(before, fuller.predicted) else fuller


def _finer(model: Model) -> Model:
    """The model with curves that show a wave a motor turn, if rows held out are then clearly predicted better."""
    problem = model.fit.problem
    at = fit(problem, model.state.names, model.state.fit) if model.names is None else model.names
    entries = with_finer_knots(at, model.profiles)
    if entries is None:
        return model
    curves = with_curvatures(at, entries, [entry["curvature"] for entry in model.profiles])
    found = _fitted(model.state, curves, problem, at, at)
    if found is None:
        return model
    finer = replace(model, profiles=curves, fit=found)
    less, error = gain(finer.predicted, model.predicted)
    if not less > rules.MIN_GAIN * error:
        return model
    every = reached(found)
    calmer = _fitted(model.state, curves, replace(problem, noise=every.noise), found)
    return model if calmer is None else replace(finer, fit=calmer, noise=every.noise, reaches=every.used)


def reached(at: Fit) -> Problem:
    """The problem with the rows that a fit reaches, and with the noise that it leaves where that is less.

    A rich model that lacks a curve takes some of it for noise, and a lone pose for an outlier.
    """
    whole = at.on_every_row
    every, (A, r, row) = whole.problem, whole.whitened
    left = without_outliers(unit_columns(A), r, row, normal=unit_products(whole.normal))
    used = every.used.copy()
    used[every.rows[left_out(left.wrong, left.gross, every.kept)]] = False
    noise = every.noise
    calmer = replace(noise, factor=noise.factor * float(np.sqrt(left.mean_square)), freedom=left.freedom)
    return replace(every, used=used, noise=calmer if left.mean_square < 1 else noise)
