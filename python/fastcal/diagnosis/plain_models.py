# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Comparison with plain models that anyone would try: the model that predicts held-out rows best is written.

Plain models are base and tool alone, the geometry, and the geometry with the compliance, the sag, or a curve of every
joint, or with compliance and curves; by themselves and beside the names, where rows are few with the geometry held near
nominal as well (`held_arm`), all by least squares of all rows as well as without the rows and the memory of the noise
that the diagnosis takes out. Rows are held out by poses, by stretches of the order of measuring and by regions
of the workspace, touches of unknown places by places, and judged as they were measured, whatever noise a fit assumes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.options_from_data import with_origins
from fastcal.calibration.repeatability import posture_groups
from fastcal.diagnosis import rules, sensitivity, unexplained
from fastcal.diagnosis.curves import with_curvatures
from fastcal.diagnosis.doubts import is_beyond_bounds
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.held_arm import SHOWN, arm_size, holding
from fastcal.diagnosis.held_out import PLACES, REGIONS, STRETCHES, HeldOut, gain, positions, shows_between
from fastcal.diagnosis.held_out_gains import brings_more
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.library import is_excluded, without_masses
from fastcal.diagnosis.problem import Problem
from fastcal.diagnosis.reasons import HELD_ARM, NOMINAL_ARM, Because, Reason
from fastcal.diagnosis.rivals import Model, Rivals, bare, with_entries
from fastcal.diagnosis.search import SearchNode
from fastcal.diagnosis.sure_names import Told
from fastcal.diagnosis.words import effect_in_words, owner_in_words
from fastcal.effects.entries import effect_names, effect_owners, label, traits_of
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Spec
from fastcal.said import chained, joined, said

FloatArray = NDArray[np.float64]

_ROUNDING = 1e-9  # plausible sizes
JUDGED = (None, STRETCHES, REGIONS)  # how rows are held out: by poses, stretches, regions


@dataclass(frozen=True, eq=False)
class Judged:
    """A model and its rows held out.

    Attributes:
        model: The model.
        squares: (N,) of each measured row, in units of its claimed noise: the mean of poses, stretches and regions held
            out.
        is_plain: Would anyone have tried it?
        by_least_squares: Of all rows, with the noise white?
        lead: Share by which it leaves less of what held-out rows are off by, squared, than what was found.
        has_surrogate: Is it written for what it leaves as a smooth function?
        is_chosen: Has it a part of the laws of all joints, those that help to predict the rows held out?
        elsewhere: (N,) the same of touches, whole places held out; None where there are no places.
    """

    model: Model
    squares: FloatArray
    is_plain: bool
    by_least_squares: bool = False
    lead: float = 0.0
    has_surrogate: bool = False
    is_chosen: bool = False
    elsewhere: FloatArray | None = None

    @property
    def holds_the_arm(self) -> bool:
        """Is the geometry nominal, or held near that?"""
        return self.model.fit.problem.arm_size is not None

    @property
    def has_curves(self) -> bool:
        """Has it a curve over a position beside the names, which has none?"""
        return any(traits_of(entry["effect"]).role == "curve" for entry in self.model.profiles)

    @property
    def is_as_simple(self) -> bool:
        """Is it the arm as nominal, or held near that, and nothing else?"""
        return self.holds_the_arm and not self.model.state.names and not self.model.profiles

    @property
    def effects(self) -> set[tuple[str, str]]:
        """Effects and owners of its names and of what is beside them."""
        beside = {(entry["effect"], entry["owner"]) for entry in self.model.profiles}
        return beside | {name.key for name in self.model.state.names}

    def shows(self, name: Hypothesis) -> bool:
        """Is a name of the set still clear beside what was added to it?"""
        own = next((n for n in self.model.fit.added if n.key == name.key), None)
        state = SearchNode(self.model.fit, self.model.state.family)
        return own is not None and state.wald(own) > rules.MIN_SNR_BESIDE_REST**2

    @property
    def added(self) -> str | None:
        """What it has beside the names, as a step of the gap; None: nothing."""
        if self.holds_the_arm:
            return NOMINAL_ARM if self.model.fit.problem.arm_size == 0 else HELD_ARM
        return ",".join(f"{entry['effect']}@{entry['owner']}" for entry in self.model.profiles) or None

    @property
    def words(self) -> str:
        """What the model is, and why it is written."""
        model = self.model
        owners: dict[str, list[str]] = {}
        for entry in model.profiles:
            owners.setdefault(entry["effect"], []).append(entry["owner"])
        joints = model.fit.problem.start.robot.joint_count
        parts: list[str] = [said("what was named")] if model.state.names else []
        parts += [
            said("{effect} of {places}", effect=_what(effect), places=_where(own, joints))
            for effect, own in owners.items()
        ]
        parts += [said("a smooth function of its residuals")] if self.has_surrogate else []
        held = model.fit.problem.arm_size
        arm = said("base and tool") if held == 0 else said("the geometry")
        if parts:
            arm = said("{arm} with {parts}", arm=arm, parts=chained("{first} and {second}", parts))
        else:
            arm = said("{arm} alone", arm=arm)
        if held:
            arm = said("{arm}, held near nominal ({size:.2g} mm and mrad, RMS)", arm=arm, size=float(held))
        if model.fit.problem.is_plain:
            arm = said("{arm}, without the weight of the arm", arm=arm)
        if self.by_least_squares:
            arm = said("{arm}, by least squares of all rows", arm=arm)
        better = said("no richer model has a clearly smaller error on held-out poses")
        if round(self.lead, 2) > 0:
            better = said(
                "it reduces the mean square error on held-out poses by {share:.0%}",
                share=float(self.lead),
            )
        return joined("; ", [arm, better])


