# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Files that are read part by part say what the whole file says, and name the line of what is wrong with it."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest

import fastcal
from fastcal.io import long_files
from fastcal.io.long_files import is_long, open_measurements
from fastcal.measurements.dataset import Dataset

ROWS = 3000
ROBOT = fastcal.load_robot("ur5")


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(long_files, "_BLOCK", 20_000)
    monkeypatch.setattr(long_files, "PART_ROWS", 700)


def columns(rows: int = ROWS) -> dict[str, Any]:
    random = np.random.default_rng(1)
    q = random.uniform(-2, 2, (rows, 6))
    point = ROBOT.forward(q)[:, :3, 3] * 1e3
    return {
        **{f"q{joint + 1}_rad": q[:, joint] for joint in range(6)},
        **dict(zip(("x_mm", "y_mm", "z_mm"), point.T, strict=True)),
        "payload_kg": [None if row % 9 == 0 else 1.5 for row in range(rows)],
        "station": [f"{row // 1000:03d}" for row in range(rows)],
        "humidity": random.uniform(0, 1, rows),
        "remark": [f"row, {row}" for row in range(rows)],
    }


def write_csv(path: Path, given: dict[str, Any], separator: str = ",", newline: str = "\n") -> Path:
    lines = [separator.join(given)]
    for row in zip(*given.values(), strict=True):
        cells = ["" if cell is None else str(cell) for cell in row]
        lines.append(separator.join(f'"{cell}"' if separator in cell else cell for cell in cells))
    path.write_text(newline.join(lines) + newline, encoding="utf-8", newline="")
    return path


def write_parquet(path: Path, given: dict[str, Any]) -> Path:
    pyarrow.parquet.write_table(pa.table(given), path, row_group_size=1100)
    return path


def expect_same(rows: fastcal.LongDataset, whole: Dataset) -> None:
    found = rows.read(0, len(rows))
    assert len(found) == len(whole)
    for field in fields(Dataset):
        a, b = getattr(found, field.name), getattr(whole, field.name)
        if isinstance(b, np.ndarray):
            np.testing.assert_array_equal(a, b, err_msg=field.name)
    assert found.station_names == whole.station_names
    np.testing.assert_array_equal(found.extra["humidity"], whole.extra["humidity"])
    assert found.joint_types == whole.joint_types


@pytest.mark.parametrize(("separator", "newline"), [(",", "\n"), (";", "\r\n"), ("\t", "\n")])
def test_a_csv_is_read_like_the_whole(tmp_path: Path, separator: str, newline: str) -> None:
    path = write_csv(tmp_path / "rows.csv", columns(), separator, newline)
    whole = fastcal.load_measurements(path, ROBOT)
    rows = open_measurements(path, ROBOT)
    expect_same(rows, whole)
    assert "payload is empty in 334 rows and taken as 0 there" in rows.notes
    assert "payload is empty in 334 rows and taken as 0 there" in whole.notes
    assert "column 'humidity' is not known and is kept as it is" in rows.notes
    assert "column 'remark' holds text and is left out of a file of so many rows" in rows.notes
    assert not any("remark" in note and "kept" in note for note in rows.notes)


def test_a_parquet_file_is_read_like_the_whole(tmp_path: Path) -> None:
    path = write_parquet(tmp_path / "rows.parquet", columns())
    expect_same(open_measurements(path, ROBOT), fastcal.load_measurements(path, ROBOT))


def test_a_cell_may_hold_line_ends(tmp_path: Path) -> None:
    given = columns(400)
    given["remark"] = [f"first,\nsecond {row}" for row in range(400)]
    path = write_csv(tmp_path / "rows.csv", given)
    expect_same(open_measurements(path, ROBOT), fastcal.load_measurements(path, ROBOT))


def test_joints_beyond_their_limits_are_counted_over_all_parts(tmp_path: Path) -> None:
    given = columns()
    given["q3_rad"] = np.where(np.arange(ROWS) % 100 == 0, 6.5, given["q3_rad"])
    path = write_csv(tmp_path / "rows.csv", given)
    told = [note for note in open_measurements(path, ROBOT).notes if "limits" in note]
    assert told == [note for note in fastcal.load_measurements(path, ROBOT).notes if "limits" in note]
    assert "in 30 rows" in told[0]


