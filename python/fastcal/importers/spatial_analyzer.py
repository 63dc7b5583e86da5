# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""SpatialAnalyzer: lists of points with comments (//), as collection, group, target, x, y, z, comma or blank between.

The comments name working frame, coordinates, units and columns, where they were exported.
"""

from __future__ import annotations

import re

from fastcal.importers.dialect import Dialect
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.importers.layout import read_table


def _recognizes(grid: Grid) -> bool:
    return (
        re.search(r"SpatialAnalyzer|\bCollection\b.*\b(Group|Target|Point)\b|Working Frame", grid.opening) is not None
    )


def _read(grid: Grid) -> Export:
    if kind := re.search(r"Coordinates:\s*(Cylind|Spher|Polar)\w*", grid.opening, re.I):
        raise grid.error(f"holds {kind[0].split()[-1].lower()} coordinates; export the points as Cartesian x, y, z")
    return read_table(grid)


DIALECT = Dialect("SpatialAnalyzer", _recognizes, _read)
