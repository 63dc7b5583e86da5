# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a dialect is: how an export is known, and how it is read."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from fastcal.importers.export import Export, with_units
from fastcal.importers.grid import Grid
from fastcal.importers.layout import read_table


@dataclass(frozen=True)
class Dialect:
    """The exports of one maker.

    Attributes:
        name: The maker and the kind, for the summary.
        recognizes: Whether a grid is one of these exports.
        read: Reads one; the general table reader where the export is a plain table.
        units: Units by kind that the maker's manual states for columns that name none.
        orientation: What its three angles are, by its manual.
        controller: Whether a robot controller writes it.
    """

    name: str
    recognizes: Callable[[Grid], bool]
    read: Callable[[Grid], Export] = read_table
    units: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    orientation: str | None = None
    controller: bool = False

    def export(self, grid: Grid) -> Export:
        """The export in a grid, with what the manual states where the file does not."""
        found = self.read(grid)
        return replace(
            found,
            dialect=self.name,
            units={**self.units, **found.units},
            orientation=found.orientation or self.orientation,
            controller=found.controller or self.controller,
        )


def signed(pattern: str) -> Callable[[Grid], bool]:
    """Recognizes exports by words in their first lines."""
    compiled = re.compile(pattern, re.IGNORECASE)
    return lambda grid: compiled.search(grid.opening) is not None


def made(
    grid: Grid, titles: Sequence[str], rows: Sequence[Sequence[str]], lines: Sequence[int], units: Sequence[str] = ()
) -> Export:
    """An export whose table a dialect has put together itself."""
    given = list(units) or [""] * len(titles)
    return Export(grid, "", list(titles), with_units(titles, given), rows, lines)


def of_features(
    grid: Grid, found: Sequence[tuple[str, int, Mapping[str, str]]], units: Mapping[str, tuple[str, float]]
) -> Export:
    """An export of features, each its name, line and coordinates by X, Y, Z; those that lack one are left out."""
    whole = [(name, line, axes) for name, line, axes in found if len(axes) == len("XYZ")]
    rows = [[name, *(axes[axis] for axis in "XYZ")] for name, _, axes in whole]
    export = made(grid, ["Name", "X", "Y", "Z"], rows, [line for _, line, _ in whole])
    left = len(found) - len(whole)
    notes = (f"{left} features without x, y and z are left out",) if left else ()
    return replace(export, units=units, notes=notes)
