# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""CSV as instruments and spreadsheets write it: comma, semicolon or tab; decimal point or comma; with or without a BOM.

There are two ways through a file. The quick one (Arrow's) takes large tables of plain numbers and knows no lines;
whatever it does not take at once, small files, and every file in which something is wrong, go the exact way, which
does.
"""

from __future__ import annotations

import codecs
import csv
import io
import re
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import ParseError, TooLarge
from fastcal.io.table import EMPTY, Table, without_blank_columns

MAX_BYTES = 64_000_000
MAX_COLUMNS = 10_000
QUICK_FROM = 400_000  # bytes: below, importing Arrow takes longer than the exact way
_CHUNK = 200_000  # bytes: what the quotes of a file are looked at in; what is made of them stays in the cache
LABELS = frozenset({"station", "mount", "anchor"})  # 007 stays 007 in these


def read_text_table(content: bytes, path: str) -> Table:
    """Reads the content of a CSV file; `path` is for the errors.

    Raises:
        ParseError: It is no UTF-8 text, a row has more or fewer cells than the header, a quote is not closed.
    """
    if len(content) > MAX_BYTES:
        message = f"expected a CSV file of at most {MAX_BYTES} bytes, got {len(content)}; save it as Parquet"
        raise TooLarge(message, path)
    content = content.removeprefix(codecs.BOM_UTF8)
    try:
        if not content.isascii():
            content.decode()
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise ParseError("is not UTF-8 text; save it as CSV in UTF-8, or as Parquet or xlsx", path, line) from None
    if b"\0" in content:
        line = content.count(b"\n", 0, content.index(b"\0")) + 1
        raise ParseError("holds a NUL character; expected a text file", path, line)
    lines = (line[0].decode() for line in re.finditer(rb"[^\r\n]+", content))
    header = next((line for line in lines if line.strip()), "")
    separator = next((mark for mark in ";\t" if mark in header), ",")
    if header.count(separator) >= MAX_COLUMNS:
        raise TooLarge(f"expected at most {MAX_COLUMNS} columns, got {header.count(separator) + 1}", path)
    exact = partial(_read_exactly, content, separator, path)
    quick = _read_quickly(content, separator, path, header, exact) if len(content) >= QUICK_FROM else None
    return quick or exact()


def _read_exactly(content: bytes, separator: str, path: str) -> Table:
    reader = csv.reader(io.StringIO(content.decode(), newline=""), delimiter=separator, strict=True)
    names: list[str] = []
    rows: list[list[str]] = []
    lines: list[int] = []
    line = 1
    try:
        for row in reader:
            if any(map(str.strip, row)):  # spreadsheets leave rows of bare separators behind
                if not names:
                    names = row
                elif len(row) != len(names):
                    hint = "; decimal commas need ; or tab between the cells" if len(row) > len(names) else ""
                    message = f"expected {len(names)} cells as in the header, got {len(row)}{hint}"
                    raise ParseError(message, path, line)
                else:
                    rows.append(row)
                    lines.append(line)
            line = reader.line_num + 1
    except csv.Error as error:
        raise ParseError(f"cannot be read as CSV: {error}", path, line) from None
    columns = list(zip(*rows, strict=True)) or [()] * len(names)
    return Table(path, *without_blank_columns(names, columns), lines=lines)


def _read_quickly(content: bytes, separator: str, path: str, header: str, exact: partial[Table]) -> Table | None:
    """The table if all its rows are of one length and no quoted cell goes over a line's end; else None."""
    import pyarrow as pa
    import pyarrow.csv

    from fastcal.io.arrow import column_from_arrow

    quoted = b'"' in content
    if quoted and not _quotes_hold_cells(content, separator):
        return None  # a quote that opens or ends no cell: the exact way refuses it, or knows better
    names = next(csv.reader([header], delimiter=separator)) if quoted else header.split(separator)
    comma = separator != "," and b"," in content
    try:
        found = pyarrow.csv.read_csv(
            pa.BufferReader(content),
            pyarrow.csv.ReadOptions(use_threads=False),
            pyarrow.csv.ParseOptions(delimiter=separator, quote_char='"' if quoted else False),
            pyarrow.csv.ConvertOptions(
                column_types={name: pa.string() for name in names if name.strip().lower() in LABELS},
                null_values=sorted(EMPTY | {empty.upper() for empty in EMPTY} | {"NaN"}),
                decimal_point="," if comma else ".",
            ),
        )
    except pa.ArrowException:
        return None
    if any(pa.types.is_boolean(kind) or pa.types.is_temporal(kind) for kind in found.schema.types):
        return None  # what Arrow takes for a date or a truth value may not come back as it was written
    titles, columns = found.column_names, [column_from_arrow(column) for column in found.columns]
    del found
    pa.default_memory_pool().release_unused()  # of which it would keep twice the file's size
    return Table(path, *without_blank_columns(titles, columns), exact=exact)


def _quotes_hold_cells(content: bytes, separator: str) -> bool:
    """Does every quote open or end a cell, or stand doubled inside one, and does every cell end in its line?"""
    start = 0
    while start < len(content):
        end = content.find(b"\n", start + _CHUNK) + 1 or len(content)
        if not _quotes_hold_cells_of(np.frombuffer(content, np.uint8, end - start, start), ord(separator)):
            return False
        start = end
    return True


def _quotes_hold_cells_of(lines: NDArray[np.uint8], separator: int) -> bool:
    """The same of some lines.

    The first of two quotes follows a separator, a line's end or a quote, the second is followed by one: a doubled quote
    ends its cell and opens it again.
    """
    quote, is_end = lines == ord('"'), (lines == ord("\n")) | (lines == ord("\r"))
    marks, ends = np.flatnonzero(quote), np.flatnonzero(is_end)
    may_touch = np.pad(quote | is_end | (lines == separator), 1, constant_values=True)  # a quote on its outside
    in_cell = (np.searchsorted(marks, ends) % 2).any()
    outside = may_touch[marks[::2]].all() and may_touch[marks[1::2] + 2].all()
    return bool(len(marks) % 2 == 0 and not in_cell and outside)
