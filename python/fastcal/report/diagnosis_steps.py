# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What to do after a diagnosis: use the model, repair, measure again, or look somewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastcal.diagnosis.words import cause_in_words, finding_in_words
from fastcal.effects.entries import traits_of
from fastcal.report.diagnosis_words import depends, drop_command, place, stands_for_geometry, step_name
from fastcal.report.formatting import percent
from fastcal.report.language import _
from fastcal.report.next_step import look_at
from fastcal.report.words import listed

if TYPE_CHECKING:
    from fastcal.diagnosis.plan import SeparatingPlan
    from fastcal.diagnosis.result import Diagnosis, Finding, Unexplained

WORTH_MEASURING = 0.5  # power from which a plan is advice: below, the test would more likely fail than not
_SMALL = 0.01  # share of the misfit below which what remains is not worth a search


def next_steps(found: Diagnosis) -> list[str]:
    """What to do now, a sentence each."""
    misfits = [_("{advice}; then diagnose again.", advice=look_at(misfit)) for misfit in found.misfits]
    if found.few:
        return [*misfits, _("Measure more postures (`fastcal design` plans them), then diagnose again.")]
    if found.verdict == "none":
        return [
            *misfits,
            _("Nothing has to be added: model.yaml is {what}.", what=_arm(found) or _("the calibrated geometry")),
            _(
                "If the robot is less accurate in other work, see below which effects these data could not have "
                "detected, and measure poses that show them."
            ),
        ]
    if found.status == "predicts_worse":
        return [
            *misfits,
            _(
                "Do not compensate with model.yaml: other poses are predicted worse with it than by the geometry "
                "alone. Measure poses in the whole range that the robot works in, and diagnose them together with "
                "these."
            ),
            *_unsure(found.effects),
        ]
    if found.verdict == "one_of":
        return [*misfits, *_one_of(found)]
    if found.verdict == "unexplained":
        return [*misfits, *_unexplained(found)]
    return [*misfits, *acts(found.effects)]


def acts(effects: list[Finding], *, undo: bool = True) -> list[str]:
    """What to do where causes were named; `undo`: with the command that takes one out of the model again."""
    return [*_measurement(effects), *_robot(effects, undo=undo), *_unsure(effects)]


def is_advice(plan: SeparatingPlan | None) -> bool:
    """Is a plan worth its poses: would it more likely than not settle the question?"""
    return plan is not None and plan.power_after >= WORTH_MEASURING


def _one_of(found: Diagnosis) -> list[str]:
    """Names that fit alike: what would tell them apart, and what can be done until then."""
    causes = [pair for f in found.effects for pair in ((f.effect, f.owner), *f.equivalents)]
    if found.plan is None:
        more = _("Measure poses that tell them apart (fastcal design --separate chooses them)")
    elif is_advice(found.plan):
        more = _("Measure the poses that tell them apart (see below)")
    else:
        more = _(
            "More poses of the same kind would hardly tell them apart (probability {power} with {count} more): measure "
            "with a load that pulls sideways, another payload or a target on the link itself",
            power=percent(found.plan.power_after),
            count=len(found.plan.poses),
        )
    names = listed([_(cause_in_words(*cause)) for cause in causes])
    return [
        _("Do not repair anything yet: {causes} fit these data equally well.", causes=names),
        _("{advice}, and run the diagnosis on both files together.", advice=more),
        _("Until then model.yaml predicts equally well whichever it is, within the postures and loads measured.")
        if all(f.in_model for f in found.effects)
        else _(
            "Until then model.yaml is {what}: these data are too few to be sure of any of them.",
            what=_arm(found) or _("the geometry alone"),
        ),
    ]


def _arm(found: Diagnosis) -> str:
    """What model.yaml is where it is a plain model in place of the calibrated geometry; else empty."""
    last = found.gap[-1].added
    return _("{model}, which predicts other poses better", model=step_name(last)) if stands_for_geometry(last) else ""


def _unexplained(found: Diagnosis) -> list[str]:
    remaining = found.unexplained
    steps = [look(remaining)] if remaining and remaining.share >= _SMALL else [_("The unexplained part is negligible.")]
    if any(f.in_model for f in found.effects):
        steps.append(
            _("model.yaml holds the effects found: it is better than geometry alone, but not the whole story.")
        )
    elif remaining is not None and remaining.added is not None:
        steps.append(
            _(
                "model.yaml holds the geometry and a smooth function of the remaining error: it predicts better, "
                "but identifies no cause."
            )
        )
    else:
        arm = _arm(found) or _("the geometry alone")
        steps.append(_("model.yaml is {what}: no cause explains enough to be trusted in a model.", what=arm))
    return [*steps, _("Do not trust predictions outside the postures, loads and conditions that were measured.")]


def _measurement(effects: list[Finding]) -> list[str]:
    """Causes that are no fault of the robot: what to do before the next measurement."""
    names = [_(finding_in_words(f)) for f in effects if traits_of(f.effect).of_the_measurement]
    if not names:
        return []
    alone = len(names) == len(effects) and all(f.in_model for f in effects)
    return [
        _(
            "Not the robot but the measurement: {causes}. Find out what moved or is off, secure it, and measure again.",
            causes=listed(names),
        ),
        *(
            [
                _(
                    "There is nothing to compensate: the geometry in model.yaml was identified with this error taken "
                    "out, and robot programs are compensated without it."
                )
            ]
            if alone
            else []
        ),
    ]


def _robot(effects: list[Finding], *, undo: bool) -> list[str]:
    """Causes in the robot that are in the model."""
    own = [f for f in effects if f.in_model and not traits_of(f.effect).of_the_measurement]
    if not own:
        return []
    what = _("the effect") if len(own) == 1 else _("the {count} effects", count=len(own))
    use = _("Compensate with model.yaml: it holds the geometry and {what}, identified together.", what=what)
    if not undo:
        return [use]
    command = drop_command(own[0])
    drop = (
        _("To undo it: {command}", command=command) if len(own) == 1 else _("To undo one: {command}", command=command)
    )
    return [use, drop]


def _unsure(effects: list[Finding]) -> list[str]:
    unsure = [_(finding_in_words(f)) for f in effects if f.grade != "A"]
    left = [_(finding_in_words(f)) for f in effects if not f.in_model]
    more = [_("Measure more poses to be certain; model.yaml leaves out {causes}.", causes=listed(left))] if left else []
    return [*more, _("Check by hand before repairing: {causes}.", causes=listed(unsure))] if unsure else []


def look(remaining: Unexplained) -> str:
    """Where to look for what remains."""
    on = depends(remaining.depends_on)
    if remaining.owner.startswith("joint"):
        return _(
            "Check {joint} (gear, cables and hoses, brake, encoder): its error depends on {variables}.",
            joint=place(remaining.owner),
            variables=on,
        )
    if remaining.owner == "workspace":
        return _(
            "Check the instrument and its surroundings first (refraction, line of sight, scale, target), then "
            "cables and hoses that pull in some postures: the error is a smooth function of the position."
        )
    what = {"base": _("the foundation and the instrument's stand"), "tool": _("the tool and the target's seat")}
    text = _(
        "Check {place}: it moves with {variables}",
        place=what.get(remaining.owner, place(remaining.owner)),
        variables=on,
    )
    if "order" in remaining.depends_on:
        text += _("; with a column time_s a step or a drift can be named and added")
    return f"{text}."
