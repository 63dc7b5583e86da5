# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A diagnosis in a line and in a few lines."""

from __future__ import annotations

from fastcal.diagnosis.result import Diagnosis, Finding
from fastcal.effects.entries import traits_of
from fastcal.measurements.kinds import POINTS
from fastcal.report.summaries import headline, outlier_lines, summary


@headline.register
def _(found: Diagnosis) -> str:
    named = ", ".join(f"{f.label} ({f.grade})" for f in found.effects)
    return f"{found.model.name}, {found.verdict.replace('_', ' ')}{': ' + named if named else ''}"


@summary.register
def _(found: Diagnosis) -> list[str]:
    lines = [f"{found.model.name}: {found.verdict.replace('_', ' ')}", found.sentence]
    for finding in found.effects:
        lines += _finding_lines(finding)
    for step in found.gap:
        name, main = "geometry alone" if step.added is None else f"with {step.added}", step.main
        test = "" if main.test_rms is None else f", test poses {main.test_rms:.4f} {main.unit}"
        if main.train_rms is not None:
            lines.append(f"{name}: RMS {main.train_rms:.4f} {main.unit}{test}")
    what = "a measured coordinate" if found.main_noise.kind.name == POINTS else found.main_noise.kind.plural
    lines.append(f"noise of {what}: {found.main_noise} ({found.sigma_note})")
    if found.untestable:
        names = sorted({cause.effect for cause in found.untestable})
        lines.append(f"not testable with these data (diagnosis.json says what would be needed): {', '.join(names)}")
    return lines + outlier_lines(found.outliers)


def _finding_lines(finding: Finding) -> list[str]:
    values = ", ".join(
        f"{name} {v.value:.4g}" + (f" +- {v.std:.2g}" if v.std else "") for name, v in finding.parameters.items()
    )
    tail = f", {values}" if traits_of(finding.effect).role != "curve" and values else ""
    others = [f"     or {effect}@{owner}" for effect, owner in finding.equivalents]
    where = "" if finding.in_model else " (not in the model)"
    return [f"  {finding.grade}  {finding.label}{tail}{where}", *others]
