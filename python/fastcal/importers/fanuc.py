# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""FANUC: registers and logs with J1 to J6 and X Y Z W P R, mm and deg: W, P, R about the fixed x, y and z."""

from __future__ import annotations

from fastcal.importers.dialect import Dialect
from fastcal.importers.grid import Grid
from fastcal.importers.layout import find_header
from fastcal.importers.words import meaning


def _recognizes(grid: Grid) -> bool:
    header = find_header(grid)
    if header is None:
        return False
    found = [meaning(cell) for cell in grid.rows[header].cells]
    return {"w", "p", "r"} <= {title.role for title in found if title is not None} or "FANUC" in grid.opening.upper()


DIALECT = Dialect("FANUC", _recognizes, units={"length": ("mm", 1.0), "angle": ("deg", 1.0)}, orientation="wpr")
