# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The cells of an export before anyone knows what they mean: text of any encoding, or a sheet of a workbook."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fastcal.errors import ParseError
from fastcal.io.text_encoding import decoded

NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
THOUSANDS = re.compile(r"[-+]?\d{1,3}(\.\d{3})+,\d+|[-+]?\d{1,3}(,\d{3})+\.\d+")
COMMENT_MARKS = ("//", "#", "%", "!")
_RULER = re.compile(r"[|+][-=+|: ]*-[-=+|: ]*[|+]|[-=_]{4,}")  # a line of a table that is drawn
_LONGEST = 2000  # characters of a row in which words are looked for
_ENOUGH = 400  # lines that decide on the separator
_NEARLY = 0.7  # of the numbers that the best separator finds: a rarer separator wins by convention


@dataclass(frozen=True)
class Row:
    """A row of cells and its line, from 1; comments lose their mark."""

    line: int
    cells: tuple[str, ...]
    comment: bool = False

    @property
    def blank(self) -> bool:
        """Whether no cell holds anything."""
        return not any(self.cells)


@dataclass(frozen=True)
class Grid:
    """One table of cells, maybe with titles above and remarks below.

    Attributes:
        path: The file, for messages.
        rows: All rows, empty ones too.
        text: The whole text, for exports that are no tables; a sheet has none.
        sheet: The name of the sheet of a workbook.
        notes: What a reader should know of how it was read.
    """

    path: str
    rows: tuple[Row, ...]
    text: str = ""
    sheet: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def opening(self) -> str:
        """The first rows as one text, in which an export names its maker, its units and its conventions."""
        return "\n".join(" ".join(row.cells)[:_LONGEST] for row in self.rows[:40])

    def error(self, message: str, line: int | None = None) -> ParseError:
        """An error that names the file and, where it helps, the sheet and the line."""
        return ParseError(message if self.sheet is None else f"sheet '{self.sheet}': {message}", self.path, line)


def export_text(content: bytes, path: str, encoding: str | None = None) -> tuple[str, tuple[str, ...]]:
    """The text of a file, and a sentence where its encoding was guessed.

    Raises:
        ParseError: It is no text, or a web page.
    """
    text, notes = decoded(content, path, encoding)
    text = text.removeprefix("\ufeff")
    if text.lstrip()[:15].lower().startswith(("<!doctype html", "<html")):
        raise ParseError("is a web page (HTML); expected a table as text, Excel or Parquet", path)
    return text, notes


def text_grid(text: str, path: str, notes: tuple[str, ...] = ()) -> Grid:
    """The cells of a text: separated by tab, semicolon, bar, comma or blanks, whichever gives the most numbers."""
    lines = re.split(r"\r\n|\r|\n", text.replace("\N{MINUS SIGN}", "-"))
    split, separator = _separation([line for line in lines if line.strip()])
    marks = COMMENT_MARKS if separator == ";" else (*COMMENT_MARKS, ";")
    rows = []
    for number, line in enumerate(lines, start=1):
        bare = line.strip()
        if _RULER.fullmatch(bare):
            rows.append(Row(number, ()))
            continue
        comment = next((mark for mark in marks if bare.startswith(mark)), None)
        rest = bare[len(comment) :].strip() if comment else line
        if comment and rest[:1] == separator.strip():  # a column may be titled # or %
            comment, rest = None, line
        rows.append(Row(number, split(rest), comment is not None))
    return Grid(path, tuple(rows), text, notes=notes)


def _separation(lines: Sequence[str]) -> tuple[Callable[[str], tuple[str, ...]], str]:
    """How to split a line, and the separator."""
    middle = max(0, len(lines) // 2 - _ENOUGH // 2)
    sample = lines[middle : middle + _ENOUGH]
    ways: list[tuple[str, Callable[[str], tuple[str, ...]]]] = [
        *((mark, _by_mark(mark)) for mark in "\t;|,"),
        ("  ", _by_wide_blanks),
        (" ", _by_blanks),
    ]
    found = []
    for separator, split in ways:
        cells = [split(line) for line in sample]
        numbers = sum(_is_number(cell) for row in cells for cell in row)
        widths = Counter(map(len, cells))
        even = max(widths.values()) / len(cells) if cells else 0.0
        found.append((0 if separator == "  " and even < 0.9 else numbers, separator, split))
    most = max(count for count, _, _ in found)
    return next((split, separator) for count, separator, split in found if count >= _NEARLY * most)


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(cell) is not None or THOUSANDS.fullmatch(cell) is not None


def _by_mark(mark: str) -> Callable[[str], tuple[str, ...]]:
    def split(line: str) -> tuple[str, ...]:
        if '"' not in line:
            return tuple(cell.strip() for cell in line.split(mark))
        return tuple(cell.strip() for cell in next(csv.reader(io.StringIO(line), delimiter=mark), []))

    return split


def _by_wide_blanks(line: str) -> tuple[str, ...]:
    """At two blanks or more, so that names may hold one."""
    return tuple(re.split(r"\s{2,}", line.strip()))


def _by_blanks(line: str) -> tuple[str, ...]:
    """At blanks; a unit in brackets belongs to the word before it."""
    return tuple(re.sub(r"(?<!\s)\s+([\[(])", r"\1", line.strip()).split())
