# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""FARO CAM2 and other reports by feature: a block of lines a point, its coordinates in rows, ACTUAL NOMINAL DEVIATION.

The first number of a row is taken as the column called actual or measured says; a report without such a line of titles
holds what was measured first.
"""

from __future__ import annotations

import re

from fastcal.importers.dialect import Dialect, of_features
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.importers.layout import stated_units
from fastcal.importers.words import ACTUAL, DEVIATION, MEASURED, NOMINAL, plain_words

_NAME = re.compile(r"^\s*(?:point|punkt|feature|name|target|sphere|kugel|sphère|nom)\s*[:=#]\s*(\S.*?)\s*$", re.I)
_AXIS = re.compile(r"^\s*([XYZ])\s*(?:\[\w+\])?\s*[:=]?\s+([-+\d.,eE\s]+?)\s*$")
_FEWEST = 3
_LONGEST = 300  # characters of a line of a report


def _recognizes(grid: Grid) -> bool:
    lines = [line[:_LONGEST] for line in grid.text.splitlines()[:2000]]
    return sum(_NAME.match(line) is not None for line in lines) >= _FEWEST and (
        sum(_AXIS.match(line) is not None for line in lines) >= _FEWEST**2
    )


def _read(grid: Grid) -> Export:
    found: list[tuple[str, int, dict[str, str]]] = []
    column = 0
    for line, text in enumerate((each[:_LONGEST] for each in grid.text.splitlines()), start=1):
        words = plain_words(text)
        if name := _NAME.match(text):
            found.append((name[1], line, {}))
        elif (axis := _AXIS.match(text)) and found:
            numbers = axis[2].split()
            if column >= len(numbers):
                raise grid.error(f"expected {column + 1} numbers after {axis[1]}, got {len(numbers)}", line)
            found[-1][2].setdefault(axis[1], numbers[column])
        elif (titles := [word for word in words if word in ACTUAL | MEASURED | NOMINAL | DEVIATION]) and (
            len(titles) == len(words)
        ):
            measured = [k for k, word in enumerate(titles) if word in ACTUAL | MEASURED]
            if not measured:
                raise grid.error("names no column of measured values; expected ACTUAL or MEASURED", line)
            column = measured[0]
    return of_features(grid, found, stated_units(grid, len(grid.rows) - 1))


DIALECT = Dialect("FARO CAM2", _recognizes, _read)
