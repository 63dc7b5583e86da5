# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The verdict in one or two sentences on which a robot engineer can act."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from fastcal.diagnosis import rules
from fastcal.diagnosis.reasons import HELD_ARM, MAY_BE_ANOTHER, NOMINAL_ARM, Because, Reason, Speak
from fastcal.effects.entries import traits_of
from fastcal.said import Said, capital, chained, joined, said
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.diagnosis.plan import SeparatingPlan
    from fastcal.diagnosis.result import Diagnosis, Finding, Unexplained

# Waves that the sentence lists one by one.
MAX_WAVES_LISTED = 4
# Power of a plan below which it says that more poses are needed.
MIN_PLAN_POWER = 0.8
_OWNERS = {
    "base": said("base"),
    "tool": said("tool"),
    "payload": said("payload"),
    "instrument": said("instrument"),
    "robot": said("robot"),
    "workspace": said("workspace"),
}
_PLACES = {
    "workspace": said("in the workspace"),
    "base": said("at the base or the instrument"),
    "tool": said("at the tool"),
    "instrument": said("at the instrument"),
}
_VARIABLES = {
    "torque": said("its load"),
    "time_s": said("time"),
    "order": said("the order of measuring"),
    "temperature_c": said("temperature"),
    "payload_kg": said("the payload"),
    "reach": said("where the arm reaches"),
    "gravity": said("its orientation to gravity"),
    "weight": said("the payload and its orientation to gravity"),
    "sight": said("the side from which the instrument sees it"),
    "forward": said("the direction in which the instrument sees it"),
    "height": said("the height at which the instrument sees it"),
    "range": said("the distance from the instrument"),
}
_OF_A_JOINT = {
    "load": "the load on joint {number}",
    "move": "the last move of joint {number}",
    "approach": "the approach direction of joint {number}",
    "down": "the orientation of link {number} to gravity",
}


