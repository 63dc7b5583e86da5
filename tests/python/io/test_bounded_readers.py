# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Readers refuse what has no end, or unpacks to more than memory, before they try; none of it takes a second."""

import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet
import pytest

from fastcal.errors import ParseError
from fastcal.io import arrow, excel_archive, text_tables
from fastcal.io.programs import load_program
from fastcal.io.regular_file import read_bytes
from fastcal.io.results import read_json
from fastcal.io.robot_file import load_robot
from fastcal.io.tables import read_table
from fastcal.io.urdf_file import read_urdf

READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "table": (".csv", read_table),
    "robot": (".yaml", load_robot),
    "URDF": (".urdf", load_robot),
    "program": (".mod", load_program),
    "JSON": (".json", read_json),
}


@pytest.mark.parametrize("reader", READERS)
def test_pipes_devices_and_folders_are_no_files(reader: str, tmp_path: Path) -> None:
    ending, read = READERS[reader]
    os.mkfifo(tmp_path / f"fifo{ending}")
    (tmp_path / f"zero{ending}").symlink_to("/dev/zero")
    (tmp_path / f"folder{ending}").mkdir()
    for name, why in (("fifo", "a pipe or a device"), ("zero", "a pipe or a device"), ("folder", "a folder")):
        with pytest.raises(ParseError, match=why):
            read(tmp_path / f"{name}{ending}")
    with pytest.raises(ParseError, match="there is no such file"):
        read(tmp_path / f"none{ending}")


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "sparse"
    with path.open("wb") as file:
        file.truncate(10**12)
    with pytest.raises(ParseError, match="at most 100 bytes, got 1000000000000"):
        read_bytes(path, 100)
    path.write_bytes(b"x" * 100)
    assert read_bytes(path, 100) == b"x" * 100


def rewritten(source: Path, target: Path, change: Callable[[str], str]) -> Path:
    """A workbook whose sheet is changed as text."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for part in old.namelist():
            text = old.read(part)
            new.writestr(part, change(text.decode()).encode() if "sheet1" in part else text)
    return target


@pytest.fixture
def book(tmp_path: Path) -> Path:
    made = openpyxl.Workbook()
    for row in (["q1_deg", "x_mm"], [1.0, 2.0], [3.0, 4.0]):
        made.active.append(row)
    made.save(tmp_path / "good.xlsx")
    return tmp_path / "good.xlsx"


def test_a_good_workbook_passes(book: Path, tmp_path: Path) -> None:
    assert len(read_table(book)) == 2
    gap = rewritten(
        book, tmp_path / "gap.xlsx", lambda text: text.replace('row r="3"', 'row r="900"').replace('3"', '900"')
    )
    assert len(read_table(gap)) == 2


@pytest.mark.parametrize("number", ["100000000", "1e100", "-5", "9" * 5000])
def test_row_numbers_that_no_sheet_has_are_refused(number: str, book: Path, tmp_path: Path) -> None:
    bad = rewritten(book, tmp_path / "bad.xlsx", lambda text: text.replace('<row r="3"', f'<row r="{number}"'))
    with pytest.raises(ParseError, match=r"row numbers of at most 1048576, got|is not a readable Excel file"):
        read_table(bad)


def test_a_wide_and_long_sheet_of_few_cells_is_refused(book: Path, tmp_path: Path) -> None:
    far = '<row r="1048576"><c r="XFD1048576"><v>1</v></c></row></sheetData>'
    bad = rewritten(book, tmp_path / "bad.xlsx", lambda text: text.replace("</sheetData>", far))
    with pytest.raises(ParseError, match="got 1048576 rows and 16384 columns"):
        read_table(bad)


def test_a_workbook_that_unpacks_to_too_much_is_refused(book: Path, tmp_path: Path) -> None:
    bad = rewritten(book, tmp_path / "bad.xlsx", lambda text: text + " " * excel_archive.MAX_BYTES)
    assert bad.stat().st_size < 1_000_000
    with pytest.raises(ParseError, match=f"at most {excel_archive.MAX_BYTES} bytes unpacked"):
        read_table(bad)


def test_a_parquet_file_that_unpacks_to_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pa.parquet.write_table(pa.table({"q1_deg": np.zeros(1000)}), tmp_path / "zeros.parquet")
    assert len(read_table(tmp_path / "zeros.parquet")) == 1000
    monkeypatch.setattr(arrow, "MAX_CELLS", 999)
    with pytest.raises(ParseError, match="at most 999 cells, got 1000 rows and 1 columns"):
        read_table(tmp_path / "zeros.parquet")


def test_text_tables_have_a_limit_of_size_and_width(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "wide.csv"
    path.write_text("," * text_tables.MAX_COLUMNS + "\n1\n")
    with pytest.raises(ParseError, match="at most 10000 columns, got 10001"):
        read_table(path)
    monkeypatch.setattr(text_tables, "MAX_BYTES", 100)
    path.write_text("q1_deg\n" + "1\n" * 50)
    with pytest.raises(ParseError, match="at most 100 bytes, got 107; save it as Parquet"):
        read_table(path)


@pytest.mark.parametrize(
    "element",
    [
        "<a>",
        '<a b="/>">',
        "<a b='/>'>",
        '<a b = "/>" >',
        "<a b=c'/ d>",
        "<!-- <a/> --><a>",
        "<a><![CDATA[</a>]]>",
        "<a\n>",
    ],
)
def test_nesting_is_counted_whatever_stands_in_a_tag(element: str, tmp_path: Path) -> None:
    path = tmp_path / "deep.urdf"
    path.write_text('<robot name="r"><link name="a"/>' + element * 60_000)
    with pytest.raises(ParseError, match="nests its elements more than 1000 deep"):
        read_urdf(path)


def test_comments_and_closed_elements_do_not_count(tmp_path: Path) -> None:
    path = tmp_path / "long.urdf"
    noise = '<!-- <a><b> --><?pi <x> ?><gazebo a="<"><b/></gazebo>' * 5000
    path.write_text(f'<robot name="r">{noise}<link name="a"/><link name="b"/><joint name="j" type="revolute">'
                    '<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
                    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>')  # fmt: skip
    assert len(read_urdf(path)["joints"]) == 1
