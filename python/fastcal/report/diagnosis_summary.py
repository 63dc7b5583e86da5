# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A diagnosis in a line and in a few lines."""

from __future__ import annotations

import numpy as np

from fastcal.diagnosis.result import Diagnosis, Finding
from fastcal.effects.entries import traits_of
from fastcal.measurements.kinds import POINTS
from fastcal.report.diagnosis_steps import is_advice, next_steps
from fastcal.report.diagnosis_words import depends, place, step_name
from fastcal.report.formatting import plural
from fastcal.report.summaries import headline, outlier_lines, summary

_NOTICED = 1.05  # of what noise makes, from which on there is a gap


@headline.register
def _(found: Diagnosis) -> str:
    named = ", ".join(f"{f.label} ({f.grade})" for f in found.effects)
    return f"{found.model.name}, {found.verdict.replace('_', ' ')}{': ' + named if named else ''}"


@summary.register
def _(found: Diagnosis) -> list[str]:
    fits = "".join(f"; {misfit.kind.plural} do not fit" for misfit in found.misfits)
    lines = [f"{found.model.name}: {found.verdict.replace('_', ' ')}{fits}", found.sentence]
    for finding in found.effects:
        lines += _finding_lines(finding)
    for step in found.gap:
        main = step.main
        sizes = (("fit", main.train_rms), ("held out", main.held_out_rms), ("test poses", main.test_rms))
        listed = ", ".join(f"{where} {size:.4f} {main.unit}" for where, size in sizes if size is not None)
        name = step_name(step.added)
        if step.added is not None and "@" in step.added:
            name = f"with {name if step.added.count(',') > 1 else step.added}"
        lines.append(f"{name}: RMS of {listed}")
    what = "a measured coordinate" if found.main_noise.kind.name == POINTS else found.main_noise.kind.plural
    lines.append(f"noise of {what}: {found.main_noise} ({found.sigma_note})")
    if found.untestable:
        names = sorted({cause.effect for cause in found.untestable})
        lines.append(f"not testable with these data (diagnosis.json says what would be needed): {', '.join(names)}")
    return [*lines, *outlier_lines(found.outliers), *_ending(found)]


_JUDGED = {"test": "on the test poses", "held out": "on poses held out of the fit", "fitted": "on the poses of the fit"}


def _ending(found: Diagnosis) -> list[str]:
    """The gap before and after, what is left of it and where, and what to measure or do next."""
    gap = found.judged_gap
    before, after = gap.sizes[0], gap.sizes[-1]
    left = float(np.sqrt(max(after**2 - gap.floor**2, 0.0)))
    beyond, noise = f"{left:.3f} {gap.unit} beyond the noise", f"noise alone makes {gap.floor:.3f} {gap.unit}"
    if found.unexplained is None and before <= gap.floor * _NOTICED:
        lines = [f"no gap {_JUDGED[gap.on]}: {after:.3f} {gap.unit}, of which {noise}"]
    else:
        sizes = f"{before:.3f} {gap.unit} before, {after:.3f} {gap.unit} after, {gap.closed:.0%} closed"
        lines = [f"gap {_JUDGED[gap.on]}: {sizes}; {noise}"]
    if found.unexplained is not None:
        on = depends(found.unexplained.depends_on)
        lines.append(f"left: {beyond}, most of it at {place(found.unexplained.owner)}, by {on}")
    elif after > gap.floor * _NOTICED:
        lines.append(f"left: {beyond}, at no place that these data show")
    if found.plan is not None and is_advice(found.plan):
        return [*lines, f"next: measure the {plural(len(found.plan.poses), 'pose')} of {found.plan.file}"]
    return [*lines, f"next: {next_steps(found)[0]}"]


def _finding_lines(finding: Finding) -> list[str]:
    values = ", ".join(
        f"{name} {v.value:.4g}" + (f" +- {v.std:.2g}" if v.std else "") for name, v in finding.parameters.items()
    )
    tail = f", {values}" if traits_of(finding.effect).role != "curve" and values else ""
    others = [f"     or {effect}@{owner}" for effect, owner in finding.equivalents]
    where = "" if finding.in_model else " (not in the model)"
    return [f"  {finding.grade}  {finding.label}{tail}{where}", *others]
