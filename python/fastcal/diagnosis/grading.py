# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Grades of findings: A only if everything that could be mistaken for the cause has been ruled out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.parallel import each
from fastcal.diagnosis import rules, unexplained
from fastcal.diagnosis.against_load import is_against_load
from fastcal.diagnosis.doubts import is_plausible
from fastcal.diagnosis.held_out import folds
from fastcal.diagnosis.held_out_gains import brings_more, gains
from fastcal.diagnosis.hypothesis import SLOW, Hypothesis
from fastcal.diagnosis.library import is_excluded
from fastcal.diagnosis.moved_zeros import moved_zeros, own_jump
from fastcal.diagnosis.one_curve import is_one_curve
from fastcal.diagnosis.periodic import is_periodic, orders_alike, slow_waves_alike
from fastcal.diagnosis.projection import basis, score_tests
from fastcal.diagnosis.reasons import Because, BlockLabel, CauseLabel, Label, Reason
from fastcal.diagnosis.result import NamedValue
from fastcal.diagnosis.scans import at_best_load
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.diagnosis.tail_probabilities import p_values
from fastcal.diagnosis.variants import load_of_form, other_forms, with_number
from fastcal.effects.entries import effect_names
from fastcal.place import place_of

# Standard deviations by which two parameters must differ for what sets a name apart from a simpler one.
CONTRAST = 5.0
# Share of a signature from which on a block without a name holds it, and is no other shape.
SAME_SHAPE = 0.98

_SOFT = 0.5  # quantile of a joint's loads at which the search for the width of a soft flank begins


@dataclass(frozen=True)
class Evidence:
    """The evidence for one name of a set.

    Attributes:
        statistic: Chi square of leaving it out, `rank` its degrees of freedom.
        gain: Relative, of held-out rows, and its standard error.
        stability: Share of folds in which it comes first.
        rivals: Blocks without a name that would do instead.
        is_richer_needed: Does it need what sets it apart from its simpler relative?
        is_plausible: Are its sizes?
        follows_loads: Does it yield to loads, as many things that look alike do?
        alike: What does the same as an effect of its kind: waves of other orders, a joint whose zero moved.
        is_law_shown: Or does all that shows come from the sag that a compliance brings, of an arm without masses?
        noise_follows: Are successive rows' errors correlated?
    """

    statistic: float
    rank: int
    gain: tuple[float, float]
    stability: float
    rivals: tuple[Label, ...]
    is_richer_needed: bool
    is_plausible: bool
    follows_loads: bool = False
    alike: tuple[Because, ...] = ()
    is_law_shown: bool = True
    noise_follows: bool = False

    @property
    def snr(self) -> float:
        """Its signal-to-noise ratio."""
        return float(self.statistic**0.5)


def evidence(search: Search, state: SearchNode, name: Hypothesis) -> Evidence:
    """Of one name of a set."""
    place = state.fit.place(name)
    theta = state.fit.theta[place]
    inverse = _covariance(state)
    at = [state.fit.free.index(i) for i in range(place.start, place.stop)]
    own = inverse[np.ix_(at, at)]
    statistic = float(theta @ linalg.lstsq(own, theta)[0])
    gain = gains(search, state)[state.names.index(name)]
    rivals: tuple[Label, ...] = ()
    stability = 1.0
    alike = (*moved_zeros(state, name), *own_jump(state, name))
    law_shown = True
    if brings_more(state, name):
        alike += (Because(Reason.NO_MASSES),)
        law_shown = statistic > rules.GRADE_B_SNR**2  # beside what it brings
    if len(state.names) <= search.most:
        base = search.without(state, name)
        statistic = max(base.fit.remaining - state.fit.remaining, 0.0)  # Wald's stops at what is unsure of a load
        rivals, stability = _rivals(search, base, name), _stability(search, base, name)
        together = [n for n in state.names if n.owner == name.owner and is_periodic(n)]
        if name in together and is_one_curve(search, state, together):
            rivals += (BlockLabel(name.owner, (place_of(name.owner).position,)),)
        orders = orders_alike(base, name) if name.traits.is_wave else ()
        alike += (Because(Reason.ORDERS_ALIKE, orders=orders),) if orders else ()
        slow = slow_waves_alike(base, name, statistic)
        alike += (Because(Reason.SLOW_WAVE_ALIKE, orders=slow),) if slow else ()
        alike += other_forms_that_do(search, state, name)
    parameters = state.fit.model.parameters[place]
    plausible = is_plausible(parameters, theta)
    richer = _richer_needed(name, parameters, theta, own)
    loads = state.fit.effect(name).follows_loads
    follows = search.problem.noise.follows
    return Evidence(statistic, len(at), gain, stability, rivals, richer, plausible, loads, alike, law_shown, follows)


