# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files of checks, updates, comparisons and histories."""

from __future__ import annotations

import os

from fastcal.io.results import write_json
from fastcal.monitoring.result import CheckResult


def write_check(found: CheckResult, path: str | os.PathLike[str]) -> None:
    """Writes check.json, whole or not at all."""
    write_json(path, found.to_json_dict())
