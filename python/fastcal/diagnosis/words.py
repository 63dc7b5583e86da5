# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The verdict in a sentence or two that a person who knows robots can act on."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import HELD_ARM, MAY_BE_ANOTHER, NOMINAL_ARM, Because, Reason, Speak
from fastcal.effects.entries import traits_of
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.diagnosis.plan import SeparatingPlan
    from fastcal.diagnosis.result import Diagnosis, Finding, Unexplained

_PLACES = {
    "workspace": "in the workspace",
    "base": "at the base or the instrument",
    "tool": "at the tool",
    "instrument": "at the instrument",
}
_VARIABLES = {
    "torque": "its load",
    "time_s": "time",
    "order": "the order of measuring",
    "temperature_c": "temperature",
    "payload_kg": "the payload",
    "reach": "where the arm reaches",
    "gravity": "how it is held against gravity",
    "weight": "the payload and how it is held against gravity",
    "sight": "the side from which it is looked at",
    "forward": "the direction in which it is looked at",
    "height": "the height at which it is looked at",
    "range": "the distance from the instrument",
}
_OF_A_JOINT = {
    "load": "the load on joint {}",
    "move": "the last move of joint {}",
    "approach": "the direction from which joint {} came",
    "down": "how link {} is held against gravity",
}


_REASONS = {
    Reason.GIVEN: "given",
    Reason.IMPOSSIBLE: "it would need a sign or size that is physically impossible",
    Reason.NOT_SIGNIFICANT: "not significant",
    Reason.NOT_NEEDED: "it fits equally well, or is not needed",
    Reason.LEAVES_MORE: "it leaves {subjects} at p = {value:.1e}",
    Reason.SOMETHING_REMAINS: "something else remains unexplained, and it may take this one's place",
    Reason.SHADOW: "poses are predicted better with it, and most of the misfit has another cause",
    Reason.EQUIVALENTS: "other causes explain the data as well",
    Reason.WEAK_SIGNAL: "its signal is {value:.1f} times the noise; grade A needs {limit:g} times, which an unlisted "
    "cause that looks alike would not survive",
    Reason.LOOKS_LIKE_OTHERS: "its signal is {value:.1f} times the noise; a cause that looks alike would show itself "
    "from {limit:g} times on",
    Reason.UNNAMED_RIVALS: "an unnamed cause would do as well: {subjects}",
    Reason.SIMPLER_DOES: "the data do not show what sets it apart from {subjects}",
    Reason.IMPLAUSIBLE: "it would have to be implausibly large",
    Reason.NOT_HELD_OUT: "held-out poses are not predicted clearly better with it",
    Reason.UNSTABLE: "in cross-validation it ranked first in only {value:.0%} of the folds",
    Reason.OWN_MODEL: "asked about the model that was written, the same data show something more",
    Reason.TURNED_DIRECTION: "its size is negative, which no gear has: its approach column probably has the other sign",
    Reason.LOAD_MODIFIER: "it may be the form of a large effect of loads rather than a cause of its own",
    Reason.UNSURE_COMPANION: "another effect of the set is not sure, and may make up for its form",
    Reason.NAMES_EXCLUDED: "names were excluded, so that not everything that could be mistaken for it was tried",
    Reason.NOISE_OVER_CLAIM: "what remains is {value:.1f} times the claimed noise: the claim is too small, or "
    "something remains that has no name",
    Reason.ORDERS_ALIKE: "orders {orders} look the same at these positions of the joint: measure between them",
    Reason.ZERO_JUMPED: "a jump of the zero of {places} does the same: check its mastering",
    Reason.ZERO_CREEPS: "a creeping zero of {places} does the same: check its mastering",
    Reason.OTHER_FORM: "another law would do as well: {subjects}",
    Reason.PART_OF_A_PLAIN_MODEL: "it is in the model because poses that were held out are predicted best with it in "
    "every joint; whether this joint has it is not shown",
    Reason.PLAIN_MODEL_PREDICTS: "it is not in the model: a plain model without it predicts held-out poses "
    "clearly better",
    Reason.MAY_BE_CHANCE: "it is not in the model: noise alone makes some cause look like this in {value:.0e} of data "
    "sets, and such a cause would make other poses worse; {limit:.0e} at most is needed",
    Reason.NOT_OF_OTHER_POSTURES: "it is not in the model: postures that were held out with all their payloads are not "
    "predicted clearly better with it",
    Reason.CHANGES_OTHERWISE: "it is not in the model: what it stands for may change with time or temperature in "
    "another way, and poses that are measured later may be predicted worse with it",
    Reason.CURVE_WITHOUT_NAME: "the joint's position error has a shape that no single cause explains",
}


