# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What docs/papers.md tells of the diagnosed arms is what bench/papers/diagnosed.json holds."""

import statistics
from pathlib import Path
from typing import Any

import pytest

from fastcal.io.results import read_json
from fastcal_studies import NAMES
from fastcal_studies.diagnoses import BY_CHANCE, OPEN, RIGHT, WRONG

ROOT = Path(__file__).parents[3]
SHORT = {
    "siasun_sr210d": "SR210D",
    "kuka_kr500": "KR500",
    "pmc6va030": "PMC",
    "staubli_rx160l": "RX160L",
    "spray_7dof": "spray",
}


def kept(name: str) -> list[dict[str, Any]]:
    arms: list[dict[str, Any]] = read_json(ROOT / "bench" / "papers" / "diagnosed.json")["arms"][name]
    return arms


@pytest.mark.parametrize("name", NAMES)
def test_a_line_of_the_table_is_the_record_s(name: str) -> None:
    runs = kept(name)
    assert [run["seed"] for run in runs] == list(range(len(runs)))
    over = [run["after_mm"] / run["plain_mm"] for run in runs if run["after_mm"] is not None]
    told = [one for run in runs for one in run["names"]]
    count = {verdict: sum(one["told"] == verdict for one in told) for verdict in (RIGHT, WRONG, OPEN)}
    sure = sum(one["told"] == RIGHT and one["grade"] != "C" for one in told)
    cells = (
        SHORT[name],
        f"{len(over)} of {len(runs)}",
        f"{statistics.median(over):.2f} ({max(over):.2f})",
        sum(each > BY_CHANCE for each in over),
        sure,
        count[WRONG],
        count[RIGHT] - sure,
        count[OPEN],
    )
    text = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
    assert f"| {' | '.join(map(str, cells))} |" in text.splitlines()