def other_forms_that_do(search: Search, state: SearchNode, name: Hypothesis) -> tuple[Because, ...]:
    """Other laws of the name's effect with which the set is about as likely, or likelier: within DECISIVE_BIC."""
    problem = state.fit.problem
    at = next(k for k, n in enumerate(state.names) if n is name)
    near, there = state, {n.cause for n in state.names}
    for simple in name.traits.generalizes:  # a law that bends begins at the straight one
        straight = next((n for n in problem.names if n.key == (simple, name.owner) and not n.variant), None)
        if straight is not None:
            near = search.state([*state.names[:at], straight, *state.names[at + 1 :]], state)
    out = []
    forms = other_forms(name.entry, problem.start.robot, problem.kept)
    for form in [*forms, *_soft_flanks(search, state, name)]:
        if form.cause in there and form.cause != name.cause:
            continue
        other = search.state([*state.names[:at], form, *state.names[at + 1 :]], near)
        is_same = (
            other.size == state.size and abs(other.fit.remaining - state.fit.remaining) < rules.CHI_SQUARE_TOLERANCE
        )
        if other.fit.converged and not other.impossible and not is_same and other.bic < state.bic + rules.DECISIVE_BIC:
            out.append(CauseLabel(form.effect, form.owner, form.variant))
    return (Because(Reason.OTHER_FORM, subjects=tuple(out)),) if out else ()


def _soft_flanks(search: Search, state: SearchNode, name: Hypothesis) -> list[Hypothesis]:
    """Gaps that the load closes softly, in place of a law that bends: at the width that explains most."""
    if name.traits.searched != "critical":
        return []
    base = search.without(state, name)
    size = float(np.quantile(np.abs(base.fit.loads[:, place_of(name.owner).index]), _SOFT))
    problem, out = state.fit.problem, []
    for effect in effect_names() if size > 0 else ():
        forms = other_forms({"effect": effect, "owner": name.owner}, problem.start.robot, problem.kept)
        one = next((form for form in forms if load_of_form(form)[1]), None)
        if one is None or is_excluded(effect, name.owner, problem.excluded):
            continue
        law, load = load_of_form(one)
        out.append(at_best_load(with_number(one.entry, load, size, law), law, load, base))
    return out


def grade(
    found: Evidence, name: Hypothesis, equivalents: Sequence[object], something_remains: bool
) -> tuple[str, tuple[Because, ...]]:
    """Grade A or B, and why not A."""
    snr, sure = found.snr, _sure_signal(found, name)
    simpler = tuple(CauseLabel(effect, name.owner) for effect in name.traits.generalizes)
    limits = [
        (something_remains, Because(Reason.SOMETHING_REMAINS)),
        (bool(equivalents), Because(Reason.EQUIVALENTS)),
        (snr < sure, Because(Reason.WEAK_SIGNAL, snr, sure)),
        (bool(found.rivals), Because(Reason.UNNAMED_RIVALS, subjects=found.rivals)),
        (not found.is_richer_needed, Because(Reason.SIMPLER_DOES, subjects=simpler)),
        (not found.is_plausible, Because(Reason.IMPLAUSIBLE)),
        (found.gain[0] < rules.GRADE_A_GAIN * found.gain[1], Because(Reason.NOT_HELD_OUT)),
        (
            found.stability < rules.GRADE_A_STABILITY,
            Because(Reason.UNSTABLE, found.stability, rules.GRADE_A_STABILITY),
        ),
        (name.traits.role == "load modifier", Because(Reason.LOAD_MODIFIER)),
        *_stand_ins(name),
    ]
    met = (*(because for is_met, because in limits if is_met), *found.alike)
    return ("B" if met else "A"), met


