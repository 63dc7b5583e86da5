# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An export as a table of texts: titles, units and rows as the file has them, with what its dialect knows of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.importers.grid import NUMBER, THOUSANDS, Grid
from fastcal.importers.words import Title, meaning, unit_of
from fastcal.io.table import NO_VALUE, Uncalculated

NOT_MEASURED = frozenset({"", "nan", "na", "n/a", "#n/a", "#nv", "-", "--", "---", "*", "****", "null", "none"}) | {
    *("not measured", "missing", "invalid", "no target", "#value!", "#div/0!", "#ref!"),
    *("nicht gemessen", "n. gemessen", "n. gem.", "n.g.", "fehlt", "ungültig", "#wert!", "#bezug!"),
}


@dataclass(frozen=True)
class Export:
    """The table of an export.

    Attributes:
        grid: Where it was found.
        dialect: Whose export it is, for the summary.
        titles: The titles of the columns as a person sees them; "" where a column has none.
        meanings: What each column is; None where nothing is known of it.
        rows: The cells, as many a row as there are titles.
        lines: The line of each row.
        units: Units by kind (length, angle) that the file or its format's manual states for columns that name none.
        orientation: What three angles are, where the file or its format's manual says so.
        controller: Whether a controller wrote it, so that a pose called actual is what it computed.
        headed: Whether it has titles; without them columns are known by their number alone.
        mapped: Columns of the contract that a map names and this table has.
        notes: What a reader should know.
    """

    grid: Grid
    dialect: str
    titles: Sequence[str]
    meanings: Sequence[Title | None]
    rows: Sequence[Sequence[str]]
    lines: Sequence[int]
    units: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    orientation: str | None = None
    controller: bool = False
    headed: bool = True
    mapped: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()

    def column(self, place: int) -> list[str]:
        """The texts of a column."""
        return [row[place] for row in self.rows]

    def title(self, place: int) -> str:
        """A column for messages."""
        return f"'{self.titles[place]}'" if self.titles[place] else f"number {place + 1}"

    def numbers(self, place: int, rows: Sequence[int] | None = None) -> FloatArray:
        """A column as numbers, NaN where nothing was measured.

        Raises:
            ParseError: A cell holds something else, or decimal commas and points are mixed.
        """
        chosen = range(len(self.rows)) if rows is None else rows
        out = np.empty(len(chosen))
        marks: dict[str, list[int]] = {}
        for k, row in enumerate(chosen):
            cell = self.rows[row][place]
            if cell.lower() in NOT_MEASURED:
                out[k] = np.nan
                continue
            value = number(cell)
            if isinstance(cell, Uncalculated):
                self.check_calculated(place)
            if value is None:
                raise self.error(f"column {self.title(place)}: expected a number, got {cell[:40]!r}", row)
            for mark in ",.":
                if mark in cell and not ("," in cell and "." in cell):
                    marks.setdefault(mark, []).append(row)
            out[k] = value
        if len(marks) > 1:
            row = min(reversed(marks.values()), key=len)[0]  # the rarer mark is the slip; of two the later one
            cell = self.rows[row][place]
            raise self.error(f"column {self.title(place)} mixes decimal commas and points, as in '{cell:.40}'", row)
        return out

    def check_calculated(self, place: int) -> None:
        """Refuses a column with formulas that have no value.

        Raises:
            ParseError: Says how many, and where the first is.
        """
        bare = [row for row, cells in enumerate(self.rows) if isinstance(cells[place], Uncalculated)]
        if bare:
            message = NO_VALUE.format(count=f"in {len(bare)} of {len(self.rows)} cells")
            raise self.error(f"column {self.title(place)} {message}", bare[0])

    def error(self, message: str, row: int | None = None) -> ParseError:
        """An error with the file and the line of a row."""
        return self.grid.error(message, None if row is None else self.lines[row])


def is_value(cell: str) -> bool:
    """Whether a cell holds a number, or a formula of which the number is not known."""
    return number(cell) is not None or isinstance(cell, Uncalculated)


def number(cell: str) -> float | None:
    """The number in a cell: 1.5, 1,5, 1.234,5 or 1,234.5; None where there is none."""
    if NUMBER.fullmatch(cell):
        return float(cell.replace(",", "."))
    if THOUSANDS.fullmatch(cell):
        thousands = "." if cell.rindex(",") > cell.rindex(".") else ","
        return float(cell.replace(thousands, "").replace(",", "."))
    return None


def with_units(titles: Sequence[str], units: Sequence[str]) -> list[Title | None]:
    """The meanings of titles, with the units of a row of units where the titles state none."""
    out: list[Title | None] = []
    for title, unit in zip(titles, units, strict=True):
        found = meaning(title) if title else None
        if unit and unit_of(unit):
            # The unit belongs to the title before it is read: X in degrees is an angle about x.
            found = meaning(f"{title} [{unit}]") if title else None
        out.append(found)
    return out
