# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The coverage of expanded uncertainties that docs/uncertainty.md tells is that of the simulated acceptances."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[3]
TABLE = json.loads((ROOT / "bench" / "python" / "bench_acceptance.json").read_text(encoding="utf-8"))
PAGE = " ".join((ROOT / "docs" / "uncertainty.md").read_text(encoding="utf-8").split())  # whatever its line breaks
ROWS = {
    "AP_x, AP_y, AP_z": "coordinates",
    "AP": "AP",
    "AD": "AD",
}


def percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def test_the_page_shows_what_was_measured() -> None:
    assert f"simulates {TABLE['tests']:,} acceptance tests" in PAGE
    for name, key in ROWS.items():
        line = f"| {name} | {percent(TABLE['model'][key]['covered'])} | {percent(TABLE['fit'][key]['covered'])} |"
        assert line in PAGE
    assert f"{TABLE['calibrations']} calibrations" in PAGE
    assert percent(TABLE["predicted"]["covered"]) in PAGE
    for align in ("model", "fit"):
        found = TABLE[align]["verdicts"]
        assert f"{found['wrong']} of {found['asked']:,}" in PAGE


@pytest.mark.parametrize("align", ["model", "fit"])
@pytest.mark.parametrize("key", ["coordinates", "AP"])
def test_an_interval_of_95_percent_covers_94_to_96(align: str, key: str) -> None:
    assert TABLE["tests"] >= 1000
    assert 0.94 <= TABLE[align][key]["covered"] <= 0.96


def bench() -> ModuleType:
    spec = importlib.util.spec_from_file_location("bench_acceptance", ROOT / "bench" / "python" / "bench_acceptance.py")
    if spec is None or spec.loader is None:
        raise FileNotFoundError("bench/python/bench_acceptance.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_program_still_makes_such_a_table() -> None:
    """Six tests of either kind and two calibrations: figures of the right names, most of them covered."""
    program = bench()
    for align in (False, True):
        found = program.summary([program.test(seed, align) for seed in range(6)])
        assert found["coordinates"]["count"] == 6 * 15
        assert found["coordinates"]["covered"] > 0.8
    hits = [hit for seed in range(2) for hit in program.calibrated(seed)]
    assert len(hits) == 30
    assert sum(hits) > 20