_REASONS = {
    Reason.GIVEN: "given",
    Reason.IMPOSSIBLE: "it would need a sign or size that is physically impossible",
    Reason.NOT_SIGNIFICANT: "not significant",
    Reason.NOT_NEEDED: "it fits equally well, or is not needed",
    Reason.LEAVES_MORE: "it leaves {subjects} unexplained (p = {value:.1e})",
    Reason.SOMETHING_REMAINS: "something else remains unexplained, and it may replace this cause",
    Reason.SHADOW: "poses are predicted better with it, but most of the misfit has another cause",
    Reason.EQUIVALENTS: "other causes explain the data equally well",
    Reason.WEAK_SIGNAL: (
        "its signal is {value:.1f} times the noise; grade A needs {limit:g} times, at which an unlisted cause that "
        "looks alike would be recognized"
    ),
    Reason.LOOKS_LIKE_OTHERS: (
        "its signal is {value:.1f} times the noise; a cause that looks alike would be recognized from {limit:g} "
        "times on"
    ),
    Reason.UNNAMED_RIVALS: "an unidentified cause would fit equally well: {subjects}",
    Reason.SIMPLER_DOES: "the data do not distinguish it from {subjects}",
    Reason.IMPLAUSIBLE: "it would have to be implausibly large",
    Reason.NOT_HELD_OUT: "held-out poses are not predicted clearly better with it",
    Reason.WORSE_ON_TEST_POSES: "the test poses are predicted worse with what was found",
    Reason.UNSTABLE: "in cross-validation it ranked first in only {value:.0%} of the folds",
    Reason.OWN_MODEL: "tested against the model that was written, the same data show a further effect",
    Reason.TURNED_DIRECTION: (
        "its size is negative, which is impossible for a gear: the sign of its approach column is probably reversed"
    ),
    Reason.AGAINST_LOAD: (
        "nothing deflects against its load: a controller that already compensates for deflection, with too soft an arm "
        "or too heavy a load, leaves this, or gravity points elsewhere than assumed"
    ),
    Reason.LOAD_MODIFIER: "it may reflect the form of a large load effect rather than a separate cause",
    Reason.UNSURE_COMPANION: "another effect in the set is uncertain, and may compensate for an error in its form",
    Reason.NAMES_EXCLUDED: (
        "causes were excluded from the search, so that not everything that could be mistaken for it was tested"
    ),
    Reason.NOISE_OVER_CLAIM: (
        "what remains is {value:.1f} times the stated noise: either that is too small, or an unidentified error remains"
    ),
    Reason.SLOW_WAVE_ALIKE: (
        "in the measured range of the joint a wave of order {orders} looks the same: measure more of its range"
    ),
    Reason.ORDERS_ALIKE: "orders {orders} look the same at these positions of the joint: measure between them",
    Reason.OWN_JUMP: "a jump of {places} at this position of its own would fit as well: check its encoder",
    Reason.ZERO_JUMPED: "a jump of the zero of {places} looks the same: check its mastering",
    Reason.ZERO_CREEPS: "a drifting zero of {places} looks the same: check its mastering",
    Reason.OTHER_FORM: "another law would fit equally well: {subjects}",
    Reason.NO_MASSES: (
        "the robot file has no masses and the data only one payload: they show where the arm deflects, but not by "
        "which law"
    ),
    Reason.PART_OF_A_PLAIN_MODEL: (
        "it is in the model because held-out poses are predicted best with it in every joint; the data do not show "
        "whether this joint has it"
    ),
    Reason.PLAIN_MODEL_PREDICTS: "it is not in the model: a plain model without it predicts held-out poses "
    "clearly better",
    Reason.MAY_BE_CHANCE: (
        "it is not in the model: noise alone makes some cause look like this in {value:.0e} of data sets, and such "
        "a cause would make other poses worse; at most {limit:.0e} is required"
    ),
    Reason.NOT_OF_OTHER_POSTURES: "it is not in the model: postures that were held out with all their payloads are not "
    "predicted clearly better with it",
    Reason.CHANGES_OTHERWISE: (
        "it is not in the model: the underlying cause may behave differently over time or temperature, and poses "
        "that are measured later may be predicted worse with it"
    ),
    Reason.CURVE_WITHOUT_NAME: "the joint's position error has a shape that no single cause explains",
}


def owner_in_words(owner: str) -> Said:
    """joint4 to "joint 4", left.joint4 to "left.joint 4", joint6<-joint5 to "joint 6 from joint 5"."""
    whole, arrow, source = owner.partition("<-")
    arm, dot, first = whole.rpartition(".")
    numbered = re.fullmatch(r"(joint|link)(\d+)", first)
    if numbered and numbered[1] == "joint":
        place = said("joint {number}", number=numbered[2])
    elif numbered:
        place = said("link {number}", number=numbered[2])
    else:
        place = _OWNERS.get(first) or joined(" ", [part.strip() for part in re.findall(r"\d+|\D+", first)])
    place = joined("", [f"{arm}.", place]) if dot else place
    return said("{joint} from {source}", joint=place, source=owner_in_words(source)) if arrow else place


def effect_in_words(effect: str) -> Said:
    """An effect by its phrase: "backlash (lost motion)"."""
    return said(traits_of(effect).phrase.replace("{", "{{").replace("}", "}}"))


def cause_in_words(effect: str, owner: str) -> Said:
    """A name in words: "joint 4: backlash (lost motion)"."""
    return joined(": ", [owner_in_words(owner), effect_in_words(effect)])


def reason_text(because: Because, speak: Speak = str) -> Said:
    """A reason as a clause without a full stop; `speak` puts hypotheses and blocks into words."""
    text = said(
        _REASONS[because.reason],
        subjects=joined(", ", dict.fromkeys(map(speak, because.subjects))),
        places=chained("{first} or {second}", dict.fromkeys(owner_in_words(of.owner) for of in because.subjects)),
        orders=_listed([f"{round(order, 1):g}" for order in because.orders]),
        value=because.value,
        limit=because.limit,
    )
    if not because.waves:
        return text
    waves = [said("{n} ({size:.2g} mrad)", n=n, size=float(from_si(a, "mrad"))) for n, a in because.waves]
    periodic = chained("{first} and {second}", waves)
    return said("{reason}; mostly periodic, cycles per turn: {waves}", reason=text, waves=periodic)