def _what(effect: str) -> str:
    return said("a curve over the position") if traits_of(effect).role == "curve" else effect_in_words(effect)


def _where(owners: Sequence[str], joints: int) -> str:
    return said("all joints") if len(owners) == joints else joined(", ", map(owner_in_words, owners))


def judged(model: Model, *, is_plain: bool, by_least_squares: bool = False) -> Judged:
    """A model with its held-out rows."""
    kinds = (HeldOut(model.fit, owner=owner, as_measured=True).squares() for owner in JUDGED)
    there = None if model.fit.problem.touched is None else HeldOut(model.fit, owner=PLACES, as_measured=True).squares()
    return Judged(model, np.mean(list(kinds), axis=0), is_plain, by_least_squares, elsewhere=there)


def best_of_all(rivals: Rivals, found: Model, *, remains: bool) -> Judged:
    """The model that was found, or a plain one that predicts held-out rows clearly better.

    Of those that do, the first that the best one does not clearly beat as well: models with the names come first. Where
    something `remains` curves are tried too, and one standard error decides; so it always does for what only holds the
    arm, which is simpler, and for the very effects that were found, as smooth as they are among all joints, of which
    none was picked. Else MIN_GAIN of them; MIN_SEARCHED_GAIN for laws of some joints, since the best of many parts
    seems to gain by chance, and UNNAMED_LEAD for curves. Where rows fix the arm badly, what is written must lead the
    one held near nominal by MIN_SEARCHED_GAIN, as `calibrate` holds it; names that explain all need not. Of touches of
    unknown places nothing is written that predicts places held out worse than the best of the arms held near nominal.
    Names whose law nothing shows, of an arm without masses, have no lead over the laws of all joints.
    """
    own = judged(found, is_plain=False)
    errors = rules.MIN_RIVAL_GAIN if remains else rules.MIN_GAIN
    plain = [one for one in _plain(rivals, found, remains=remains) if one.model.fit is not found.fit]
    same = {name.key for name in found.state.names}
    simpler = {id(one): rules.MIN_RIVAL_GAIN for one in plain if one.holds_the_arm and not one.model.profiles}
    simpler |= {id(one): rules.MIN_RIVAL_GAIN for one in plain if same and one.effects == same}
    needed = {id(one): rules.MIN_SEARCHED_GAIN if one.is_chosen else errors for one in plain} | simpler
    needed |= {id(one): rules.UNNAMED_LEAD for one in plain if one.has_curves}
    if any(brings_more(found.state, name) for name in found.state.names):
        needed |= {id(one): 0.0 for one in plain if one.model.profiles and not one.has_curves}
    better = [one for one in plain if _beats(one, own, needed[id(one)]) and _holds_elsewhere(one.model, found)]
    best = min(better, key=lambda one: -gain(one.squares, own.squares)[0], default=own)
    chosen = next((one for one in better if one is best or not _beats(best, one, errors)), own)
    simple = _simplest(plain, own) if _is_badly_fixed(rivals, found, remains=remains) else None
    if simple is not None and not chosen.is_as_simple and not _beats(chosen, simple, rules.MIN_SEARCHED_GAIN):
        chosen = simple  # few rows, or many of one place, may be met by any model
    chosen = no_worse_elsewhere(chosen, plain)
    return own if chosen is own else replace(chosen, lead=gain(chosen.squares, own.squares)[0])


