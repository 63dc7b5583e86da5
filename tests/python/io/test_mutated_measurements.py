# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Damaged files are read or refused in one sentence; nothing else is raised, and both ways through a file agree."""

import io
import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fastcal.errors import FastcalError
from fastcal.io import text_tables
from fastcal.io.measurements import load_measurements
from fastcal.io.text_tables import read_text_table
from fastcal.measurements.dataset import Dataset

ARM = SimpleNamespace(
    joint_types=["revolute"] * 2,
    limits=np.array([[-math.pi, math.pi]] * 2),
    mimics=(),
    beside=(),
    passive=(),
    follow=lambda q: q,
    reach=1.5,
    joint_count=2,
)
NAMES = ["q1_deg", "q2_deg", "x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz", "sigma_mm", "temperature_c", "station"]
ROWS = [[10.5, -20.25, 300.125, 40.0, -5e1, 0.6, 0.0, 0.8, 0.0, 0.04, 21.5, 1], [1.5, 2.5, 3.5, *[None] * 6, 1, 20, 2]]
TEXT = "\n".join(",".join("" if cell is None else str(cell) for cell in row) for row in [NAMES, *ROWS, *ROWS]) + "\n"
SEEDS = [TEXT.encode(), TEXT.replace(",", ";").replace(".", ",").encode("utf-8-sig"), TEXT.replace(",", "\t").encode()]
QUOTED = "".join(",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in TEXT.splitlines())
SEEDS.append(QUOTED.encode())
# What real files break by, beside single bytes.
PIECES = [
    b",",
    b";",
    b"\t",
    b"\n",
    b"\r\n",
    b'"',
    b".",
    b"-",
    b"e",
    b"_",
    b" ",
    b"nan",
    b"inf",
    b"1e999",
    b"\xff",
    b"\0",
]
PIECES += [
    "\N{MINUS SIGN}".encode(),
    "\N{NO-BREAK SPACE}".encode(),
    b"\xef\xbb\xbf",
    b"PAR1",
    b"PK\x03\x04",
    b"x_mm",
    b"_cm",
]


@st.composite
def mutants(draw: st.DrawFn, seeds: list[bytes]) -> bytes:
    """A file with one to six pieces cut out, doubled, swapped for others or put in."""
    content = draw(st.sampled_from(seeds))
    for _ in range(draw(st.integers(1, 6))):
        start = draw(st.integers(0, len(content)))
        end = draw(st.integers(start, min(len(content), start + draw(st.sampled_from([0, 1, 4, 40])))))
        piece = draw(st.one_of(st.sampled_from(PIECES), st.binary(max_size=3), st.just(content[start:end] * 2)))
        content = content[:start] + piece + content[end:]
    return content


def load(path: Path, content: bytes) -> Dataset | None:
    """The data set, or None where it was refused as it should be."""
    path.write_bytes(content)
    try:
        data = load_measurements(path, ARM)
    except FastcalError as error:
        refusal = str(error)
    else:
        refusal = None
    if refusal is not None:
        assert refusal.startswith(str(path))
        assert len(refusal.splitlines()) == 1
        return None
    assert np.isfinite(data.q).all()
    assert data.measured.any()
    return data


@pytest.fixture(autouse=True, scope="module")
def quick_way_for_small_files() -> Iterator[None]:
    """Files of a test are small, and the quick way is for large ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(text_tables, "QUICK_FROM", 0)
        yield


MANY = settings(
    max_examples=200, deadline=2000, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@MANY
@given(content=mutants(SEEDS))
def test_damaged_csv_is_read_or_refused(tmp_path: Path, content: bytes) -> None:
    load(tmp_path / "data.csv", content)


@MANY
@given(content=mutants(SEEDS))
@example(content=b'"q1_deg","q2_mm","x_mm","y_mm","z_mm"\n"1","2","3","";,"5"\n')  # an empty cell, then more
def test_both_ways_through_a_csv_read_the_same(content: bytes) -> None:
    try:
        table = read_text_table(content, "data.csv")
    except FastcalError:
        return
    if table.exact is None:
        return
    try:
        exact = table.exact()
    except FastcalError:
        pytest.fail("the quick way takes what the exact way refuses")
    assert list(table.names) == list(exact.names)
    for place, column in enumerate(table.columns):
        if isinstance(column, np.ndarray) and not np.isinf(column).any() and not np.isnan(column).all():
            np.testing.assert_array_equal(exact.numbers(place), column)


def parquet_file() -> bytes:
    sink = io.BytesIO()
    columns = dict(zip(NAMES, map(list, zip(*ROWS, strict=True)), strict=True))
    pyarrow.parquet.write_table(pa.table(columns), sink, compression="none")
    return sink.getvalue()


def excel_file() -> bytes:
    book, sink = openpyxl.Workbook(), io.BytesIO()
    for row in [NAMES, *ROWS]:
        book.active.append(row)
    book.save(sink)
    return sink.getvalue()


@settings(MANY, max_examples=100)
@given(content=mutants([parquet_file(), excel_file()]))
def test_damaged_binary_files_are_read_or_refused(tmp_path: Path, content: bytes) -> None:
    load(tmp_path / "data", content)


@pytest.mark.parametrize("content", [*SEEDS, parquet_file(), excel_file()])
def test_what_the_mutants_start_from_is_good(tmp_path: Path, content: bytes) -> None:
    data = load(tmp_path / "data", content)
    assert data is not None
    np.testing.assert_array_equal(data.position[:2], [[0.300125, 0.04, -0.05], [0.0035, np.nan, np.nan]])
