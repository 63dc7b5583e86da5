# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks, updates, comparisons and histories in a line and in a few lines."""

from __future__ import annotations

from fastcal.measurements.kinds import POINTS, Kind, KindNoise
from fastcal.monitoring import words
from fastcal.monitoring.arms import STATES, ArmCheck, ArmChecks
from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.history import Alarm, History
from fastcal.monitoring.result import CheckResult
from fastcal.monitoring.update import UpdateResult
from fastcal.monitoring.words import kept_sentence
from fastcal.report.arms_report import arm_sentence
from fastcal.report.check_report import check_act, check_reasons, check_sentence
from fastcal.report.formatting import plural, sized
from fastcal.report.language import _ as translated
from fastcal.report.language import decimal_sign, language
from fastcal.report.summaries import headline, summary
from fastcal.report.tables import in_words
from fastcal.said import said

_STATES = {
    "changed": said("changed"),
    "alarm": said("alarm"),
    "cannot_tell": said("cannot tell"),
    "unchecked": said("unchecked"),
    "holds": said("holds"),
}


@headline.register
def _(found: CheckResult) -> str:
    return (
        f"{found.model.name}, {found.verdict.replace('_', ' ')}, RMS {found.main.kind.text(found.rms)} of "
        f"{len(found.data)} poses"
    )


@summary.register
def _(found: CheckResult) -> list[str]:
    sentence, reasons, act = _told(found)
    lines = [f"{found.model.name}: {sentence}", *reasons, *filter(None, [act])]
    if found.blind:
        names = ", ".join(words.spoken(label, translated) for label in found.blind)
        lines.append(translated("not visible in any pose once the instrument is set up again: {names}", names=names))
    if found.next_poses:
        units = ", ".join(dict.fromkeys("deg" if kind == "revolute" else "mm" for kind in found.model.joint_types))
        poses = len(found.next_poses)
        lines.append(translated("next poses to measure: {count}; payload and joint positions:", count=poses))
        lines += [
            f"  {pose.payload_kg:g} kg, {' '.join(f'{value:.1f}' for value in found.shown(pose).values())} {units}"
            for pose in found.next_poses
        ]
    return lines


def _told(found: CheckResult) -> tuple[str, list[str], str]:
    """The verdict, the evidence and what to do: in English as files have them, else in the language of the page."""
    if language.get() == "en":
        return found.sentence, list(found.reasons), found.next_act
    return check_sentence(found), check_reasons(found), check_act(found)


def _of_arm(arm: ArmCheck) -> str:
    return arm.sentence if language.get() == "en" else arm_sentence(arm)


@headline.register
def _(found: ArmChecks) -> str:
    counts = {state: len(found.of(state)) for state in STATES}
    states = ", ".join(f"{n} {translated(_STATES[s])}" for s, n in counts.items() if n)
    return f"{plural(len(found.arms), 'arm')}: {states}"


@summary.register
def _(found: ArmChecks) -> list[str]:
    asking = [arm for arm in found.arms if arm.state != "holds"]
    return [
        headline(found),
        *(f"{arm.name}: {translated(_STATES[arm.state])}: {_of_arm(arm)}" for arm in asking),
    ]


@headline.register
def _(found: UpdateResult) -> str:
    unsettled = "" if found.status == "converged" else ", not converged"
    return f"{found.model.name}, updated from {len(found.before.data)} poses{unsettled}"


@summary.register
def _(found: UpdateResult) -> list[str]:
    poses = plural(len(found.before.data), "pose")
    done = (
        translated("up to date from {poses}", poses=poses)
        if found.status == "converged"
        else translated("not converged on {poses}", poses=poses)
    )
    lines = [f"{found.model.name}: {done}", translated("before: {sentence}", sentence=_told(found.before)[0])]
    for kind, before, after in found.errors:
        lines.append(
            translated(
                "error on these poses{what}: RMS {before} before, {after} after",
                what=_of(kind),
                before=sized(kind, before),
                after=sized(kind, after),
            )
        )
    return [*lines, *map(_pooled, found.noise.values())]


def _pooled(noise: KindNoise) -> str:
    what = translated("a measured coordinate" if noise.kind.name == POINTS else noise.kind.plural)
    size = sized(noise.kind, noise.value)
    return translated("noise of {what}: {size}, pooled with the calibration's", what=what, size=size)


def _of(kind: Kind) -> str:
    return "" if kind.name == POINTS else f", {translated(kind.plural)}"


@headline.register
def _(found: Comparison) -> str:
    sizes = found.at_tool.to_mm()
    return translated(
        "{arm}, {count} parameters differ, {size:.4f} mm at the tool on average",
        arm=found.first.name,
        count=len(found.significant),
        size=sizes["mean"],
    )


@summary.register
def _(found: Comparison) -> list[str]:
    sizes = found.at_tool.to_mm()
    lines = [
        translated(
            "{arm}: at the tool mean {mean:.4f} mm, RMS {rms:.4f} mm, largest {most:.4f} mm over the joint range of "
            "both, bases and tools aligned",
            arm=found.first.name,
            mean=sizes["mean"],
            rms=sizes["rms"],
            most=sizes["max"],
        ),
        translated(
            "parameters that differ beyond noise: {count} of {all}",
            count=len(found.significant),
            all=len(found.parameters),
        ),
    ]
    differing = (f"  {d.owner} {d.name}: {d.difference:+.4g} +- {d.std:.2g}" for d in found.significant)
    return lines + [text.replace(".", decimal_sign()) for text in differing]


@headline.register
def _(found: History) -> str:
    files, alarms = sum(len(a.events) for a in found.arms), len(found.alarms)
    return ", ".join([plural(len(found.arms), "arm"), plural(files, "file"), plural(alarms, "alarm")])


@summary.register
def _(found: History) -> list[str]:
    lines = [headline(found)]
    for arm in found.arms:
        checks = sum(e.kind == "check" for e in arm.events)
        state = translated(_STATES[arm.state])
        lines.append(f"{arm.name} ({arm.robot}): {state}, {plural(checks, 'check')}")
        lines += [f"  {a.date} {_alarm(a)}" for a in arm.alarms]
    return lines


def _alarm(alarm: Alarm) -> str:
    """What alarmed, and at what."""
    if language.get() == "en":
        return f"{alarm.by}: {alarm.what}"
    if alarm.event is not None:
        return kept_sentence(alarm.event.content, translated)
    return f"{alarm.by.upper()}: {translated('misfit') if alarm.by == 'ewma' else in_words(alarm.what)}"