def owner_in_words(owner: str) -> str:
    """joint4 to "joint 4", joint6<-joint5 to "joint 6 from joint 5"."""
    first, arrow, source = owner.partition("<-")
    spaced = "".join(
        f" {c}" if c.isdigit() and not before.isdigit() else c for before, c in zip(" " + first, first, strict=False)
    )
    return f"{spaced.strip()} from {owner_in_words(source)}" if arrow else spaced.strip()


def cause_in_words(effect: str, owner: str) -> str:
    """A name in words: "joint 4: backlash (lost motion)"."""
    return f"{owner_in_words(owner)}: {traits_of(effect).phrase}"


def reason_text(because: Because, speak: Speak = str) -> str:
    """A reason as a clause without a full stop; `speak` puts hypotheses and blocks into words."""
    subjects = ", ".join(dict.fromkeys(map(speak, because.subjects)))
    places = " or ".join(dict.fromkeys(owner_in_words(subject.owner) for subject in because.subjects))
    orders = _listed([f"{round(order, 1):g}" for order in because.orders])
    text = _REASONS[because.reason].format(
        subjects=subjects, places=places, orders=orders, value=because.value, limit=because.limit
    )
    waves = " and ".join(f"{n} ({from_si(a, 'mrad'):.2g} mrad)" for n, a in because.waves)
    return f"{text}; mostly periodic, cycles a turn: {waves}" if waves else text


def _listed(orders: list[str]) -> str:
    """["37", "43"] to "37 and 43"; of many the first few."""
    if len(orders) > rules.MAX_WAVES_LISTED:
        orders = [*orders[: rules.MAX_WAVES_LISTED], "others"]
    return " and ".join(part for part in (", ".join(orders[:-1]), *orders[-1:]) if part)


def plan_text(plan: SeparatingPlan, speak: Speak = str) -> str:
    """What poses would tell apart, and with which probability."""
    carried = " and ".join(f"{p:g}" for p in sorted({float(p) for p in plan.poses.payload}))
    poses = "1 more pose" if len(plan.poses) == 1 else f"{len(plan.poses)} more poses"
    text = (
        f"{poses} with {carried} kg would distinguish {', '.join(map(speak, plan.causes))}: "
        f"power {plan.power_before:.0%} before, {plan.power_after:.0%} with them."
    )
    if plan.power_after >= rules.MIN_PLAN_POWER:
        return text
    return (
        f"{text} That is not enough: a load that pulls sideways, another payload or a target on the link itself would "
        "show more."
    )


def noise_doubts(over_claim: float, memory: float) -> list[str]:
    """Why noise may hold what is no noise, in clauses.

    Args:
        over_claim: The noise over what is claimed of it.
        memory: Correlation of successive rows.
    """
    out = []
    if over_claim > rules.MAX_OVER_CLAIM:
        size = f"the noise is {over_claim:.1f} times what is claimed"
        out.append(f"{size}: the claim is too small, or something is missing that passes for noise")
    if memory >= rules.STRONG_MEMORY:
        alike = f"errors of successive rows are strongly correlated ({memory:.2f})"
        out.append(f"{alike}: something that moves slowly may hide in the noise")
    return out


