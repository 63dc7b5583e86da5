# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tables: the same numbers come out of every format, and what is wrong is named with its line."""

import csv
import datetime
import re
import zipfile
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet
import pytest

from fastcal.errors import InvalidInput, ParseError
from fastcal.io import text_tables
from fastcal.io.arrow import column_from_arrow
from fastcal.io.table import Table
from fastcal.io.tables import read_table, write_csv

NUMBERS = [[1.5, -2.25e-7, 3.0], [np.nan, 4.0, 1234.5]]


@pytest.fixture(autouse=True, scope="module")
def quick_way_for_small_files() -> Iterator[None]:
    """Files of a test are small, and the quick way is for large ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text_tables, "QUICK_FROM", 0)
        yield


def both_ways(path: Path) -> list[Table]:
    """A text file as the quick way and as the exact way read it."""
    table = read_table(path)
    assert table.exact is not None
    return [table, table.exact()]


@pytest.mark.parametrize(
    ("text", "encoding"),
    [
        ("a,b,c\n1.5,-2.25e-7,3\n,4,1234.5\n", "utf-8"),
        ("a,b,c\r\n1.5,-2.25e-7,3\r\nnan,4,1234.5", "utf-8-sig"),
        ("a;b;c\n1,5;-2,25e-7;3\n;4;1234,5\n", "utf-8"),
        ("a;b;c\n1.5;-2.25e-7;3\nNA;4;1234.5\n", "utf-8-sig"),
        ("a\tb\tc\r\n1,5\t-2,25E-07\t+3\r\n \t4\t1234,5\r\n", "utf-8"),
        ("\n a , b , c \n\n 1.5 , -2.25e-7 , 3 \n\n N/A , 4 , 1234.5 \n\n", "utf-8"),
        ("a,b,c\r1.5,-2.25e-7,3\r,4,1234.5\r", "utf-8"),
        ("a,b,c,,\n1.5,-2.25e-7,3,,\n,4,1234.5,,\n", "utf-8"),
        ("a,b,c\r\n1.5,-2.25e-7,3\r\n,4,1234.5\r\n", "utf-16"),
        ("a;b;c\r\n1,5;-2,25e-7;3\r\n;4;1234,5\r\n", "utf-16-le"),
        ("a\tb\tc\n1.5\t-2.25e-7\t3\n\t4\t1234.5\n", "utf-16-be"),
        ("# a,b,c\n1.5,-2.25e-7,3\n,4,1234.5\n", "utf-8"),
        ("# made by hand\n#\n# a , b , c\n1.5,-2.25e-7,3\nnan,4,1234.5\n# the end\n", "utf-8"),
        ("% units: mm, deg\n% a;b;c\n1,5;-2,25e-7;3\n;4;1234,5\n", "utf-8"),
        ("# remark\n\n% other\na,b,c\n1.5,-2.25e-7,3\n,4,1234.5\n", "utf-8"),
        ("// a|b|c\n1.5|-2.25e-7|3\n|4|1234.5\n", "utf-8"),
        ("a  b c\n 1.5 -2.25e-7   3\nnan\t4 1234.5 \n", "utf-8"),
        ("## a b c\n1.5 -2.25e-7 3\nnan 4 1234.5\n", "utf-8"),
        ("| a | b | c |\n|---|:--|--:|\n| 1.5 | -2.25e-7 | 3 |\n|  | 4 | 1234.5 |\n", "utf-8"),
    ],
)
def test_separators_decimal_marks_and_line_ends(tmp_path: Path, text: str, encoding: str) -> None:
    path = tmp_path / "data.csv"
    path.write_bytes(text.encode(encoding))
    table = read_table(path)
    exact = table if table.exact is None else table.exact()
    assert list(exact.names) == list(table.names) == ["a", "b", "c"]
    np.testing.assert_array_equal(np.transpose([exact.numbers(place) for place in range(3)]), NUMBERS)


def test_a_column_may_be_titled_by_a_mark(tmp_path: Path) -> None:
    """A counter's title is no remark, and neither are names that all begin with one."""
    path = tmp_path / "data.csv"
    path.write_text("#,a\n1,2\n3,4\n")
    table = read_table(path)
    assert list((table.exact() if table.exact else table).names) == ["#", "a"]
    path.write_text("name,a\n#1,2\n#2,4\n")
    for table in [read_table(path)]:
        assert table.labels(0) == ["#1", "#2"]