def test_the_line_of_a_bad_cell_is_named(tmp_path: Path) -> None:
    given = columns()
    given["y_mm"] = [*given["y_mm"][:2500], "12,5 ?", *given["y_mm"][2501:]]
    path = write_csv(tmp_path / "rows.csv", given, ";")
    with pytest.raises(fastcal.ParseError) as whole:
        fastcal.load_measurements(path, ROBOT)
    with pytest.raises(fastcal.ParseError) as found:
        open_measurements(path, ROBOT)
    assert str(found.value) == str(whole.value)
    assert ":2502: " in str(found.value)


def test_the_line_of_a_row_that_is_too_short_is_named(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "rows.csv", columns())
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[1700] = "1,2,3"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(fastcal.ParseError, match=r"rows.csv:1701: expected 13 cells as in the header, got 3"):
        open_measurements(path, ROBOT)


def test_the_row_of_a_bad_number_in_parquet_is_named(tmp_path: Path) -> None:
    given = columns()
    given["q2_rad"][1900] = np.nan
    path = write_parquet(tmp_path / "rows.parquet", given)
    with pytest.raises(fastcal.ParseError, match=r"data row 1900, column 'q2_rad': expected a finite number"):
        open_measurements(path, ROBOT)


def test_what_cannot_be_read_is_told_in_a_sentence(tmp_path: Path) -> None:
    nothing = {name: values for name, values in columns(50).items() if name[0] not in "xyz"}
    with pytest.raises(fastcal.ParseError, match="holds nothing measured; expected numbers in x_m"):
        open_measurements(write_csv(tmp_path / "nothing.csv", nothing), ROBOT)
    with pytest.raises(fastcal.ParseError, match="holds no rows; expected rows of numbers below a header"):
        open_measurements(write_csv(tmp_path / "empty.csv", columns(0)), ROBOT)
    with pytest.raises(fastcal.ParseError, match="cannot be read: No such file"):
        open_measurements(tmp_path / "missing.csv", ROBOT)
    (tmp_path / "empty.csv").write_text("\n\n")
    with pytest.raises(fastcal.ParseError, match="is empty; expected a header"):
        open_measurements(tmp_path / "empty.csv", ROBOT)
    content = write_parquet(tmp_path / "rows.parquet", columns()).read_bytes()
    (tmp_path / "cut.parquet").write_bytes(content[: len(content) // 2])
    with pytest.raises(fastcal.ParseError, match="is not a readable Parquet file"):
        open_measurements(tmp_path / "cut.parquet", ROBOT)
    (tmp_path / "line.csv").write_bytes(b"q1_rad,x_mm\n" + b"1" * 100_001)
    with pytest.raises(fastcal.ParseError, match="without one that ends"):
        open_measurements(tmp_path / "line.csv", ROBOT)


def test_an_instrument_is_said_for_every_part(tmp_path: Path) -> None:
    path = write_csv(tmp_path / "rows.csv", columns())
    whole = fastcal.load_measurements(path, ROBOT).with_tracker(5e-6, 5e-6, (3.0, 0.0, 0.0))
    rows = open_measurements(path, ROBOT, seen=lambda part: part.with_tracker(5e-6, 5e-6, (3.0, 0.0, 0.0)))
    expect_same(rows, whole)


def test_only_files_of_very_many_rows_are_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table, parquet = write_csv(tmp_path / "a.csv", columns()), write_parquet(tmp_path / "a.parquet", columns())
    other = tmp_path / "points.csv"
    other.write_text("name,x,y,z\n" + "P1,1.0,2.0,3.0\n" * 20_000)
    os.mkfifo(tmp_path / "pipe")
    never = [other, tmp_path, tmp_path / "missing.csv", tmp_path / "pipe"]
    assert not any(is_long(path) for path in [table, parquet, *never])
    monkeypatch.setattr(long_files, "LONG_BYTES", 100_000)
    monkeypatch.setattr(long_files, "LONG_CELLS", ROWS * 10)
    assert is_long(table)
    assert is_long(parquet)
    assert not any(is_long(path) for path in never)


def test_calibrate_opens_a_long_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {name: values for name, values in columns().items() if name not in ("payload_kg", "station", "remark")}
    path = write_csv(tmp_path / "rows.csv", given)
    whole = fastcal.calibrate(ROBOT, path, checks=False)
    monkeypatch.setattr(long_files, "LONG_BYTES", 100_000)
    found = fastcal.calibrate(ROBOT, path, checks=False)
    assert found.model.spec == whole.model.spec
    assert found.train.row_count == ROWS
    with pytest.raises(fastcal.InvalidInput, match="got 3000 rows in files: only calibrate takes these"):
        fastcal.evaluate(ROBOT, open_measurements(path, ROBOT))  # type: ignore[arg-type]