def may_be_another(
    found: Evidence,
    name: Hypothesis,
    beside: Sequence[tuple[Evidence, Hypothesis]],
    equivalents: Sequence[object],
    remaining: float | None,
) -> tuple[Because, ...]:
    """Why a name is no more than its place: what looks alike from afar would not have shown itself; empty: it is more.

    A name may make up for the form of a much stronger one, of what remains, or, with others that change with time or
    temperature, for a law that is none of theirs, or with noise that changes slowly as well, for more of that than one
    correlation of neighbours says, unless its signal is that of grade A. Waves have one form: none makes
    up for another's. A name behind which most parts of the data do not stand, or what yields to loads more than any
    arm, does the work of something else; what stands for an unknown weight has any law of its load; nothing deflects
    against its load. A slope over a short range may be a wave. Of many names, found by exchanging them for each other,
    those of one effect that most of them share are more.

    Args:
        found: The evidence for it.
        name: The name.
        beside: The other names of the set, and the evidence for each.
        equivalents: Names that do as well, and come first in parts of the data by chance.
        remaining: The signal-to-noise ratio of what has no name; None where nothing is left. What is weaker may be a
            part of it.
    """
    snr = found.snr
    others = [(other, its) for its, other in beside if not (name.traits.is_wave and other.traits.is_wave)]
    least, slow = rules.GRADE_B_SNR, not SLOW.isdisjoint(name.traits.depends_on)
    if (
        remaining is not None
        or any(its.snr > rules.MUCH_STRONGER * snr for _, its in others)
        or (slow and found.noise_follows)
        or (slow and any(not SLOW.isdisjoint(other.traits.depends_on) for other, _ in others))
    ):
        least = max(least, _sure_signal(found, name), remaining or 0.0)
    limits = [
        (snr < least, Because(Reason.LOOKS_LIKE_OTHERS, snr, least)),
        (
            found.stability < rules.GRADE_B_STABILITY and not equivalents,
            Because(Reason.UNSTABLE, found.stability, rules.GRADE_B_STABILITY),
        ),
        (found.follows_loads and not found.is_plausible, Because(Reason.IMPLAUSIBLE)),
        *_stand_ins(name),
        (not found.is_law_shown, Because(Reason.NO_MASSES)),
        (_is_alone_in_a_crowd(name, [other for _, other in beside]), Because(Reason.UNSURE_COMPANION)),
    ]
    alike = (because for because in found.alike if because.reason in (Reason.OWN_JUMP, Reason.SLOW_WAVE_ALIKE))
    return (*alike, *(because for is_met, because in limits if is_met))


def _stand_ins(name: Hypothesis) -> list[tuple[bool, Because]]:
    """Is a name one that stands for what has no formula here: an unknown weight, or too much compensation of a load?"""
    return [
        (name.traits.without_masses, Because(Reason.NO_MASSES)),
        (is_against_load(name), Because(Reason.AGAINST_LOAD)),
    ]


def _is_alone_in_a_crowd(name: Hypothesis, others: Sequence[Hypothesis]) -> bool:
    """Are there more than MAX_EFFECTS names, most of them of other effects than this one?"""
    alike = 1 + sum(other.effect == name.effect for other in others)
    return len(others) >= rules.MAX_EFFECTS and 2 * alike <= 1 + len(others)


def _sure_signal(found: Evidence, name: Hypothesis) -> float:
    """The signal-to-noise ratio of grade A."""
    if not SLOW.isdisjoint(name.traits.depends_on):
        return rules.GRADE_A_SNR_SLOW
    return rules.GRADE_A_SNR_LOADS if found.follows_loads else rules.GRADE_A_SNR


def doubts(left_out: bool, excess: float) -> tuple[Because, ...]:
    """What keeps every name of a set from grade A.

    Args:
        left_out: Did the user exclude names?
        excess: The noise over what is claimed.
    """
    limits = [
        (left_out, Because(Reason.NAMES_EXCLUDED)),
        (excess > rules.MAX_OVER_CLAIM, Because(Reason.NOISE_OVER_CLAIM, value=excess)),
    ]
    return tuple(because for is_met, because in limits if is_met)