def sentence_of(found: Diagnosis, doubts: Sequence[str] = ()) -> str:
    """The first sentence of the page; `doubts` are about the noise."""
    misfits = [f"{of.text[0].upper()}{of.text[1:]}." for of in found.misfits]
    parts = (
        *misfits,
        _causes(found, doubts),
        _not_written(found.effects),
        _plain(found),
        _unexplained(found.unexplained),
        _gain(found),
    )
    return " ".join(part for part in parts if part)


def _causes(found: Diagnosis, doubts: Sequence[str] = ()) -> str:
    if not found.effects:
        if found.unexplained:
            return "Something is missing in the model, and no effect of the library explains it."
        but = "".join(f"; but {doubt}" if k == 0 else f"; and {doubt}" for k, doubt in enumerate(doubts))
        noise = found.main_noise.kind.text(found.main_noise.value, 3)
        if found.misfits:
            return f"The other readings show no missing effect above their noise of {noise}{but}."
        return f"Nothing is missing that these data could show above their noise of {noise}{but}."
    waves = [f for f in found.effects if traits_of(f.effect).is_wave and f.grade != "C"]
    many = len(waves) > rules.MAX_WAVES_LISTED
    sentences = [_many_waves(waves)] if many else []
    told = [f for f in found.effects if not (_is_outdone(f) or _is_of_a_plain_model(f))]
    named = [f for f in told if traits_of(f.effect).role != "curve" and not (many and f in waves)]
    unproven = [f for f in named if f.grade == "B" and not f.equivalents]
    sentences += [_cause(f) for f in named if f not in unproven]
    if unproven:
        sentences.append(_unproven(unproven))
    curves = [owner_in_words(f.owner) for f in told if traits_of(f.effect).role == "curve"]
    if curves:
        first, *others = curves
        where = ", ".join([first[0].upper() + first[1:], *others])
        sentences.append(
            f"{where}: the error depends on the joint's own position as no known effect does; the model has its curve."
        )
    return " ".join(sentences) or "Something is missing in the model, and no effect that was found makes up for it."


def _many_waves(waves: list[Finding]) -> str:
    """The orders of each joint, the largest first."""
    orders: dict[str, list[str]] = {}
    for f in waves:
        orders.setdefault(owner_in_words(f.owner), []).append(f"{f.parameters['order'].value:g}")
    listed = "; ".join(f"{owner} {', '.join(which)} times a turn" for owner, which in orders.items())
    return f"The joints err periodically, by gears or encoders, the largest waves first: {listed}."


def _cause(f: Finding) -> str:
    what = cause_in_words(f.effect, f.owner)
    capital = what[0].upper() + what[1:]
    if f.equivalents:
        others = " or ".join(cause_in_words(*other) for other in f.equivalents)
        return f"{capital}, or {others}: these data can't tell which."
    if f.grade == "C" and not f.in_model:
        return f"{capital}, is possible, and no more."
    if f.grade == "C":
        may_be = any(limit.reason in MAY_BE_ANOTHER for limit in f.limits[:1])
        because = "the cause may be another one" if may_be else "the cause is another one"
        return f"{capital}, is in the model because poses are predicted better with it; {because}."
    return f"{capital}, {f.snr:.0f} times the noise; all other causes are ruled out."


def _unproven(found: list[Finding]) -> str:
    """Those of grade B in one sentence, the places of one effect together."""
    if len(found) == 1:
        return f"The data are consistent with {cause_in_words(found[0].effect, found[0].owner)}, but do not prove it."
    return f"The data are consistent with the following, but prove none of them: {_by_effect(found)}."


