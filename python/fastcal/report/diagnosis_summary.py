# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A diagnosis in a line and in a few lines."""

from __future__ import annotations

from fastcal.diagnosis.result import Diagnosis, Finding
from fastcal.effects.entries import traits_of
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
        test = "" if step.test_rms_mm is None else f", test poses {step.test_rms_mm:.4f} mm"
        name = "geometry alone" if step.added is None else f"with {step.added}"
        lines.append(f"{name}: RMS {step.train_rms_mm:.4f} mm{test}")
    lines.append(f"noise of a measured coordinate: {found.sigma_mm:.4f} mm ({found.sigma_note})")
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