def is_shadow(search: Search, state: SearchNode, found: Evidence) -> bool:
    """May a name, beside something that remains, do no more than the work of it?

    So where it is weak, or where all names of its set leave most of the misfit: a plain model, such as all joints that
    yield, may predict better than none, whatever the cause is.
    """
    return found.statistic < rules.MIN_SNR_BESIDE_REST**2 or search.explains_little(state)


def is_turned(columns: Sequence[str], values: Mapping[str, NamedValue]) -> bool:
    """Has lost motion, an effect that reads directions of approach, a negative size, which no gear has?

    Args:
        columns: That the effect reads from the data.
        values: Its parameters.
    """
    return any(c.startswith("approach") for c in columns) and any(v.value < 0 for v in values.values())


def _covariance(state: SearchNode) -> FloatArray:
    A = state.fit.whitened[0]
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0] = 1.0
    return np.asarray(np.linalg.pinv((A / scale).T @ (A / scale), rcond=1e-14, hermitian=True) / np.outer(scale, scale))


def _richer_needed(
    name: Hypothesis, parameters: Sequence[_core.Parameter], theta: FloatArray, covariance: FloatArray
) -> bool:
    if not name.traits.contrast:
        return True
    one, other = name.traits.contrast
    contrast = np.array([float(p.name == one) - float(p.name == other) for p in parameters])
    return bool((contrast @ theta) ** 2 > CONTRAST**2 * (contrast @ covariance @ contrast))


def _rivals(search: Search, base: SearchNode, name: Hypothesis) -> tuple[Label, ...]:
    """Blocks without a name that leave nothing significant and are another shape than the name."""
    blocks = base.blocks
    same = [i for i, other in enumerate(blocks.names) if other.key == name.key]
    if not same:
        return ()
    scores = blocks.tests.scores
    statistic = np.asarray(scores.statistic)
    best = max(same, key=lambda i: statistic[i])
    # Beside a block the name keeps at least the difference of their statistics: where that is significant, no rival.
    left = np.maximum(statistic[best] - statistic, 0.0)
    p = p_values(left, np.full(len(left), scores.rank[best]), base.fit.problem.noise.freedom)
    out: list[Label] = []
    for i in range(blocks.count, len(statistic)):
        if p[i] < rules.ALPHA_NAMED / search.start.family.named or not _leaves_nothing(search, base, i):
            continue
        if blocks.tests.shared([best], [i])[0, 0] < SAME_SHAPE:
            out.append(blocks.label(i))
    return tuple(out)


def _leaves_nothing(search: Search, base: SearchNode, block: int) -> bool:
    """Is nothing significant once a block is added to a set?"""
    left = base.blocks.tests.given([block])
    p = p_values(np.asarray(left.statistic), np.asarray(left.rank), base.fit.problem.noise.freedom)
    family = search.start.family
    limit = np.where(
        np.arange(len(p)) < base.blocks.count, rules.ALPHA_NAMED / family.named, rules.ALPHA_GENERIC / family.generic
    )
    return not bool((p < limit).any())


def _stability(search: Search, base: SearchNode, name: Hypothesis) -> float:
    """Share of the folds without which the name still comes first, by the score tests from the set without it."""
    blocks = base.blocks
    statistic = np.asarray(blocks.tests.scores.statistic)[: blocks.count]
    likely = [int(i) for i in np.argsort(-statistic, kind="stable")[: unexplained.MAX_CONTENDERS]]
    C = blocks.columns_of(likely)
    A, r, row = base.fit.whitened
    fold = np.where(row >= 0, folds(search.problem)[row], -1)

    def comes_first(without: int) -> bool:
        kept = fold != without
        tests = score_tests(basis(A[kept]), C[kept], r[kept], [blocks.sizes[i] for i in likely])
        worth = blocks.worth(np.asarray(tests.scores.statistic), np.asarray(tests.scores.rank), np.array(likely))
        return _is_of_one_kind(blocks.names[likely[int(np.argmax(worth))]], name)

    return sum(each(comes_first, range(rules.FOLDS))) / rules.FOLDS


def _is_of_one_kind(best: Hypothesis, name: Hypothesis) -> bool:
    """Are these the same effect, or one and a richer form of it?"""
    return best.owner == name.owner and (
        best.effect == name.effect or name.effect in best.traits.generalizes or best.effect in name.traits.generalizes
    )
