# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A table as files hold it: named columns of numbers or texts, and the place of every cell for the errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import ParseError

Cells = FloatArray | Sequence[str]
EMPTY = frozenset({"", "nan", "na", "n/a", "#n/a"})  # what an empty cell may hold, in any case
_FORMULA = ("=", "+", "-", "@", "\t")  # with which a formula begins (OWASP, CSV injection)
LONGEST_QUOTE = 40  # characters of a cell that an error repeats


def is_formula(text: str) -> bool:
    """Would a spreadsheet that opens a CSV file run this text? A number with its sign is none."""
    if not text.startswith(_FORMULA):
        return False
    try:
        float(text)
    except ValueError:
        return len(text) > 1
    return False


def _plain(text: str) -> str:
    """A text without the apostrophe that keeps a spreadsheet from running it."""
    return text[1:] if text.startswith("'") and is_formula(text[1:]) else text


class Uncalculated(str):
    """The cell of a workbook with a formula whose value is not saved, as programs write it that do not calculate."""

    __slots__ = ()


NO_VALUE = "holds formulas without a stored value, {count}; open the workbook in a spreadsheet program and save it"


@dataclass(frozen=True)
class Table:
    """Named columns of one length, at least one of each.

    Attributes:
        path: The file it came from.
        names: A name a column, no two the same.
        columns: Numbers (NaN where empty), or the texts of the cells.
        lines: The line of the file, from 1, of each row; None where unknown or where it has no lines.
        first_row: Of the file that its first row is.
        exact: Reads the same file by the slow way that knows the lines; None where this is that way. A table that
            has it gives numbers only of columns that hold numbers.
        notes: What a reader should know, a sentence each.
        titles: What the file calls the columns, where `names` are what one arm's file would; empty: the names.
    """

    path: str
    names: Sequence[str]
    columns: Sequence[Cells]
    lines: Sequence[int] | None = None
    first_row: int = 0
    exact: Callable[[], Table] | None = None
    notes: tuple[str, ...] = ()
    titles: Sequence[str] = ()
    _first_with_mark: dict[str, int] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        seen: dict[str, int] = {}
        for place, name in enumerate(self.names, start=1):
            first = seen.setdefault(name.lower(), place)
            if first != place and self.titles:
                both = " and ".join(f"'{self.titles[at - 1]:.60}'" for at in (first, place))
                raise self.error(f"columns {both} both give {name:.60}; expected one of them")
            if first != place:
                raise self.error(f"column '{name:.60}' comes twice, as columns {first} and {place}")
        if not self.columns or len(self) == 0:
            raise self.error("holds no rows; expected rows of numbers below a header")

    def __len__(self) -> int:
        return len(self.columns[0])

    def title(self, place: int) -> str:
        """What the file calls a column."""
        return self.titles[place] if self.titles else self.names[place]

    def numbers(self, place: int) -> FloatArray:
        """A column as numbers, NaN where a cell is empty.

        Raises:
            ParseError: A cell holds something else, or the file mixes decimal commas and points.
        """
        cells = self.columns[place]
        if isinstance(cells, np.ndarray):
            values = cells
        elif self.exact is not None:
            raise self.wrong_cell(place, 0, "a number")
        else:
            text = "\n".join(cells)
            self._check_decimal_mark(place, text, cells)
            cells = [cell.replace(",", ".") for cell in cells] if "," in text else cells
            values = _numbers(cells, plain="_" not in text)
        wrong = np.isinf(values)
        if wrong.any():
            raise self.wrong_cell(place, int(np.argmax(wrong)), "a number")
        return values

    def labels(self, place: int) -> list[str]:
        """A column as texts, "" where a cell is empty; the number 3.0 is the label 3, as a sheet makes one of it.

        Raises:
            ParseError: A cell is a formula without a value.
        """
        cells = self.columns[place]
        if not isinstance(cells, np.ndarray) and any(isinstance(cell, Uncalculated) for cell in cells):
            raise self.wrong_cell(place, 0, "a text")
        if isinstance(cells, np.ndarray):
            return ["" if math.isnan(value) else f"{value:.17g}" for value in cells.tolist()]
        return ["" if cell.lower() in EMPTY else _plain(cell) for cell in map(str.strip, cells)]

    def wrong_cell(self, place: int, row: int, expected: str, got: str | None = None) -> ParseError:
        """The error for a cell: where it is, what was expected and what came."""
        cells = self.columns[place]
        if bare := [k for k, cell in enumerate(cells) if isinstance(cell, Uncalculated)]:
            message = NO_VALUE.format(count=f"in {len(bare)} of {len(cells)} cells")
            return self.error(f"column '{self.title(place):.60}' {message}", bare[0])
        return self.error(
            f"column '{self.title(place):.60}': expected {expected}, got {got or self._cell(place, row)}", row
        )

    def error(self, message: str, row: int | None = None) -> ParseError:
        """An error that names the file and, where one is given, the line or else the row."""
        if row is None:
            return ParseError(message, self.path)
        if self.lines is None:
            return ParseError(f"data row {self.first_row + row}, {message}", self.path)
        return ParseError(message, self.path, self.lines[row])

    def _cell(self, place: int, row: int) -> str:
        cell = self.columns[place][row]
        text = cell.strip() if isinstance(cell, str) else "" if math.isnan(cell) else f"{cell:.6g}"
        if text == "":
            return "an empty cell"
        return repr(text if len(text) <= LONGEST_QUOTE else text[:LONGEST_QUOTE] + "...")

    def _check_decimal_mark(self, place: int, text: str, cells: Sequence[str]) -> None:
        """One file has one decimal mark, or 1,234 could be read two ways; of two in a column the rarer is the slip."""
        rows = {mark: [row for row, cell in enumerate(cells) if mark in cell] for mark in ",." if mark in text}
        if not rows:
            return
        if not self._first_with_mark:
            self._first_with_mark[max(rows, key=lambda mark: (len(rows[mark]), -rows[mark][0]))] = place
        ((usual, first),) = self._first_with_mark.items()
        other, word = (".", "comma") if usual == "," else (",", "point")
        if other in rows:
            raise self.wrong_cell(place, rows[other][0], f"a decimal {word} as in column '{self.title(first):.60}'")


