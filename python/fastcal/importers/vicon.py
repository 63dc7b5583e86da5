# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Vicon Tracker and Nexus: Objects or Segments, the frame rate, the body, RX RY RZ (RW) TX TY TZ, a row of units.

With RW the rotation is a quaternion x y z w; without it the angles may be a rotation vector or Euler angles, which the
export does not say.
"""

from __future__ import annotations

from fastcal.importers.dialect import Dialect, made
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid


def _header(grid: Grid) -> int | None:
    return next((k for k, row in enumerate(grid.rows[:12]) if row.cells[:2] == ("Frame", "Sub Frame")), None)


def _read(grid: Grid) -> Export:
    header = _header(grid)
    assert header is not None  # noqa: S101 - it was recognized by it
    axes = grid.rows[header].cells
    above = grid.rows[header - 1].cells if header else ()
    bodies = [name for name in above if name]
    if len(bodies) > 1:
        listed = ", ".join(f"'{name}'" for name in bodies[:8])
        raise grid.error(
            f"holds {len(bodies)} bodies ({listed}); name the columns of one with --map, by their numbers from 1"
        )
    rest = [row for row in grid.rows[header + 1 :] if not row.blank]
    units = rest[0].cells if rest and not any(cell.lstrip("-").isdigit() for cell in rest[0].cells) else ()
    rows = [list(row.cells) + [""] * (len(axes) - len(row.cells)) for row in rest[bool(units) :]]
    lines = [row.line for row in rest[bool(units) :]]
    given = [units[k] if k < len(units) else "" for k in range(len(axes))]
    return made(grid, axes, [row[: len(axes)] for row in rows], lines, given)


DIALECT = Dialect("Vicon", lambda grid: _header(grid) is not None, _read, units={"length": ("mm", 1.0)})