def best_of_few(rivals: Rivals) -> Judged:
    """Of few postures: of the geometry, the same held near nominal, base and tool alone, what predicts others best."""
    found = bare(rivals.search.start)
    own = judged(found, is_plain=False)
    plain = [one for one in _plain(rivals, found, remains=False, richer=False) if one.is_as_simple]
    best = max([own, *plain], key=lambda one: gain(one.squares, own.squares)[0])
    return replace(best, is_plain=True, lead=gain(best.squares, own.squares)[0])


def _is_badly_fixed(rivals: Rivals, found: Model, *, remains: bool) -> bool:
    """Do rows fix the arm badly? Where names explain all these need not lead; where nothing is missing, as `calibrate`.

    Ways that hardly show are made up for by base and tool, unless something missing pulls the arm along them.
    """
    if rivals.arm_size is None or remains:
        return rivals.arm_size is not None
    return not found.state.names and arm_size(rivals.search.start.fit, SHOWN) is not None


def _simplest(plain: Sequence[Judged], own: Judged) -> Judged:
    """Of base and tool alone and the geometry held near nominal, what predicts best."""
    return min((one for one in plain if one.is_as_simple), key=lambda one: -gain(one.squares, own.squares)[0])


def no_worse_elsewhere(chosen: Judged, plain: Sequence[Judged]) -> Judged:
    """The chosen model, or the arm held near nominal that predicts touches of places held out best and better."""
    if chosen.elsewhere is None:
        return chosen
    less = [
        (gain(one.elsewhere, chosen.elsewhere)[0], k)
        for k, one in enumerate(plain)
        if one.is_as_simple and one.elsewhere is not None
    ]
    most, k = max(less, default=(0.0, 0))
    return plain[k] if most > 0 else chosen


def _beats(one: Judged, other: Judged, errors: float) -> bool:
    less, error = gain(one.squares, other.squares, posture_groups(one.model.fit.problem.data))
    return less > max(rules.MIN_PLAIN_SHARE, errors * error)


def _holds_elsewhere(model: Model, found: Model) -> bool:
    """Do curves of joints predict better where their joints have not been, by their standard errors on average?

    Rows that share positions of a joint share what is wrong with them; one joint alone decides nothing: a curve goes
    astray beyond the last rows of a joint, as far as it likes.
    """
    joints = [entry["owner"] for entry in model.profiles if traits_of(entry["effect"]).role == "curve"]
    clear = []
    for joint in joints:
        own, other = (HeldOut(one.fit, owner=joint, as_measured=True).squares() for one in (model, found))
        less, error = gain(own, other, positions(found.fit.problem.data, joint))
        clear.append(less / max(error, np.finfo(np.float64).tiny))
    return not clear or bool(np.mean(clear) > rules.MIN_GAIN)


