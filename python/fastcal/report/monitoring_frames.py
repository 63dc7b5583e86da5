# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks, updates, comparisons and histories as tables."""

from __future__ import annotations

import pandas as pd

from fastcal.monitoring.arms import ArmChecks
from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.history import History
from fastcal.monitoring.result import CheckResult
from fastcal.monitoring.update import UpdateResult
from fastcal.report.frames import frame


@frame.register
def _(found: CheckResult) -> pd.DataFrame:
    """Every change that was looked for."""
    columns = ["owner", "name", "value", "std", "unit", "p_value", "detectable"]
    return pd.DataFrame([vars(test) for test in found.tests], columns=columns)


@frame.register
def _(found: ArmChecks) -> pd.DataFrame:
    """A row an arm."""
    return pd.DataFrame([arm.to_row() for arm in found.arms])


@frame.register
def _(found: UpdateResult) -> pd.DataFrame:
    """The arm's parameters, now and before (`nominal`)."""
    columns = ["owner", "name", "unit", "nominal", "value", "std"]
    return pd.DataFrame([vars(p) for p in found.parameters], columns=columns)


@frame.register
def _(found: Comparison) -> pd.DataFrame:
    """A row a parameter."""
    columns = ["owner", "name", "a", "b", "difference", "std", "unit", "p_value", "significant"]
    return pd.DataFrame([vars(d) for d in found.parameters], columns=columns)


@frame.register
def _(found: History) -> pd.DataFrame:
    """A row a check or model."""
    rows = [
        (e.arm, e.date, e.kind, e.verdict, e.content.get("rms_mm"), e.file) for arm in found.arms for e in arm.events
    ]
    return pd.DataFrame(rows, columns=["arm", "date", "kind", "verdict", "rms_mm", "file"])
