# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The tables that bench/run makes of what the C++ benchmarks print."""

import json
import re
import runpy
import stat
from pathlib import Path

ROOT = Path(__file__).parents[2]
BENCH = runpy.run_path(str(ROOT / "bench" / "run"))


def test_ratios_are_of_the_medians_of_one_run(tmp_path: Path) -> None:
    peers = {"fastcal_identifies/no_loss": 2.0, "fastcal_identifies/tukey": 4.0}
    peers |= {"ceres_solves/automatic": 40.0, "ceres_solves/written_out": 10.0}
    entries = [
        {"run_name": f"{name}/{size}", "aggregate_name": kind, "aggregate_unit": unit}
        | {"cpu_time": value, "time_unit": "ms"}
        for name, median in peers.items()
        for size in (50, 1000, 100_000)
        for kind, unit, value in (("median", "time", median), ("cv", "percentage", 0.05))
    ]
    entries.append(entries[0] | {"run_name": "triangle", "cpu_time": 3.0})
    program = tmp_path / "bench"
    program.write_text(f"#!/bin/sh\ncat <<'END'\n{json.dumps({'benchmarks': entries})}\nEND\n", encoding="utf-8")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    found = BENCH["measured"](program, 3)
    assert found["fastcal_identifies/no_loss/50"] == (0.002, 0.05)
    table = BENCH["tables"](found).splitlines()
    assert "| 1,000 | none | 2 ms | 40 ms | 10 ms | 20, 5 |" in table
    assert "| 100,000 | tukey | 4 ms | 40 ms | 10 ms | 10, 2.5 |" in table
    assert table[-1] == "| triangle | 3,000 us | 0% |"


def test_numbers_are_written_as_people_write_them() -> None:
    written = {0.28249: "0.282", 4.1: "4.1", 163.4: "163", 999.7: "1,000", 3853.0: "3,850", 21_100.0: "21,100"}
    assert {value: BENCH["readable"](value) for value in written} == written
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    generated = page.partition(BENCH["BEGIN"])[2].partition(BENCH["END"])[0]
    assert not re.search(r"\de[+-]?\d", generated)


def test_every_program_has_its_source_and_the_page_its_place() -> None:
    for name in BENCH["PROGRAMS"]:
        assert (ROOT / "bench" / "cpp" / f"{name}.cpp").is_file()
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    assert page.count(BENCH["BEGIN"]) == page.count(BENCH["END"]) == 1