def test_rows_that_someone_put_a_mark_before_are_left_out_and_named(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("a,b\n1,2\n# 3,4\n5,6\n# seen by J\n#7,8\n")
    table = read_table(path)
    table = table.exact() if table.exact else table
    np.testing.assert_array_equal(table.numbers(0), [1, 5])
    assert table.lines == [2, 4]
    assert table.notes == ("left out, as they begin with the mark of a remark: lines 3, 5, 6",)


def test_the_quick_way_takes_plain_files_and_agrees_with_the_exact_way(tmp_path: Path) -> None:
    values = np.random.default_rng(0).normal(size=(500, 4)) * 10.0 ** np.arange(-6, 6, 3)
    for separator, mark in ((",", "."), (";", ","), ("\t", ",")):
        path = tmp_path / "data.csv"
        rows = [separator.join([*map(str, row), "007"]).replace(".", mark) for row in values.tolist()]
        path.write_text("\n".join([separator.join(["a", "b", "c", "d", "station"]), *rows]))
        for table in both_ways(path):
            np.testing.assert_array_equal(np.transpose([table.numbers(place) for place in range(4)]), values)
            assert table.labels(4) == ["007"] * 500


@pytest.mark.parametrize("quoting", [csv.QUOTE_ALL, csv.QUOTE_NONNUMERIC])
def test_the_quick_way_takes_quoted_cells(tmp_path: Path, quoting: int) -> None:
    values = np.random.default_rng(0).normal(size=(50, 2))
    path = tmp_path / "data.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, quoting=quoting)  # type: ignore[arg-type]
        writer.writerow(["a", "b", "station", 'who "J", first'])
        writer.writerows([*row, "007", 'Doe, "J"'] for row in values.tolist())
    for table in both_ways(path):
        assert list(table.names) == ["a", "b", "station", 'who "J", first']
        np.testing.assert_array_equal(np.transpose([table.numbers(place) for place in range(2)]), values)
        assert (table.labels(2), table.labels(3)) == (["007"] * 50, ['Doe, "J"'] * 50)


def test_which_quotes_the_quick_way_takes() -> None:
    """Beside the words of RFC 4180: a quoted cell holds anything but a lone quote, here within a line."""
    cell = re.compile(rb'(?<![^;\r\n])"(?:[^"\r\n]|"")*"(?![^;\r\n])')
    random = np.random.default_rng(0)
    seen = set()
    for _ in range(20_000):
        content = bytes(random.choice(list(b'"";a\n'), size=random.integers(1, 9)).tolist())
        sound = b'"' not in cell.sub(b"", content)
        assert text_tables._quotes_hold_cells(content, ";") == sound, content
        seen.add((sound, b'"' in content))
    assert seen == {(True, True), (True, False), (False, True)}


def test_a_small_file_goes_the_exact_way_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_tables, "QUICK_FROM", 100)
    path = tmp_path / "data.csv"
    path.write_text("a,b\n" + "1,2\n" * 23)
    assert read_table(path).exact is None
    path.write_text("a,b\n" + "1,2\n" * 24)
    assert read_table(path).exact is not None


def test_quoted_cells_may_hold_separators_line_ends_and_decimal_commas(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text('a,who\n"1,5","Doe, ""J""\nof Acme"\n"2,5",x\nfour,y\n')
    table = read_table(path)
    table = table.exact() if table.exact else table
    assert table.labels(1) == ['Doe, "J"\nof Acme', "x", "y"]
    with pytest.raises(ParseError, match=r"data.csv:5: column 'a': expected a number, got 'four'$"):
        table.numbers(0)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("a,b\n1,2\n3\n", 3, r"expected 2 cells as in the header, got 1$"),
        ("a,b\n\n1,5,2,5\n", 3, r"expected 2 cells .*, got 4; decimal commas need ; or tab between the cells$"),
        ("a,b\n1,2\n3,oops\n", 3, r"column 'b': expected a number, got 'oops'$"),
        ("a,b\n1,2\n3," + "x" * 60 + "\n", 3, r"got 'x{40}\.\.\.'$"),
        ("a,b\n1,1_000\n", 2, r"column 'b': expected a number, got '1_000'$"),
        ("a,b\n1,inf\n", 2, r"column 'b': expected a number, got 'inf'$"),
        ("a,b\n1,1e999\n", 2, r"column 'b': expected a number, got '1e999'$"),
        ('a,b\n1,2\n3,"4\n', 3, r"cannot be read as CSV: unexpected end of data$"),
        ("a;b\n1,5;2\n3;4.5\n", 3, r"column 'b': expected a decimal comma as in column 'a', got '4.5'$"),
        ("a;b\n1,5;2\n3.5;4\n5.5;6\n", 2, r"column 'a': expected a decimal point as in column 'a', got '1,5'$"),
        ("a;b\n1.5;2\n3;4\n1.234,5;6\n", 4, r"column 'a': expected a decimal point as in column 'a', got '1.234,5'$"),
    ],
)
def test_what_is_wrong_in_a_row_is_named_with_its_line(tmp_path: Path, text: str, line: int, message: str) -> None:
    path = tmp_path / "data.csv"
    path.write_text(text)

    def read() -> None:
        table = read_table(path)
        table = table.exact() if table.exact else table
        table.numbers(0)
        table.numbers(1)

    with pytest.raises(ParseError, match=message) as caught:
        read()
    assert (caught.value.path, caught.value.line) == (str(path), line)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", r"is empty; expected a header"),
        (b"\xef\xbb\xbf", r"holds no rows"),
        (b" \n\n", r"holds no rows"),
        (b"a,b\n", r"holds no rows; expected rows of numbers below a header"),
        (b"a,b\n,\n ,\n", r"holds no rows"),
        (b"a,b,A\n1,2,3\n", r"column 'A' comes twice, as columns 1 and 3"),
        (b"a,b\n1,\x98\x81\xff\n", r"data: is neither UTF-8 nor says which encoding it has; name it with --encoding"),
        ("a,b\n1,2\n".encode("utf-16") + b"\0", r"data:\d: is no UTF-16 text: byte 0x00"),
        (b"a,b\n1,2\n3,\0\n", r"data:3: holds a NUL character"),
        (b"PAR1 but no more", r"is not a readable Parquet file: "),
        (b"PK\x03\x04 but no more", r"is not a readable Excel file: "),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", r"is an old Excel file \(xls\); save it as xlsx or CSV"),
        (b"a\n" + b"1" * 200_000 + b"_\n", r"data:2: cannot be read as CSV: field larger than field limit"),
    ],
)
def test_what_is_wrong_with_a_file_is_one_sentence(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "data"
    path.write_bytes(content)

    def read() -> None:
        table = read_table(path)
        if table.exact:
            table.exact()

    with pytest.raises(ParseError, match=message) as caught:
        read()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "why"), [("absent.csv", "there is no such file"), (".", "can be read, but a folder")])