def beside_plain(told: Told, written: Judged) -> Told:
    """What is told where a plain model is written: names that it has no part of are not in it."""
    held = {name.key for name in written.model.state.names}
    held |= {(entry["effect"], entry["owner"]) for entry in written.model.profiles}
    gone = {repr(n): Because(Reason.PLAIN_MODEL_PREDICTS) for n in told.best.names if n.key not in held}
    final = SearchNode(written.model.fit, told.best.family)
    if written.holds_the_arm:  # what it leaves are the arm's own errors as well
        final = final if written.model.profiles else told.final
        return Told(told.best, final, told.remains, gone | told.unsure)
    return Told(told.best, final, unexplained.remains(final), gone | told.unsure)


def _plain(rivals: Rivals, found: Model, *, remains: bool, richer: bool = True) -> Iterator[Judged]:
    """The plain models, those with the names first, by least squares where that differs; those that hold the arm last.

    Of many rows only those without the names, and of these by least squares the geometry alone: what differs is little.
    """
    search = rivals.search
    start, named = search.start, found.state
    additions = list(_additions(rivals, curved=remains)) if richer and not start.suffices else []
    few = len(start.fit.problem.rows) <= rules.CHOSEN_AGAIN_ROWS
    states = [named, start] if few and named.names and not start.suffices else [start]
    for state in states:
        size = rivals.arm_size if state is start else arm_size(state.fit) if few and remains else None
        for entries in ([], *additions):
            tried = _beside(state, entries)
            for problem, is_measured in _ways(state, tried, few=few):
                if entries and is_measured and not few:
                    continue
                whole = _known(rivals, state, entries, problem) or _with(state, tried, problem)
                free = rivals.with_what_helps(whole) if whole is not None and whole.profiles else whole
                held = None if size is None else _with_arm_held(state, tried, problem, size)
                # Laws of all joints, of which none was picked, need less of a lead than those that help.
                unpicked = whole if few and whole is not free and _laws(tried) == tried else None
                for model in filter(None, (free, unpicked, held)):
                    one = judged(model, is_plain=True, by_least_squares=is_measured)
                    chosen = not one.holds_the_arm and len(_laws(model.profiles)) < len(_laws(tried))
                    yield replace(one, is_chosen=chosen)
    for problem, is_measured in _ways(start, [], few=few):
        model = bare(SearchNode(fit(replace(problem, arm_size=0.0), [], start.fit), start.family))
        yield judged(model, is_plain=True, by_least_squares=is_measured)


def _with_arm_held(start: SearchNode, entries: list[Spec], problem: Problem, size: float) -> Model | None:
    """The geometry held near nominal with entries beside it, against what the geometry alone leaves, then they all."""
    model = _with(start, entries, holding(problem, size, start.fit))
    return None if model is None else _with(start, model.profiles, holding(problem, size, model.fit))


def _laws(entries: Sequence[Spec]) -> list[Spec]:
    """Those that are no curves over a position: curves are also judged where their joints have not been."""
    return [entry for entry in entries if traits_of(entry["effect"]).role != "curve"]


def _known(rivals: Rivals, state: SearchNode, entries: list[Spec], problem: Problem) -> Model | None:
    """The model with the curves of all joints as the rivals have it already."""
    known = rivals.with_profiles(state, rivals.every) if rivals.is_known(state, rivals.every) else None
    return known if known is not None and known.profiles == entries and problem is state.fit.problem else None


def _additions(rivals: Rivals, *, curved: bool) -> Iterator[list[Spec]]:
    """What is added to the geometry: compliances, sags, curves of all joints, compliances and curves.

    No sags of a grid of few positions: all of them together fit these, and fall apart in between.
    """
    start = rivals.search.start
    barely = sensitivity.barely_shown(start)
    yields = [e for e in _of_all_joints(rivals.search.problem, is_sag=False) if (e["effect"], e["owner"]) not in barely]
    laws = _of_all_joints(rivals.search.problem, is_sag=True) if shows_between(start.fit.problem.data) else []
    sags = with_curvatures(start.fit, laws)
    with_curves = rivals.with_profiles(start, rivals.every) if curved else None
    curves = [] if with_curves is None else with_curves.profiles
    for entries in (yields, sags, curves, [*yields, *curves] if yields and curves else []):
        if entries:
            yield entries


