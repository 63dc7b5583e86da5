# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Exports are refused before they take more time or memory than a record of a session could; no pattern runs away."""

import io
import os
from pathlib import Path
from typing import Any

import openpyxl
import pytest

from fastcal import load_robot
from fastcal.errors import InvalidInput, ParseError, TooLarge
from fastcal.importers import import_measurements, joining, sources
from fastcal.importers.grid import text_grid
from fastcal.importers.kuka import DIALECT as KUKA
from fastcal.importers.loading import load_measurements
from fastcal.importers.programs import is_program


def test_pipes_devices_and_folders_are_no_exports(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo.csv")
    (tmp_path / "zero.csv").symlink_to("/dev/zero")
    for name, why in (("fifo.csv", "a pipe or a device"), ("zero.csv", "a pipe or a device"), ("", "a folder")):
        with pytest.raises(ParseError, match=why):
            import_measurements([tmp_path / name])


@pytest.mark.parametrize(
    ("limit", "text", "message"),
    [
        ("MAX_BYTES", "a;b\n" * 30, "at most 100 bytes, got 120"),
        ("MAX_LINES", "a\n" * 101, "at most 100 lines, got 102"),
        ("MAX_LINE", "1;" * 60 + "\n", "at most 100 characters, got 120"),
        ("MAX_CELLS", ("1;" * 50 + "\n") * 2, "at most 100 cells, got 103"),
    ],
)
def test_texts_have_limits(
    limit: str, text: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, limit, 100)
    (tmp_path / "export.txt").write_text(text)
    with pytest.raises(TooLarge, match=message):
        import_measurements([tmp_path / "export.txt"])


def test_a_workbook_has_limits_of_rows_and_of_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    book, out = openpyxl.Workbook(), io.BytesIO()
    for row in range(12):
        book.active.append([row] * 9)
    book.save(out)
    (tmp_path / "book.xlsx").write_bytes(out.getvalue())
    monkeypatch.setattr(sources, "MAX_CELLS", 100)
    with pytest.raises(TooLarge, match=r"at most 100 cells, got 1[01]0 and more"):
        import_measurements([tmp_path / "book.xlsx"])
    book.active.cell(row=1_000_000, column=100, value=1)
    book.save(tmp_path / "gap.xlsx")
    with pytest.raises(TooLarge, match="at most 8000000 cells, got 1000000 rows and 100 columns"):
        import_measurements([tmp_path / "gap.xlsx"])


def test_what_a_measurement_file_lacks_is_reported_where_it_is_too_large_for_an_export(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sources, "MAX_BYTES", 10)
    (tmp_path / "data.csv").write_text("x_mm,y_mm,z_mm\n1,2,3\n")
    with pytest.raises(ParseError, match="q1"):
        load_measurements(tmp_path / "data.csv", load_robot("ur5"))


def test_points_and_poses_that_are_too_many_to_be_tried_are_refused(
    session: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(joining, "_MOST_TRIED", 899)
    points = session.table("Name;X [mm];Y [mm];Z [mm]", "{name};{p[0]:.4f};{p[1]:.4f};{p[2]:.4f}")
    with pytest.raises(InvalidInput, match="30 points and 30 poses are too many"):
        import_measurements([points], joints=session.joints(), robot=load_robot("ur5"))


@pytest.mark.parametrize(
    "text",
    [
        "A1 A2 A3 A4 A5 " * 6000,  # no A6: the time of a plain pattern grows with the fifth power
        "X" + " " * 90_000 + "1\n" + "Point: a\n" * 3,
        "name: [\n" * 5000,
        "a" + " " * 90_000 + "b",
        "_" * 90_000 + "[",
    ],
    ids=["axes", "report", "messages", "blanks", "titles"],
)
def test_no_pattern_runs_away(text: str, tmp_path: Path) -> None:
    """Each of these took minutes or longer with a pattern that tries again from every place."""
    (tmp_path / "export.txt").write_text(text)
    with pytest.raises(InvalidInput):
        import_measurements([tmp_path / "export.txt"])
    assert not KUKA.recognizes(text_grid(text, "export.txt"))


def test_a_program_of_empty_lines_is_looked_at_once(tmp_path: Path) -> None:
    (tmp_path / "empty.mod").write_text("\n" * 100_000)
    assert not is_program(tmp_path / "empty.mod")


def test_a_title_of_thousands_of_digits_is_no_number_of_a_joint(tmp_path: Path) -> None:
    """Python refuses to read more than 4,300 digits, which was an internal error."""
    (tmp_path / "a.csv").write_text(f"J{'1' * 4301},x,y\n1,2,3\n2,3,4\n")
    with pytest.raises(InvalidInput) as caught:
        import_measurements([tmp_path / "a.csv"])
    assert len(str(caught.value)) < 600