def test_a_place_without_a_file_is_an_error(tmp_path: Path, name: str, why: str) -> None:
    with pytest.raises(ParseError, match=why):
        read_table(tmp_path / name)


def test_parquet(tmp_path: Path) -> None:
    path = tmp_path / "data.parquet"
    day = datetime.datetime(2026, 1, 2, tzinfo=datetime.UTC)
    columns = {
        "a": pa.array([1.5, None]),
        "b": pa.array([7, None], pa.int32()),
        "c": pa.array(["x", None]).dictionary_encode(),
        "d": pa.array([True, False]),
        "e": pa.array([day, None]),
        "f": pa.array([None, None], pa.null()),
    }
    pyarrow.parquet.write_table(pa.table(columns), path)
    table = read_table(path)
    np.testing.assert_array_equal(table.numbers(0), [1.5, np.nan])
    np.testing.assert_array_equal(table.numbers(1), [7.0, np.nan])
    assert table.labels(1) == ["7", ""]
    assert table.labels(2) == ["x", ""]
    np.testing.assert_array_equal(table.numbers(5), [np.nan, np.nan])
    for place, got in ((3, "'True'"), (4, "'2026-01-02 00:00:00")):
        with pytest.raises(ParseError, match=rf"data.parquet: data row 0, column '\w': expected a number, got {got}"):
            table.numbers(place)


def test_every_kind_of_number_of_a_parquet_file_with_empty_cells(tmp_path: Path) -> None:
    """Rows 3 to 40 of chunks of 7, so that an empty cell's bit stands anywhere in its byte."""
    rng = np.random.default_rng(0)
    whole = [None if rng.random() < 0.3 else int(value) for value in rng.integers(-1000, 1000, 40)]
    kinds = {"double": pa.float64(), "single": pa.float32(), "long": pa.int64(), "short": pa.int16()}
    cells = {name: pa.array(whole, kind) for name, kind in kinds.items()}
    cells |= {"decimal": pa.array([None if n is None else Decimal(n) for n in whole], pa.decimal128(10, 2))}
    for name, column in cells.items():
        got = column_from_arrow(pa.chunked_array([column.slice(at, 7) for at in range(3, 40, 7)]))
        assert np.array_equal(got, np.array(whole[3:], dtype=float), equal_nan=True), name
    most = pa.chunked_array([pa.array([2**63 - 1, 2**53 + 1], pa.int64())])
    assert column_from_arrow(most).tolist() == [float(2**63 - 1), float(2**53)]


def test_excel(tmp_path: Path) -> None:
    path = tmp_path / "data.xlsx"
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.title = "poses"
    for row in ([], ["a", "b", "c", None], [1.5, "x", 3], [], [None, 2.0, 4], [2, None, "5,5"]):
        sheet.append(row)
    book.create_sheet("notes").append(["not read"])
    book.save(path)
    table = read_table(path)
    assert table.names == ["a", "b", "c"]
    np.testing.assert_array_equal(table.numbers(0), [1.5, np.nan, 2.0])
    np.testing.assert_array_equal(table.numbers(2), [3.0, 4.0, 5.5])
    assert table.labels(1) == ["x", "2", ""]
    assert table.labels(0) == ["1.5", "", "2"]
    assert table.notes == ("sheet 'poses' is read; left out: 'notes'",)
    with pytest.raises(ParseError, match=r"data.xlsx:3: column 'b': expected a number, got 'x'"):
        table.numbers(1)