def _of_all_joints(problem: Problem, *, is_sag: bool) -> list[Spec]:
    """Entries of the effect by which every joint yields to its load, or to the arm's weight where no masses say it."""
    robot, there = problem.start.robot, {(e["effect"], e["owner"]) for e in problem.given}
    out: list[Spec] = []
    for effect in effect_names():
        traits = traits_of(effect)
        own = traits.without_masses if is_sag else traits.depends_on == ("torque",) and not traits.generalizes
        if not own or traits.role != "cause" or traits.place != "joint":
            continue
        for owner in effect_owners(effect, robot.core):
            if (effect, owner) in there or is_excluded(effect, owner, problem.excluded):
                continue
            try:
                out.append(with_origins({"effect": effect, "owner": owner}, robot, problem.kept))
            except InvalidInput:
                continue
    return out


def _beside(state: SearchNode, entries: Sequence[Spec]) -> list[Spec]:
    """The entries but for those that a set holds already, or something richer."""
    held = {name.key for name in state.names} | {(s, n.owner) for n in state.names for s in n.traits.generalizes}
    return [entry for entry in entries if (entry["effect"], entry["owner"]) not in held]


def _ways(state: SearchNode, entries: Sequence[Spec], *, few: bool) -> list[tuple[Problem, bool]]:
    """How a set with entries beside it is fitted, and whether by least squares: as the search does, or that.

    Of a few rows of an arm without masses each without what its weight does to joints that yield as well: a sag of
    every such joint, which no one tries with a compliance, costs more than it tells where it hardly shows.
    """
    own = state.fit.problem
    ways = [(problem, problem is not own) for problem in (own, _as_measured(own)) if problem is not None]
    if not few or not without_masses(own.start.robot):
        return ways
    plain = [(replace(problem, is_plain=True), is_measured) for problem, is_measured in ways]
    added = [*(name.entry for name in state.names), *entries]
    return ways if plain[0][0].complete(added) == own.complete(added) else [*ways, *plain]


def _as_measured(problem: Problem) -> Problem | None:
    """All rows, as if each number erred by itself; None where that is the problem as it is."""
    measured = problem.data.measured
    if np.array_equal(problem.used, measured) and problem.noise.is_white and problem.weight is None:
        return None
    return replace(problem, used=measured, noise=problem.noise.without_correlation, weight=None)


def _is_idle(at: Fit, name: Hypothesis) -> bool:
    """Did a fit leave an added effect where it began, as the sag of a joint that no weight turns in these rows?"""
    place = at.place(name)
    sizes = np.array([parameter.sigma for parameter in at.model.parameters[place]])
    return bool(np.all(np.abs(at.theta[place]) <= _ROUNDING * sizes))


def _with(state: SearchNode, entries: list[Spec], problem: Problem) -> Model | None:
    """A set with entries beside it, less those that come out with an impossible sign, or stay at nothing.

    None where a name has an impossible sign.
    """
    if not entries:
        at = state.fit if problem is state.fit.problem else fit(problem, state.names, state.fit)
        return bare(state if at is state.fit else SearchNode(at, state.family))
    for _ in range(rules.MAX_REFITS):
        model = with_entries(state, entries, problem)
        if model is None:
            return None
        wrong = [label(name.entry) for name in model.fit.added if is_beyond_bounds(model.fit, name)]
        if any(label(name.entry) in wrong for name in state.names):
            return None
        added = [name for name in model.fit.added if name not in state.names]
        wrong += [label(name.entry) for name in added if _is_idle(model.fit, name)]
        entries = [entry for entry in entries if label(entry) not in wrong]
        if not wrong or not entries:
            break
    return model if entries else None