def _listed(orders: list[str]) -> str:
    """["37", "43"] to "37 and 43"; of many the first few."""
    if len(orders) > MAX_WAVES_LISTED:
        orders = [*orders[:MAX_WAVES_LISTED], said("others")]
    first = joined(", ", orders[:-1])
    return chained("{first} and {second}", [part for part in (first, *orders[-1:]) if part])


def plan_text(plan: SeparatingPlan, speak: Speak = str) -> Said:
    """What poses would tell apart, and with which probability."""
    carried = chained("{first} and {second}", [f"{p:g}" for p in sorted({float(p) for p in plan.poses.payload})])
    count = len(plan.poses)
    text = said(
        "{poses} with {carried} kg would distinguish {causes}: power {before:.0%} before, {after:.0%} with them.",
        poses=said("1 more pose") if count == 1 else said("{count} more poses", count=count),
        carried=carried,
        causes=joined(", ", map(speak, plan.causes)),
        before=plan.power_before,
        after=plan.power_after,
    )
    if plan.power_after >= MIN_PLAN_POWER:
        return text
    more = said(
        "That is not enough: a load that pulls sideways, another payload or a target on the link itself would "
        "show more."
    )
    return joined(" ", [text, more])


def noise_doubts(over_claim: float, memory: float) -> list[str]:
    """Why noise may hold what is no noise, in clauses.

    Args:
        over_claim: The noise over what is claimed of it.
        memory: Correlation of successive rows.
    """
    out: list[str] = []
    if over_claim > rules.MAX_OVER_CLAIM:
        out.append(
            said(
                "the noise is {times:.1f} times the stated value: either that is too small, or a missing effect "
                "passes for noise",
                times=float(over_claim),
            )
        )
    if memory >= rules.STRONG_MEMORY:
        out.append(
            said(
                "errors of successive rows are strongly correlated ({memory:.2f}): something that moves slowly may "
                "hide in the noise",
                memory=float(memory),
            )
        )
    return out


def sentence_of(found: Diagnosis, doubts: Sequence[str] = ()) -> Said:
    """The first sentence of the page; `doubts` are about the noise."""
    misfits = [joined("", [capital(of.text), "."]) for of in found.misfits]
    parts = (
        *misfits,
        _causes(found, doubts),
        _not_written(found.effects),
        _plain(found),
        _unexplained(found.unexplained),
        _gain(found),
    )
    return joined(" ", [part for part in parts if part])


def _causes(found: Diagnosis, doubts: Sequence[str] = ()) -> str:
    if found.few:
        return said("Too few postures to look for a cause: {why}.", why=found.few)
    if not found.effects:
        if found.unexplained:
            return said("Something is missing from the model, and no effect in the library explains it.")
        links = ("; but {doubt}", *["; and {doubt}"] * len(doubts))
        but = [said(link, doubt=doubt) for link, doubt in zip(links, doubts, strict=False)]
        kind = found.main_noise.kind
        noise = Said("{size:.3f} {unit}", size=kind.shown(found.main_noise.value), unit=kind.unit)
        if found.misfits:
            text = said("In the other readings no missing effect is detectable above the noise of {noise}", noise=noise)
        else:
            text = said("No missing effect is detectable above the noise of {noise}", noise=noise)
        return joined("", [text, *but, "."])
    waves = [f for f in found.effects if traits_of(f.effect).is_wave and f.grade != "C"]
    many = len(waves) > MAX_WAVES_LISTED
    sentences: list[str] = [_many_waves(waves)] if many else []
    told = [f for f in found.effects if not (_is_outdone(f) or _is_of_a_plain_model(f))]
    named = [f for f in told if traits_of(f.effect).role != "curve" and not (many and f in waves)]
    unproven = [f for f in named if f.grade == "B" and not f.equivalents]
    certain = [f for f in named if f.grade != "C" and not f.equivalents and f not in unproven]
    if certain:
        sentences.append(_certain(certain))
    if unproven:
        sentences.append(_unproven(unproven))
    sentences += [_doubtful(f) for f in named if f not in unproven and f not in certain]
    curves = [owner_in_words(f.owner) for f in told if traits_of(f.effect).role == "curve"]
    if curves:
        sentences.append(
            said(
                "{where}: the error depends on the joint's own position in a way that no known effect does; the "
                "model contains its curve.",
                where=capital(joined(", ", curves)),
            )
        )
    if not sentences:
        return said("Something is missing from the model, and the effects found do not account for it.")
    return joined(" ", sentences)


