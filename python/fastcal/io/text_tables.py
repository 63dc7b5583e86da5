# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""CSV as instruments and spreadsheets write it: comma, semicolon, tab, bar or blanks; decimal point or comma.

There are two ways through a file. The quick one (Arrow's) takes large tables of plain numbers and knows no lines;
whatever it does not take at once, small files, and every file in which something is wrong, go the exact way, which
does.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import ParseError, TooLarge
from fastcal.io.table import EMPTY, Table, without_blank_columns
from fastcal.io.text_encoding import decoded

MAX_BYTES = 64_000_000
MAX_COLUMNS = 10_000
QUICK_FROM = 400_000  # bytes: below, importing Arrow takes longer than the exact way
_CHUNK = 200_000  # bytes: what the quotes of a file are looked at in; what is made of them stays in the cache
LABELS = frozenset({"station", "mount", "anchor"})  # 007 stays 007 in these
_LINES = re.compile(rb"[^\r\n]*[^\r\n\t ][^\r\n]*")  # that hold anything
_REMARK = re.compile(rb"[ \t]*(?:#|%|//)+(?![ \t]*[,;\t|])[ \t]*")
_MARKED = tuple(end + mark for end in (b"\n", b"\r") for mark in (b"#", b"%", b"//"))
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_RULER = re.compile(r"\s*(:?-+:?)?\s*")  # of a table between bars, below its header


def read_text_table(content: bytes, path: str) -> Table:
    """Reads the content of a CSV file; `path` is for the errors.

    Raises:
        ParseError: It is no text, a row has more or fewer cells than the header, a quote is not closed.
    """
    if len(content) > MAX_BYTES:
        message = f"expected a CSV file of at most {MAX_BYTES} bytes, got {len(content)}; save it as Parquet"
        raise TooLarge(message, path)
    notes: tuple[str, ...] = ()
    if not content.isascii() or b"\0" in content:
        text, notes = decoded(content, path)
        content = text.removeprefix("\ufeff").encode("utf-8", "surrogatepass")
        del text
    content = without_remarks(content)
    header = next((line[0].decode() for line in _LINES.finditer(content)), "")
    separator = separator_of(header)
    if header.count(separator) >= MAX_COLUMNS:
        raise TooLarge(f"expected at most {MAX_COLUMNS} columns, got {header.count(separator) + 1}", path)
    exact = partial(_read_exactly, content, separator, path)
    is_quick = len(content) >= QUICK_FROM and separator != " " and not any(mark in content for mark in _MARKED)
    quick = _read_quickly(content, separator, path, header, exact) if is_quick else None
    return _with_notes(notes, quick or exact())


def _with_notes(notes: tuple[str, ...], table: Table) -> Table:
    """The table with notes before its own, also where it is read again the exact way."""
    if not notes:
        return table
    exact: Callable[[], Table] | None = table.exact
    again = None if exact is None else lambda: _with_notes(notes, exact())
    return replace(table, notes=(*notes, *table.notes), exact=again)


def separator_of(header: str) -> str:
    """What stands between the cells of a header; blanks where nothing else does."""
    usual = next((mark for mark in ";\t" if mark in header), max(",|", key=header.count))
    return usual if usual in header or len(header.split()) < 2 else " "


def without_remarks(content: bytes) -> bytes:
    """The text with its header first: remarks above it become empty lines, and a header behind a mark loses that.

    As NumPy (#) and MATLAB (%) write it, the header is the last remark above the first row of numbers; where a row of
    titles without a mark follows the remarks, that is the header.
    """
    remarks: list[re.Match[bytes]] = []
    for line in _LINES.finditer(content):
        if not is_remark(line[0]):
            break
        remarks.append(line)
    else:
        return content
    if not remarks:
        return content
    titles = b"" if not is_row_of_numbers(line[0]) else _REMARK.sub(b"", remarks[-1][0], count=1)
    out = re.sub(rb"[^\r\n]+", b"", content[: line.start()])
    kept = content[remarks[-1].end() : line.start()] if titles else b""
    above = re.sub(rb"[^\r\n]+", b"", content[: remarks[-1].start()]) + titles if titles else out
    return above + kept + content[line.start() :]


def is_remark(line: bytes) -> bool:
    """Whether a line begins with the mark of a remark; a column may be titled # or %."""
    return _REMARK.match(line) is not None


def is_row_of_numbers(line: bytes) -> bool:
    """Whether more than half of a line's cells are numbers."""
    text = line.decode(errors="replace")
    separator = separator_of(text)
    cells = [cell.strip().replace(",", ".") for cell in (text.split() if separator == " " else text.split(separator))]
    return bool(cells) and 2 * sum(_NUMBER.fullmatch(cell) is not None for cell in cells) > len(cells)


def _read_exactly(content: bytes, separator: str, path: str) -> Table:
    text = content.decode()
    lines_in = io.StringIO(_with_tabs(text) if separator == " " else text, newline="")
    reader = csv.reader(lines_in, delimiter="\t" if separator == " " else separator, strict=True)
    names: list[str] = []
    rows: list[list[str]] = []
    lines: list[int] = []
    remarks: list[int] = []
    line = 1
    try:
        for row in reader:
            if any(map(str.strip, row)):  # spreadsheets leave rows of bare separators behind
                if not names:
                    names = row
                elif len(row) != len(names) and is_remark(row[0].encode()):
                    remarks.append(line)
                elif len(row) != len(names):
                    hint = "; decimal commas need ; or tab between the cells" if len(row) > len(names) else ""
                    message = f"expected {len(names)} cells as in the header, got {len(row)}{hint}"
                    raise ParseError(message, path, line)
                elif separator != "|" or not all(map(_RULER.fullmatch, row)):
                    rows.append(row)
                    lines.append(line)
            line = reader.line_num + 1
    except csv.Error as error:
        raise ParseError(f"cannot be read as CSV: {error}", path, line) from None
    rows, lines, remarks = _without_rows_behind_marks(rows, lines, remarks)
    columns = list(zip(*rows, strict=True)) or [()] * len(names)
    some = ", ".join(map(str, remarks[:6])) + (", ..." if len(remarks) > 6 else "")
    notes = (f"left out, as they begin with the mark of a remark: lines {some}",) if remarks else ()
    return Table(path, *without_blank_columns(names, columns), lines=lines, notes=notes)


def _without_rows_behind_marks(
    rows: list[list[str]], lines: list[int], remarks: list[int]
) -> tuple[list[list[str]], list[int], list[int]]:
    """Rows that somebody has put a mark before are left out; where all have one, it belongs to their names."""
    marked = [is_remark(row[0].encode()) for row in rows]
    if not any(marked) or all(marked):
        return rows, lines, remarks
    kept = [place for place, is_marked in enumerate(marked) if not is_marked]
    out = [line for line, is_marked in zip(lines, marked, strict=True) if is_marked]
    return [rows[place] for place in kept], [lines[place] for place in kept], sorted([*remarks, *out])


def _with_tabs(text: str) -> str:
    """Lines of cells between blanks, with tabs there."""
    return re.sub(r"[^\r\n]+", lambda line: "\t".join(line[0].split()), text)


def _read_quickly(content: bytes, separator: str, path: str, header: str, exact: partial[Table]) -> Table | None:
    """The table if its rows are of one length, no quoted cell goes over a line's end and Arrow is there; else None."""
    try:
        import pyarrow as pa
        import pyarrow.csv
    except ImportError:
        return None

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
