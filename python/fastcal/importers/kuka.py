# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""KUKA: logs with axes A1 to A6 and frames X Y Z A B C, mm and deg.

A, B, C turn about z, then the new y, then the new x: R = Rz(A) Ry(B) Rx(C). $POS_ACT is what the controller computes.
"""

from __future__ import annotations

import re
from dataclasses import replace

from fastcal.importers.dialect import Dialect
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid
from fastcal.importers.layout import read_table

# The groups are atomic: on a line of many axes, one that does not end in A6, the time would grow with its fifth power.
_AXES = r"(?<![\w$])A1\b" + "".join(rf"(?>.*?\bA{axis}\b)" for axis in range(2, 7))
_SIGN = re.compile(rf"\bKUKA\b|\bKR ?C\d|\$?AXIS_ACT|\$?POS_ACT|{_AXES}")
_COMPUTED = re.compile(r"\$?POS_ACT|\$?POS_FOR|\bComputed\b", re.I)


def _read(grid: Grid) -> Export:
    found = read_table(grid)
    return replace(found, controller=_COMPUTED.search(grid.opening) is not None)


DIALECT = Dialect(
    "KUKA",
    lambda grid: _SIGN.search(grid.opening) is not None,
    _read,
    units={"length": ("mm", 1.0), "angle": ("deg", 1.0)},
    orientation="abc",
)