def _many_waves(waves: list[Finding]) -> Said:
    """The orders of each joint, the largest first."""
    orders: dict[Said, list[str]] = {}
    for f in waves:
        orders.setdefault(owner_in_words(f.owner), []).append(f"{f.parameters['order'].value:g}")
    each = [said("{owner} {orders} times per turn", owner=own, orders=", ".join(of)) for own, of in orders.items()]
    return said(
        "The joints have periodic errors, from gears or encoders; the largest first: {waves}.",
        waves=joined("; ", each),
    )


def _certain(findings: list[Finding]) -> Said:
    """Those that nothing else explains, in one sentence."""
    causes = [said("{cause}, {times:.0f} times the noise", cause=finding_in_words(f), times=f.snr) for f in findings]
    return said("{causes}; all other causes are ruled out.", causes=capital(joined("; ", causes)))


def finding_in_words(f: Finding) -> Said:
    """A finding in words, a step with its moment: what it is of may have stepped before."""
    cause = cause_in_words(f.effect, f.owner)
    if "at_s" in f.told_apart_by:
        return said("{cause}, at {time:.6g} s", cause=cause, time=f.told_apart_by["at_s"])
    if "at_row" in f.told_apart_by:
        return said("{cause}, at row {row:.0f}", cause=cause, row=f.told_apart_by["at_row"])
    if _is_against_load(f):
        return said("{cause}, against its load", cause=cause)
    return cause


def _is_against_load(f: Finding) -> bool:
    return any(limit.reason is Reason.AGAINST_LOAD for limit in f.limits)


def _doubtful(f: Finding) -> Said:
    what = capital(finding_in_words(f))
    if f.equivalents:
        others = chained("{first} or {second}", [cause_in_words(*other) for other in f.equivalents])
        return said("{cause}, or {others}: these data can't tell which.", cause=what, others=others)
    if f.grade == "C" and not f.in_model:
        return said("{cause} is possible, but no more than that.", cause=what)
    if any(limit.reason is Reason.WORSE_ON_TEST_POSES for limit in f.limits[:1]):
        return said("{cause} explains the measured poses, but the test poses are predicted worse with it.", cause=what)
    if _is_against_load(f):
        return said(
            "{cause}: a controller that compensates for more deflection than there is leaves this, or gravity points "
            "elsewhere than assumed.",
            cause=what,
        )
    if any(limit.reason in MAY_BE_ANOTHER for limit in f.limits[:1]):
        because = said("the cause may be another one")
    else:
        because = said("the cause is another one")
    text = said("{cause} is in the model because poses held out of the fit are predicted better with it", cause=what)
    return joined("", [text, "; ", because, "."])


def _unproven(found: list[Finding]) -> Said:
    """Those of grade B in one sentence, the places of one effect together."""
    if len(found) == 1:
        return said("The data are consistent with {cause}, but do not prove it.", cause=_by_effect(found))
    return said(
        "The data are consistent with the following, but prove none of them: {causes}.", causes=_by_effect(found)
    )