def unreadable(kind: str, error: Exception, path: str) -> ParseError:
    """The error for a file that its decoder gives up, with the first line of what the decoder says."""
    reason = str(error).strip().splitlines() or [type(error).__name__]
    return ParseError(f"is not a readable {kind} file: {reason[0]:.200}", path)


def without_arrow(path: str) -> ParseError:
    """The error for a Parquet file where the package that reads them is not installed."""
    return ParseError(
        "is a Parquet file, which needs the package pyarrow: pip install 'fastcal[parquet]', or save it as CSV", path
    )


def without_blank_columns(names: Sequence[str], columns: Sequence[Cells]) -> tuple[list[str], list[Cells]]:
    """Leaves out columns without name and content, as spreadsheets leave behind, and names those without name only.

    Names lose line ends and spaces around and in a row, so that every error is one line.
    """
    names = [" ".join(name.split()) for name in names]
    kept = [
        (name or f"unnamed{place}", column)
        for place, (name, column) in enumerate(zip(names, columns, strict=True), start=1)
        if name or not _is_blank(column)
    ]
    return [name for name, _ in kept], [column for _, column in kept]


def _is_blank(column: Cells) -> bool:
    if isinstance(column, np.ndarray):
        return bool(np.isnan(column).all())
    return not any(map(str.strip, column))


def _numbers(cells: Sequence[str], *, plain: bool) -> FloatArray:
    """The numbers in cells, NaN where one is empty, infinite where one holds anything else; `plain`: no 1_000."""
    try:
        if plain:
            return np.array(list(map(float, cells)))
    except ValueError:
        pass  # not all are plain numbers
    return np.array([_number(cell) for cell in cells])


def _number(cell: str) -> float:
    if cell.strip().lower() in EMPTY:
        return math.nan
    try:
        # float() alone takes 1_000, which no instrument writes.
        return math.inf if "_" in cell else float(cell)
    except ValueError:
        return math.inf
