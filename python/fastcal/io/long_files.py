# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measurement files of more rows than memory should hold: Parquet and CSV, read part by part."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from fastcal.errors import ParseError
from fastcal.io import inputs
from fastcal.io.columns import JOINT_TITLE
from fastcal.io.measurements import RowCounts, dataset_of
from fastcal.io.table import Table, unreadable, without_arrow, without_blank_columns
from fastcal.io.text_tables import is_remark, is_row_of_numbers, read_text_table, without_remarks
from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import PART_ROWS, LongDataset
from fastcal.measurements.observations import expected_columns

LONG_CELLS = 10_000_000  # of a Parquet file: a million rows of joints, point and a condition
LONG_BYTES = 64_000_000  # of a CSV file
_BLOCK = 16_000_000  # bytes of a CSV that are read at once
_HEADER = 1_000_000  # bytes in which the header of a CSV ends


def is_long(path: str | os.PathLike[str]) -> bool:
    """Is it a measurement file that should be read part by part?"""
    try:
        found = Path(path).stat()
        if not stat.S_ISREG(found.st_mode):
            return False
        with Path(path).open("rb") as file:
            first = file.read(4)
            if first == b"PAR1":
                # A cell takes a fraction of a byte at least; the metadata alone know how many there are.
                return found.st_size > LONG_CELLS // 10 and _cells(path) > LONG_CELLS
            if found.st_size <= LONG_BYTES or first == b"PK\x03\x04" or first == b"\xd0\xcf\x11\xe0":
                return False
            return JOINT_TITLE.search((first + file.read(_HEADER)).decode(errors="replace")) is not None
    except (OSError, ValueError):
        return False  # who reads it says what is wrong with it


def open_measurements(
    path: str | os.PathLike[str], robot: RobotFacts, *, seen: Callable[[Dataset], Dataset] | None = None
) -> LongDataset:
    """Reads a CSV or Parquet file of measured poses, as many rows as there are, some at a time.

    Its rows are checked like those of `load_measurements` and kept in temporary files, 8 bytes a number.

    Args:
        path: The file.
        robot: The arm that was measured.
        seen: Makes of a part of the rows what is kept of it, such as the standard deviations of an instrument.

    Raises:
        ParseError: The file or something in it is invalid; one sentence with file, line and column.
        InvalidInput: There is no place for its rows.
    """
    name = os.fspath(path)
    rows = LongDataset(source=name, joint_types=robot.joint_types)
    counts = RowCounts(robot)
    notes: dict[str, None] = {}
    texts: set[str] = set()
    is_measured = False
    for table in _tables(path, name):
        part = dataset_of(table, robot, False, counts)
        is_measured = is_measured or bool(part.measured.any())
        notes |= dict.fromkeys(part.notes)
        texts |= part.extra_labels.keys()
        rows.append(part if seen is None else seen(part))
    if not len(rows):
        raise ParseError("holds no rows; expected rows of numbers below a header", name)
    if not is_measured:
        raise ParseError(f"holds nothing measured; expected numbers in {expected_columns()}", name)
    for title in texts:
        notes.pop(f"column '{title}' is not known and is kept as it is", None)
    left_out = [f"column '{title}' holds text and is left out of a file of so many rows" for title in sorted(texts)]
    rows.notes = (*notes, *left_out, *counts.notes())
    return rows


def _tables(path: str | os.PathLike[str], name: str) -> Iterator[Table]:
    try:
        with Path(path).open("rb") as file:
            inputs.note(os.fstat(file.fileno()))
            is_parquet = file.read(4) == b"PAR1"
    except (OSError, ValueError) as error:
        raise ParseError(f"cannot be read: {getattr(error, 'strerror', None) or error}", path) from None
    return _parquet_tables(path, name) if is_parquet else _text_tables(path, name)


def _cells(path: str | os.PathLike[str]) -> int:
    """How many cells a Parquet file of measurements has, 0 where it is none."""
    try:
        import pyarrow as pa
        import pyarrow.parquet
    except ImportError:
        return 0

    try:
        size = pyarrow.parquet.read_metadata(path)
    except (pa.ArrowException, OSError):
        return 0
    own = JOINT_TITLE.search(" ".join(size.schema.names)) is not None
    return int(size.num_rows * size.num_columns) if own else 0


def _parquet_tables(path: str | os.PathLike[str], name: str) -> Iterator[Table]:
    try:
        import pyarrow as pa
        import pyarrow.parquet
    except ImportError:
        raise without_arrow(name) from None

    from fastcal.io.arrow import column_from_arrow

    first = 0
    try:
        with pyarrow.parquet.ParquetFile(path, buffer_size=1 << 20, pre_buffer=False) as file:
            for batch in file.iter_batches(PART_ROWS, use_threads=False):
                columns = [column_from_arrow(pa.chunked_array([column])) for column in batch.columns]
                yield Table(name, *without_blank_columns(batch.schema.names, columns), first_row=first)
                first += batch.num_rows
    except (pa.ArrowException, OSError) as error:
        raise unreadable("Parquet", error, name) from None


def _text_tables(path: str | os.PathLike[str], name: str) -> Iterator[Table]:
    """Tables of whole lines below the header of a CSV file."""
    with Path(path).open("rb") as file:
        top, line = b"", b""
        while not line.strip() or is_remark(line):
            line = file.readline(_HEADER)
            if not line:
                raise ParseError("is empty; expected a header and rows of numbers", name)
            top += line
        # The last remark is the header where a row of numbers follows it.
        rest = line if top.strip() != line.strip() and is_row_of_numbers(line) else b""
        header = without_remarks(top)
        header = header[: len(header) - len(rest)]
        lines = header.count(b"\n")
        above = lines
        while block := file.read(_BLOCK):
            whole, rest = _whole_lines(rest + block, name)
            if whole.strip(b"\r\n ,;\t"):
                yield _text_table(header + whole, name, lines - above)
            lines += whole.count(b"\n")
        if rest.strip(b"\r\n ,;\t"):
            yield _text_table(header + rest, name, lines - above)


def _whole_lines(text: bytes, name: str) -> tuple[bytes, bytes]:
    """Lines with all their quotes closed, and what follows them."""
    end = text.rfind(b"\n") + 1
    while end and text.count(b'"', 0, end) % 2:
        end = text.rfind(b"\n", 0, end - 1) + 1
    if not end and len(text) > 4 * _BLOCK:
        raise ParseError(f"expected lines, got {len(text)} bytes without one that ends", name)
    return text[:end], text[end:]


def _text_table(content: bytes, name: str, skipped: int) -> Table:
    """The table of a header and lines, `skipped` lines of the file between them."""
    try:
        content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1 + skipped
        raise ParseError("is not UTF-8 text; a file of so many rows is read in UTF-8 alone", name, line) from None

    def placed(read: Callable[[], Table]) -> Table:
        try:
            table = read()
        except ParseError as error:
            raise type(error)(error.message, name, None if error.line is None else error.line + skipped) from None
        lines = None if table.lines is None else [line + skipped for line in table.lines]
        return replace(table, lines=lines, exact=None if table.exact is None else partial(placed, table.exact))

    return placed(partial(read_text_table, content, name))