def _by_effect(found: list[Finding]) -> Said:
    """Causes in words, the places of one effect together: "backlash (lost motion) at joint 2, joint 5"."""
    if len(found) == 1:
        return finding_in_words(found[0])
    places: dict[Said, dict[Said, None]] = {}  # each once: a joint may have waves of several orders
    for f in found:
        places.setdefault(effect_in_words(f.effect), {})[owner_in_words(f.owner)] = None
    each = [said("{effect} at {places}", effect=effect, places=joined(", ", own)) for effect, own in places.items()]
    return joined("; ", each)


def _plain(found: Diagnosis) -> str:
    """Which model is written where it is one that anyone would try, and which names it does without."""
    if found.plain is None:
        return ""
    left = [f for f in found.effects if _is_outdone(f)]
    text = said("The model that was written is a plain one: {model}.", model=found.plain)
    return joined(" ", [text, said("It leaves out {causes}.", causes=_by_effect(left))]) if left else text


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
        if len(left) == 1:
            return said("It is not certain enough to be in the model.")
        return said("None is certain enough to be in the model.")
    return said("Not certain enough to be in the model: {causes}.", causes=_by_effect(left))


def variables_in_words(names: Iterable[str]) -> list[str]:
    """("q4", "q5", "sight_x", "sight_y", "flow") to what they are, each once; a column of the data by its name."""
    names = list(names)
    joints = [owner_in_words(f"joint{name[1:]}") for name in names if re.fullmatch(r"q\d+", name)]
    out: dict[str, None] = {}
    if joints:
        where = chained("{first} and {second}", joints)
        position = said("the positions of {joints}", joints=where)
        out[position if len(joints) > 1 else said("the position of {joint}", joint=where)] = None
    for name in names:
        word = re.sub(r"_[xyz]$", "", name)
        joint = re.fullmatch(r"([a-z]+)(\d+)", word)
        if name in ("x", "y", "z"):
            out[said("the position in space")] = None
        elif joint and joint[1] in _OF_A_JOINT:
            out[said(_OF_A_JOINT[joint[1]], number=joint[2])] = None
        elif not (joint and joint[1] == "q"):
            out[_VARIABLES.get(word) or said("the column {name}", name=name)] = None
    return list(out)


def _unexplained(remaining: Unexplained | None) -> str:
    if remaining is None:
        return ""
    parts = [
        said(
            "An unexplained error remains {place} that depends on {variables}: {share:.0%} of the original misfit.",
            place=_PLACES.get(remaining.owner) or said("at {place}", place=owner_in_words(remaining.owner)),
            variables=chained("{first} and {second}", variables_in_words(remaining.depends_on)),
            share=remaining.share,
        )
    ]
    if remaining.added is not None:
        parts.append(said("A smooth function of it is in the model; it proves no cause."))
    if remaining.formulas:
        parts.append(said("Its curve looks like: {formula}.", formula=remaining.formulas[0]))
    return joined(" ", parts)


_JUDGED = {
    "test": said("the error on the test poses"),
    "held out": said("the error on poses held out of the fit"),
    "fitted": said("the error"),
}


def _gain(found: Diagnosis) -> str:
    if len(found.gap) < 2:
        return ""
    gap = found.judged_gap
    before, after = gap.sizes[0], gap.sizes[-1]
    one = len(found.gap) == 2 and sum(f.in_model for f in found.effects) < 2  # a step may add several
    if found.gap[-1].added in (NOMINAL_ARM, HELD_ARM):
        model = said("this model")
    else:
        model = said("it in the model") if one else said("them in the model")
    return said(
        "With {model} {error} {moves} from {before:.3f} to {after:.3f} {unit} RMS; noise alone accounts for "
        "{floor:.3f} {unit}.",
        model=model,
        error=_JUDGED[gap.on],
        moves=said("rises") if gap.rises else said("falls") if after < before else said("does not fall:"),
        before=float(before),
        after=float(after),
        floor=float(gap.floor),
        unit=gap.unit,
    )
