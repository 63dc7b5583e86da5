# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks in a line, in a few lines and as a table."""

from __future__ import annotations

import pandas as pd

from fastcal.monitoring.result import CheckResult
from fastcal.report.frames import frame
from fastcal.report.summaries import headline, summary


@headline.register
def _(found: CheckResult) -> str:
    return (
        f"{found.model.name}, {found.verdict.replace('_', ' ')}, RMS {found.rms_mm:.4f} mm of {len(found.data)} poses"
    )


@summary.register
def _(found: CheckResult) -> list[str]:
    lines = [f"{found.model.name}: {found.sentence}", *found.reasons]
    if found.blind:
        lines.append(f"not shown by any pose before an instrument that was set up anew: {', '.join(found.blind)}")
    if found.next_poses:
        lines.append(f"next poses to measure: {len(found.next_poses)}, joint positions in check.json")
    return lines


@frame.register
def _(found: CheckResult) -> pd.DataFrame:
    """Every change that was looked for."""
    columns = ["owner", "name", "value", "std", "unit", "p_value", "detectable"]
    return pd.DataFrame([vars(test) for test in found.tests], columns=columns)