def _by_effect(found: list[Finding]) -> str:
    """Causes in words, the places of one effect together: "backlash (lost motion) at joint 2, joint 5"."""
    if len(found) == 1:
        return cause_in_words(found[0].effect, found[0].owner)
    places: dict[str, dict[str, None]] = {}  # each once: a joint may have waves of several orders
    for f in found:
        places.setdefault(traits_of(f.effect).phrase, {})[owner_in_words(f.owner)] = None
    return "; ".join(f"{phrase} at {', '.join(owners)}" for phrase, owners in places.items())


def _plain(found: Diagnosis) -> str:
    """Which model is written where it is one that anyone would try, and which names it does without."""
    if found.plain is None:
        return ""
    left = [f for f in found.effects if _is_outdone(f)]
    without = f" It does without {_by_effect(left)}." if left else ""
    return f"The model that is written is a plain one: {found.plain}.{without}"


def _is_of_a_plain_model(finding: Finding) -> bool:
    """Is it in the model as a part of a plain one, and not by itself?"""
    return any(because.reason is Reason.PART_OF_A_PLAIN_MODEL for because in finding.limits)


def _is_outdone(finding: Finding) -> bool:
    """Is it left out of the model for a plain one without it?"""
    return any(because.reason is Reason.PLAIN_MODEL_PREDICTS for because in finding.limits)


def _not_written(effects: list[Finding]) -> str:
    """What was found and is not sure enough to be in the model."""
    left = [f for f in effects if not f.in_model and not _is_outdone(f)]
    if not left:
        return ""
    if len(left) == len(effects):
        return (
            "It is not sure enough to be in the model." if len(left) == 1 else "None is sure enough to be in the model."
        )
    return f"Not sure enough to be in the model: {_by_effect(left)}."


def variables_in_words(names: Iterable[str]) -> list[str]:
    """("q4", "q5", "sight_x", "sight_y", "flow") to what they are, each once; a column of the data by its name."""
    names = list(names)
    joints = [f"joint {name[1:]}" for name in names if re.fullmatch(r"q\d+", name)]
    out = dict.fromkeys([f"the position{'s' if len(joints) > 1 else ''} of {' and '.join(joints)}"] if joints else [])
    for name in names:
        word = re.sub(r"_[xyz]$", "", name)
        joint = re.fullmatch(r"([a-z]+)(\d+)", word)
        if name in ("x", "y", "z"):
            out["the place in the workspace"] = None
        elif joint and joint[1] in _OF_A_JOINT:
            out[_OF_A_JOINT[joint[1]].format(joint[2])] = None
        elif not (joint and joint[1] == "q"):
            out[_VARIABLES.get(word, f"the column {name}")] = None
    return list(out)


def _unexplained(remaining: Unexplained | None) -> str:
    if remaining is None:
        return ""
    place = _PLACES.get(remaining.owner, f"at {owner_in_words(remaining.owner)}")
    on = " and ".join(variables_in_words(remaining.depends_on))
    text = f"Something remains {place} that depends on {on}, {remaining.share:.0%} of the misfit that there was."
    if remaining.added is not None:
        text += " A smooth function of it is in the model; it proves no cause."
    if remaining.formulas:
        text += f" Its curve looks like: {remaining.formulas[0]}."
    return text


_JUDGED = {"test": " on the test poses", "held out": " on poses held out of the fit", "fitted": ""}


def _gain(found: Diagnosis) -> str:
    if len(found.gap) < 2:
        return ""
    gap = found.judged_gap
    before, after = gap.sizes[0], gap.sizes[-1]
    of_the_arm = found.gap[-1].added in (NOMINAL_ARM, HELD_ARM)
    one = len(found.gap) == 2 and sum(f.in_model for f in found.effects) < 2  # a step may add several
    them = "this model" if of_the_arm else f"{'it' if one else 'them'} in the model"
    moves = "rises" if gap.rises else "falls" if after < before else "does not fall:"
    return (
        f"With {them} the error{_JUDGED[gap.on]} {moves} from {before:.3f} to {after:.3f} {gap.unit} RMS; "
        f"noise alone makes {gap.floor:.3f} {gap.unit}."
    )
