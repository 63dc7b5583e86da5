# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks, updates, comparisons and histories in a line and in a few lines."""

from __future__ import annotations

from fastcal.measurements.kinds import POINTS, Kind
from fastcal.monitoring.arms import STATES, ArmChecks
from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.history import History
from fastcal.monitoring.result import CheckResult
from fastcal.monitoring.update import UpdateResult
from fastcal.report.summaries import headline, summary


@headline.register
def _(found: CheckResult) -> str:
    return (
        f"{found.model.name}, {found.verdict.replace('_', ' ')}, RMS {found.main.kind.text(found.rms)} of "
        f"{len(found.data)} poses"
    )


@summary.register
def _(found: CheckResult) -> list[str]:
    lines = [f"{found.model.name}: {found.sentence}", *found.reasons, *filter(None, [found.next_act])]
    if found.blind:
        lines.append(f"not visible in any pose once the instrument is set up again: {', '.join(found.blind)}")
    if found.next_poses:
        units = ", ".join(dict.fromkeys("deg" if kind == "revolute" else "mm" for kind in found.model.joint_types))
        lines.append(f"next poses to measure: {len(found.next_poses)}; payload and joint positions:")
        lines += [
            f"  {pose.payload_kg:g} kg, {' '.join(f'{value:.1f}' for value in found.shown(pose).values())} {units}"
            for pose in found.next_poses
        ]
    return lines


@headline.register
def _(found: ArmChecks) -> str:
    counts = {state: len(found.of(state)) for state in STATES}
    return f"{len(found.arms)} arms: " + ", ".join(f"{n} {s.replace('_', ' ')}" for s, n in counts.items() if n)


@summary.register
def _(found: ArmChecks) -> list[str]:
    asking = [arm for arm in found.arms if arm.state != "holds"]
    return [headline(found), *(f"{arm.name}: {arm.state.replace('_', ' ')}: {arm.sentence}" for arm in asking)]


@headline.register
def _(found: UpdateResult) -> str:
    unsettled = "" if found.status == "converged" else ", not converged"
    return f"{found.model.name}, updated from {len(found.before.data)} poses{unsettled}"


@summary.register
def _(found: UpdateResult) -> list[str]:
    poses = len(found.before.data)
    said = f"up to date from {poses} poses" if found.status == "converged" else f"not converged on {poses} poses"
    lines = [f"{found.model.name}: {said}", f"before: {found.before.sentence}"]
    for kind, before, after in found.errors:
        lines.append(f"error on these poses{_of(kind)}: RMS {kind.text(before)} before, {kind.text(after)} after")
    for noise in found.noise.values():
        of = "a measured coordinate" if noise.kind.name == POINTS else noise.kind.plural
        lines.append(f"noise of {of}: {noise}, pooled with the calibration's")
    return lines


def _of(kind: Kind) -> str:
    return "" if kind.name == POINTS else f", {kind.plural}"


@headline.register
def _(found: Comparison) -> str:
    sizes = found.at_tool.to_mm()
    return (
        f"{found.first.name}, {len(found.significant)} parameters differ, {sizes['mean']:.4f} mm at the tool on average"
    )


@summary.register
def _(found: Comparison) -> list[str]:
    sizes = found.at_tool.to_mm()
    lines = [
        f"{found.first.name}: at the tool mean {sizes['mean']:.4f} mm, RMS {sizes['rms']:.4f} mm, largest "
        f"{sizes['max']:.4f} mm over the joint range of both, bases and tools aligned",
        f"parameters that differ beyond noise: {len(found.significant)} of {len(found.parameters)}",
    ]
    return lines + [f"  {d.owner} {d.name}: {d.difference:+.4g} +- {d.std:.2g}" for d in found.significant]


@headline.register
def _(found: History) -> str:
    return f"{len(found.arms)} arms, {sum(len(a.events) for a in found.arms)} files, {len(found.alarms)} alarms"


@summary.register
def _(found: History) -> list[str]:
    lines = [headline(found)]
    for arm in found.arms:
        checks = sum(e.kind == "check" for e in arm.events)
        lines.append(f"{arm.name} ({arm.robot}): {arm.state.replace('_', ' ')}, {checks} checks")
        lines += [f"  {a.date} {a.by}: {a.what}" for a in arm.alarms]
    return lines
