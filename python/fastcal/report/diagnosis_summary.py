# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A diagnosis in a line and in a few lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.diagnosis.result import Diagnosis, Finding
from fastcal.effects.entries import traits_of
from fastcal.report.diagnosis_steps import is_advice, next_steps
from fastcal.report.diagnosis_words import depends, place, step_name
from fastcal.report.formatting import plural
from fastcal.report.language import _ as translated
from fastcal.report.summaries import headline, noise_lines, outlier_lines, summary
from fastcal.said import said

_VERDICTS = {
    "none": said("none"),
    "named": said("named"),
    "one_of": said("one of"),
    "several": said("several"),
    "unexplained": said("unexplained"),
}
_NOTICED = 1.05  # of what noise makes, from which on there is a gap
_MOST_VALUES = 7  # of an effect in the terminal: a step and its moment


@headline.register
def _(found: Diagnosis) -> str:
    named = ", ".join(f"{f.label} ({f.grade})" for f in found.effects)
    return f"{found.model.name}, {found.verdict.replace('_', ' ')}{': ' + named if named else ''}"


@summary.register
def _(found: Diagnosis) -> list[str]:
    fits = "".join(translated("; {what} do not fit", what=translated(m.kind.plural)) for m in found.misfits)
    verdict = said("too few measurements") if found.few else _VERDICTS[found.verdict]
    lines = [f"{found.model.name}: {translated(verdict)}{fits}", translated(found.sentence)]
    for finding in found.effects:
        lines += _finding_lines(finding)
    for step in found.gap:
        main = step.main
        sizes = (
            (said("fit"), main.train_rms),
            (said("held out"), main.held_out_rms),
            (said("test poses"), main.test_rms),
        )
        listed = ", ".join(
            translated("{where} {size:.4f} {unit}", where=where, size=float(size), unit=main.unit)
            for where, size in sizes
            if size is not None
        )
        name = step_name(step.added)
        if step.added is not None and "@" in step.added:
            name = translated("with {name}", name=name if step.added.count(",") > 1 else step.added)
        lines.append(translated("{name}: RMS of {sizes}", name=name, sizes=listed))
    lines += noise_lines([replace(found.main_noise, note=found.sigma_note)])
    if found.untestable:
        names = _untestable(found)
        lines.append(
            translated(
                "not testable with these data (diagnosis.json says what would be needed): {names}",
                names=", ".join(names),
            )
        )
    return [*lines, *outlier_lines(found.outliers), *_ending(found)]


def _untestable(found: Diagnosis) -> list[str]:
    """Effects, with the owners where these data show it of others."""
    shown = {one.effect for one in found.smallest} | {one.effect for one in found.effects}
    names = {f"{one.effect}@{one.owner}" if one.effect in shown else one.effect for one in found.untestable}
    return sorted(names)


_JUDGED = {
    "test": said("on the test poses"),
    "held out": said("on poses held out of the fit"),
    "fitted": said("on the poses of the fit"),
}


def _ending(found: Diagnosis) -> list[str]:
    """The gap before and after, what is left of it and where, and what to measure or do next."""
    gap = found.judged_gap
    before, after = gap.sizes[0], gap.sizes[-1]
    left = float(np.sqrt(max(after**2 - gap.floor**2, 0.0)))
    numbers = {"before": float(before), "after": float(after), "left": left, "noise": float(gap.floor)}
    words = {"on": _JUDGED[gap.on], "unit": gap.unit}
    if found.unexplained is None and before <= gap.floor * _NOTICED:
        lines = [
            translated(
                "no gap {on}: {after:.3f} {unit}, of which noise alone accounts for {noise:.3f} {unit}",
                **words,
                **numbers,
            )
        ]
    else:
        lines = [
            translated(
                "gap {on}: {before:.3f} {unit} before, {after:.3f} {unit} after, {closed} closed; noise alone "
                "accounts for {noise:.3f} {unit}",
                closed=f"{gap.closed:.0%}",
                **words,
                **numbers,
            )
        ]
    if found.unexplained is not None:
        where = {"place": place(found.unexplained.owner), "variables": depends(found.unexplained.depends_on)}
        lines.append(
            translated(
                "unexplained: {left:.3f} {unit} beyond the noise, most of it at {place}, depending on {variables}",
                **where,
                **words,
                **numbers,
            )
        )
    elif after > gap.floor * _NOTICED:
        lines.append(
            translated(
                ("unexplained: {left:.3f} {unit} beyond the noise, at no place that these data single out"),
                **words,
                **numbers,
            )
        )
    if found.plan is not None and is_advice(found.plan):
        poses = plural(len(found.plan.poses), "pose")
        return [*lines, translated("next: measure the {poses} of {file}", poses=poses, file=found.plan.file)]
    return [*lines, translated("next: {step}", step=next_steps(found)[0])]


def _finding_lines(finding: Finding) -> list[str]:
    sizes = [f"{name} {v.value:.4g}" + (f" +- {v.std:.2g}" if v.std else "") for name, v in finding.parameters.items()]
    values = ", ".join(sizes[:_MOST_VALUES])
    if len(sizes) > _MOST_VALUES:
        values += translated(", and {count} more in diagnosis.json", count=len(sizes) - _MOST_VALUES)
    tail = f", {values}" if traits_of(finding.effect).role != "curve" and values else ""
    others = [f"     {translated('or')} {effect}@{owner}" for effect, owner in finding.equivalents]
    where = "" if finding.in_model else translated(" (not in the model)")
    return [f"  {finding.grade}  {finding.label}{tail}{where}", *others]