def test_an_excel_row_beyond_the_header_and_an_empty_sheet_are_errors(tmp_path: Path) -> None:
    path = tmp_path / "data.xlsx"
    book = openpyxl.Workbook()
    book.active.append(["a", "b"])
    book.active.append([1, 2])
    book.active.append([1, 2, 3])
    book.save(path)
    with pytest.raises(ParseError, match=r"data.xlsx:3: expected 2 cells as in the header, got 3"):
        read_table(path)
    openpyxl.Workbook().save(path)
    with pytest.raises(ParseError, match=r"sheet 'Sheet' is empty"):
        read_table(path)


def test_csv_comes_back_bit_for_bit(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    values = np.random.default_rng(0).normal(size=100) * 10.0 ** np.random.default_rng(1).integers(-300, 300, 100)
    values[3] = np.nan
    write_csv(path, {"row": range(100), "x_mm": values, "status": ["reached, with a comma"] * 100})
    table = read_table(path)
    np.testing.assert_array_equal(table.numbers(1), values)
    np.testing.assert_array_equal(table.numbers(0), np.arange(100))
    assert table.labels(2) == ["reached, with a comma"] * 100
    assert path.read_text().splitlines()[4] == '3,,"reached, with a comma"'


def test_csv_is_not_written_under_another_formats_name(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match=r"only CSV can be written"):
        write_csv(tmp_path / "out.xlsx", {"a": [1.0]})
    with pytest.raises(ValueError, match="longer"):
        write_csv(tmp_path / "out.csv", {"a": [1.0], "b": [1.0, 2.0]})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("text", ["=cmd|'/c calc'!A0", "@SUM(1)", "+1+2", "-2+3", "=1", "\t=1"])
def test_a_text_that_a_spreadsheet_would_run_is_quoted_and_comes_back(text: str, tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", {"name": [text, "P1"], "x": [1.0, -2.0]})
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        assert [row[0] for row in csv.reader(file)] == ["name", f"'{text}", "P1"]
    assert read_table(tmp_path / "a.csv").labels(0)[0] == text


@pytest.mark.parametrize("text", ["-1", "+1.5e3", "-", "P-1", "a=b", "'quoted'", "-inf"])
def test_other_texts_are_written_as_they_are(text: str, tmp_path: Path) -> None:
    write_csv(tmp_path / "a.csv", {"name": [text, "P1"]})
    assert (tmp_path / "a.csv").read_text().splitlines()[1] == text


def test_formulas_without_a_stored_value_are_refused_as_such(tmp_path: Path) -> None:
    """As openpyxl writes them, and with the 0 that XlsxWriter puts there; a formula that was calculated is a number."""
    book = openpyxl.Workbook()
    book.active.append(["a", "b", "name"])
    for row in range(2, 9):
        book.active.append([row, f"=A{row}*2" if row % 2 else row, "x"])
    path = tmp_path / "book.xlsx"
    book.save(path)
    table = read_table(path)
    np.testing.assert_array_equal(table.numbers(0), range(2, 9))
    said = r"book.xlsx:3: column 'b' holds formulas without a stored value, in 3 of 7 cells; open the workbook in a sp"
    with pytest.raises(ParseError, match=said):
        table.numbers(1)
    with pytest.raises(ParseError, match=said):
        table.labels(1)
    for stored, is_number in ((b"<v>0</v>", False), (b"<v>6</v>", True)):
        again = _with_stored(path, tmp_path / "stored.xlsx", stored)
        if is_number:
            np.testing.assert_array_equal(read_table(again).numbers(1), [2, 6, 4, 6, 6, 6, 8])
        else:
            np.testing.assert_array_equal(read_table(again).numbers(1), [2, 0, 4, 0, 6, 0, 8])  # three may well be 0
    for row in range(2, 9):
        book.active.cell(row, 2, f"=A{row}*2")
    book.save(path)
    with pytest.raises(ParseError, match="'b' holds formulas without a stored value, in 7 of 7 cells"):
        read_table(_with_stored(path, tmp_path / "stored.xlsx", b"<v>0</v>")).numbers(1)


def _with_stored(book: Path, out: Path, value: bytes) -> Path:
    """The workbook with a value beside each formula."""
    with zipfile.ZipFile(book) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            new.writestr(name, re.sub(rb"(</f>)<v ?/>|(</f>)<v></v>", rb"</f>" + value, old.read(name)))
    return out
