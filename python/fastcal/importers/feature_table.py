# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tables with a row a coordinate, as PolyWorks and other inspection software report: Name, Control, Nom, Meas, Dev."""

from __future__ import annotations

from fastcal.importers.dialect import Dialect, of_features
from fastcal.importers.export import Export, number
from fastcal.importers.grid import Grid
from fastcal.importers.layout import stated_units
from fastcal.importers.words import ACTUAL, MEASURED, NEUTRAL, plain_words, split_unit

_SEARCHED = 60  # rows in which the titles are looked for
_SAMPLE = 6


def _places(grid: Grid) -> tuple[int, int, int, int] | None:
    """The row of titles and the columns of names, of axes and of what was measured; None where there are none."""
    for head, row in enumerate(grid.rows[:_SEARCHED]):
        words = [{*plain_words(split_unit(cell)[0])} - NEUTRAL for cell in row.cells]
        measured = next((k for k, found in enumerate(words) if found and found <= MEASURED | ACTUAL), None)
        body = [each.cells for each in grid.rows[head + 1 :] if not each.blank][:_SAMPLE]
        if measured is None or len(body) < _SAMPLE:
            continue
        width = min(map(len, body))
        axes = [k for k in range(width) if {cells[k].upper() for cells in body} == set("XYZ")]
        if len(axes) == 1 and measured < width and all(number(cells[measured]) is not None for cells in body):
            names = [
                k for k in range(width) if k not in (axes[0], measured) and body[0][k] and number(body[0][k]) is None
            ]
            if names:
                return head, names[0], axes[0], measured
    return None


def _read(grid: Grid) -> Export:
    places = _places(grid)
    assert places is not None  # noqa: S101 - it was recognized by them
    head, name, axis, measured = places
    found: list[tuple[str, int, dict[str, str]]] = []
    for row in grid.rows[head + 1 :]:
        cells = row.cells
        if len(cells) <= max(name, axis, measured) or cells[axis].upper() not in ("X", "Y", "Z"):
            continue
        letter = cells[axis].upper()
        if not found or letter in found[-1][2] or (cells[name] and cells[name] != found[-1][0]):
            found.append((cells[name], row.line, {}))
        found[-1][2][letter] = cells[measured]
    unit = split_unit(grid.rows[head].cells[measured])[1]
    return of_features(grid, found, {"length": unit} if unit else stated_units(grid, head))


DIALECT = Dialect("a table by feature", lambda grid: _places(grid) is not None, _read)
