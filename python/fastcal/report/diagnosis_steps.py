# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What to do after a diagnosis: use the model, repair, measure again, or look somewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastcal.diagnosis.words import cause_in_words
from fastcal.effects.entries import traits_of
from fastcal.report.diagnosis_words import depends, drop_command, place, stands_for_geometry, step_name
from fastcal.report.formatting import percent
from fastcal.report.next_step import look_at
from fastcal.report.words import listed

if TYPE_CHECKING:
    from fastcal.diagnosis.plan import SeparatingPlan
    from fastcal.diagnosis.result import Diagnosis, Finding, Unexplained

WORTH_MEASURING = 0.5  # power from which a plan is advice: below, the test would more likely fail than not
_SMALL = 0.01  # share of the misfit below which what remains is not worth a search
_SOUND = "Do not trust predictions outside the postures, loads and conditions that were measured."


def next_steps(found: Diagnosis) -> list[str]:
    """What to do now, a sentence each."""
    look = [f"{look_at(misfit)}; then diagnose again." for misfit in found.misfits]
    if found.verdict == "none":
        return [
            *look,
            f"Nothing has to be added: model.yaml is {_arm(found) or 'the calibrated geometry'}.",
            "If the robot is less accurate at other work, see below what these data could not show, and measure that.",
        ]
    if found.verdict == "one_of":
        return [*look, *_one_of(found)]
    if found.verdict == "unexplained":
        return [*look, *_unexplained(found)]
    return [*look, *_measurement(found.effects), *_robot(found.effects), *_unsure(found.effects)]


def is_advice(plan: SeparatingPlan | None) -> bool:
    """Is a plan worth its poses: would it more likely than not settle the question?"""
    return plan is not None and plan.power_after >= WORTH_MEASURING


def _one_of(found: Diagnosis) -> list[str]:
    """Names that fit alike: what would tell them apart, and what can be done until then."""
    causes = [pair for f in found.effects for pair in ((f.effect, f.owner), *f.equivalents)]
    if found.plan is None:
        more = "Measure poses that tell them apart (fastcal design --separate chooses them)"
    elif is_advice(found.plan):
        more = "Measure the poses that tell them apart (see below)"
    else:
        more = (
            "More poses of the same kind would hardly tell them apart (probability "
            f"{percent(found.plan.power_after)} with {len(found.plan.poses)} more): measure with a load that pulls "
            "sideways, another payload or a target on the link itself"
        )
    names = listed([cause_in_words(*cause) for cause in causes])
    return [
        f"Do not repair anything yet: {names} fit these data equally well.",
        f"{more}, and run the diagnosis on both files together.",
        "Until then model.yaml predicts equally well whichever it is, within the postures and loads measured."
        if all(f.in_model for f in found.effects)
        else f"Until then model.yaml is {_arm(found) or 'the geometry alone'}: these data are too few to be sure of "
        "any of them.",
    ]


def _arm(found: Diagnosis) -> str:
    """What model.yaml is where it is a plain model in place of the calibrated geometry; else empty."""
    last = found.gap[-1].added
    return f"{step_name(last)}, which predicts other poses better" if stands_for_geometry(last) else ""


def _unexplained(found: Diagnosis) -> list[str]:
    remaining = found.unexplained
    steps = (
        [f"Look {_look(remaining)}."]
        if remaining and remaining.share >= _SMALL
        else ["The unexplained part is next to nothing."]
    )
    if any(f.in_model for f in found.effects):
        steps.append("model.yaml holds what was found: it is better than geometry alone, and not the whole story.")
    else:
        arm = _arm(found) or "the geometry alone"
        steps.append(f"model.yaml is {arm}: no cause explains enough to be trusted in a model.")
    return [*steps, _SOUND]


def _measurement(effects: list[Finding]) -> list[str]:
    """Causes that are no fault of the robot: what to do before the next measurement."""
    names = [cause_in_words(f.effect, f.owner) for f in effects if traits_of(f.effect).of_the_measurement]
    if not names:
        return []
    alone = len(names) == len(effects) and all(f.in_model for f in effects)
    return [
        f"Not the robot but the measurement: {listed(names)}. Find out what moved or is off, secure it, and measure "
        "again.",
        *(
            [
                "There is nothing to compensate: the geometry in model.yaml was identified with this error taken out, "
                "and robot programs are compensated without it."
            ]
            if alone
            else []
        ),
    ]


def _robot(effects: list[Finding]) -> list[str]:
    """Causes in the robot that are in the model."""
    own = [f for f in effects if f.in_model and not traits_of(f.effect).of_the_measurement]
    if not own:
        return []
    what = "the effect" if len(own) == 1 else f"the {len(own)} effects"
    return [
        f"Compensate with model.yaml: it holds the geometry and {what}, identified together.",
        f"To undo {'it' if len(own) == 1 else 'one'}: {drop_command(own[0])}",
    ]


def _unsure(effects: list[Finding]) -> list[str]:
    unsure = [cause_in_words(f.effect, f.owner) for f in effects if f.grade != "A"]
    left = [cause_in_words(f.effect, f.owner) for f in effects if not f.in_model]
    more = [f"Measure more poses to be sure, model.yaml leaves out {listed(left)}."] if left else []
    return [*more, f"Check by hand before repairing: {listed(unsure)}."] if unsure else []


def _look(remaining: Unexplained) -> str:
    on = depends(remaining.depends_on)
    if remaining.owner.startswith("joint"):
        return f"at {place(remaining.owner)} (gear, cables and hoses, brake, encoder): its error follows {on}"
    if remaining.owner == "workspace":
        return (
            "at the instrument and its surroundings first (refraction, line of sight, scale, target), then at cables "
            "and hoses that pull in some postures: the error is a smooth function of the position"
        )
    what = {"base": "the foundation and the instrument's stand", "tool": "the tool and the target's seat"}
    when = "; with a column time_s a step or a drift can be named and added" if "order" in remaining.depends_on else ""
    return f"at {what.get(remaining.owner, place(remaining.owner))}: it moves with {on}{when}"
