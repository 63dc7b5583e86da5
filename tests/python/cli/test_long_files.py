# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal calibrate` on more rows than it holds in memory, as a process."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

from fastcal import Robot, load_robot, perturbed
from fastcal.io import long_files
from fastcal.units import from_si

ROWS = 1_150_000  # of nine columns: more cells than a file that is read at once
MOST_MB = 330  # in memory they take three times that
# The command, and then the most memory that its process held [kB].
MEASURED = """
import resource, sys
from fastcal.cli import main
code = main(sys.argv[1:])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
sys.exit(code)
"""
# A process counts what the one that made it held: a shell stands between the test and the command.
SHELL = ["sh", "-c", '"$@"; exit $?', "sh"]


def write_rows(path: Path, robot: Robot) -> None:
    random = np.random.default_rng(1)
    true = perturbed(robot, seed=1)
    names = [f"q{joint}_deg" for joint in range(1, 7)] + ["x_mm", "y_mm", "z_mm"]
    schema = pa.schema([(name, pa.float64()) for name in names])
    with pyarrow.parquet.ParquetWriter(path, schema) as file:
        for begin in range(0, ROWS, 100_000):
            q = random.uniform(-1.5, 1.5, (min(100_000, ROWS - begin), 6))
            points = true.forward(q)[:, :3, 3] + random.normal(0, 5e-5, (len(q), 3))
            columns = [*from_si(q, "deg").T, *from_si(points, "mm").T]
            file.write_table(pa.table([np.ascontiguousarray(column) for column in columns], schema=schema))


def test_memory_does_not_hold_the_rows(tmp_path: Path) -> None:
    robot = load_robot("staubli_rx160l")
    write_rows(tmp_path / "rows.parquet", robot)
    command = ["calibrate", "staubli_rx160l", "rows.parquet", "-o", "out"]
    run = subprocess.run(
        [*SHELL, sys.executable, "-c", MEASURED, *command], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    *printed, most_kb = run.stdout.strip().splitlines()
    assert int(most_kb) < MOST_MB * 1024
    assert f"{ROWS} rows were read part by part" in run.stderr
    assert printed[-1] == "out/report.html"
    found = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert found["status"] == "converged"
    assert found["train"]["count"] == ROWS
    assert abs(found["sigma_mm"] - 0.05) < 1e-4
    again = load_robot(tmp_path / "out" / "model.yaml")
    assert again.spec["made_by"]["rows"] == ROWS


def test_what_needs_the_rows_in_memory_says_so(
    demo: Path, tmp_path: Path, fastcal: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(long_files, "LONG_BYTES", 1000)
    robot, data = demo / "robot.yaml", demo / "measurements.csv"
    out = tmp_path / "out"
    said = fastcal("calibrate", robot, data, "-o", out, "--choose", "least")
    assert said.code == 2
    assert said.error == f"{data}: --choose holds rows out again and again: it needs them in memory, and takes fewer"
    said = fastcal("calibrate", robot, data, demo / "test.csv", "-o", out)
    assert said.code == 2
    assert "a file of so many rows is read alone; make one of the 2 files" in said.error
    assert not out.exists()
    said = fastcal("calibrate", robot, data, "-o", out)
    assert said.code == 0
    assert "rows were read part by part" not in said.err  # so few are taken into memory
