# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""bench/python/bench_coverage.py in short: every effect's intervals hold its truth, alone and in groups of three."""

import os
import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fastcal import _core

BENCH = Path(__file__).parents[3] / "bench" / "python" / "bench_coverage.py"
SETS = 25 if os.environ.get("FASTCAL_TEST_FULL") == "1" else 2


@pytest.fixture(scope="module")
def bench() -> Iterator[dict[str, Any]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCH.parent))  # as for a script
        yield runpy.run_path(str(BENCH))


@pytest.fixture(scope="module")
def table(bench: dict[str, Any]) -> dict[str, Any]:
    return bench["measure"]([*bench["OWNERS"], bench["GROUPS"]], SETS, jobs=1, loss="none")


def test_every_effect_is_counted_and_settles(bench: dict[str, Any], table: dict[str, Any]) -> None:
    assert set(bench["OWNERS"]) | bench["ELSEWHERE"] == set(_core.effect_names())
    assert {label: row["not_converged"] for label, row in table.items() if row["not_converged"]} == {}
    assert all(row["counted"] > 0 for row in table.values())


def test_intervals_cover_as_often_as_they_say(table: dict[str, Any]) -> None:
    alone = {label: row for label, row in table.items() if label not in ("pooled", "joint_profile")}
    assert {label: row["high"] for label, row in alone.items() if row["high"] < 0.9} == {}
    assert table["pooled"]["covered"] >= 0.93
    assert table["pooled"]["high"] >= 0.95
    assert 0.8 < table["pooled"]["rms_deviations"] < 1.25


@pytest.mark.parametrize("seed", [5, 14, 15])
def test_axes_that_only_a_twisted_link_distinguishes_settle(bench: dict[str, Any], seed: int) -> None:
    assert bench["trial"]("link_torsion", seed, "none") is not None
