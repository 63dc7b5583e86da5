# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pages of some verdicts on every screen: nothing overlaps, is cut, runs over or is empty; all others by every_page."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest

from .every_page import CASES, SCREENS, faults

# What lies where depends on the width and what can be read on the colours: each width once, each scheme once.
FEW = [(1400, "light"), (400, "dark")]


@pytest.mark.parametrize(
    "name",
    [
        "calibrate_moved",
        "calibrate_wrong_rows",
        "diagnose_nothing",
        "diagnose_several",
        "diagnose_german",
        "check_changed",
        "compare_differs",
        "history_alarm",
    ],
)
def test_a_page_is_whole_on_every_screen(name: str, chromium: Any, tmp_path: Path) -> None:
    folder = tmp_path / name
    folder.mkdir()
    page = CASES[name](folder)
    assert faults(page, chromium, screens=SCREENS if os.environ.get("FASTCAL_TEST_FULL") == "1" else FEW) == []


def test_a_fault_would_be_seen(chromium: Any, tmp_path: Path) -> None:
    """A drawing whose texts lie on one another, a word in the console, and a page that is too wide."""
    page = tmp_path / "out" / "report.html"
    page.parent.mkdir()
    page.write_text(
        '<!DOCTYPE html><body data-state="ready"><main style="width: 1600px"><p>words</p>'
        '<div id="chart"><div class="plot" data-state="drawn"><svg width="300" height="60">'
        '<text x="10" y="30">first</text><text x="12" y="31">second</text></svg></div></div></main>'
        "<script>console.error('planted')</script></body>"
    )
    found = faults(page, chromium, screens=FEW)
    assert "1400 light: overlap: chart: first / second" in found
    assert "400 dark: console: planted" in found
    assert any("pixels wide" in fault for fault in found)
