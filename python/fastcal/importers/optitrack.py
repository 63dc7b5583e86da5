# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""OptiTrack Motive: lines Format Version, Type, Name, ID, Rotation and Position, X Y Z W; quaternions are x y z w."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fastcal.importers.dialect import Dialect, made, signed
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid, Row
from fastcal.importers.words import unit_of


def _read(grid: Grid) -> Export:
    facts = _facts(grid.rows[0].cells)
    named = {
        row.cells[1].lower(): row
        for row in grid.rows[:12]
        if len(row.cells) > 1 and row.cells[1] in ("Type", "Name", "ID")
    }
    header = next((k for k, row in enumerate(grid.rows[:12]) if row.cells[0] == "Frame"), None)
    if header is None or "name" not in named:
        raise grid.error("expected Motive's header lines Type, Name and Frame; export the take as CSV with its header")
    parts, axes = grid.rows[header - 1].cells, grid.rows[header].cells
    kinds = named["type"].cells if "type" in named else ("Rigid Body",) * len(axes)
    bodies = _of_kind(kinds, named["name"].cells, "Rigid Body") or _of_kind(kinds, named["name"].cells, "Bone")
    wanted = "Rigid Body"
    if not bodies:
        bodies, wanted = _of_kind(kinds, named["name"].cells, "Marker"), "Marker"
    if len(bodies) != 1:
        listed = ", ".join(f"'{name}'" for name in bodies[:8])
        raise grid.error(
            f"holds {len(bodies)} bodies ({listed}); name the columns of one with --map, by their numbers from 1"
        )
    rotation = facts.get("rotation type", "Quaternion")
    angles = "" if rotation.lower() == "quaternion" else "deg"
    length = facts.get("length units", "")
    places, titles, units = [0, 1], ["Frame", "Time"], ["", "s"]
    for place, axis in enumerate(axes[2:], start=2):
        kind = kinds[place] if place < len(kinds) else ""
        if (
            kind.startswith(wanted)
            and not (wanted != "Marker" and "Marker" in kind)
            and axis
            and parts[place] in ("Rotation", "Position")
        ):
            places.append(place)
            titles.append(f"{parts[place]} {axis}")
            units.append((length if unit_of(length) else "") if parts[place] == "Position" else angles)
    rows = [row for row in grid.rows[header + 1 :] if not row.blank]
    cells = [[_cell(row, place) for place in places] for row in rows]
    return made(grid, titles, cells, [row.line for row in rows], units)


def _facts(cells: Sequence[str]) -> dict[str, str]:
    """The first line: pairs of a name and its value."""
    return {name.lower(): value for name, value in zip(cells[::2], cells[1::2], strict=False)}


def _of_kind(kinds: Sequence[str], names: Sequence[str], kind: str) -> list[str]:
    """The names of the bodies of a kind, each once."""
    return list(dict.fromkeys(n for k, n in zip(kinds, names, strict=False) if re.fullmatch(kind, k, re.I)))


def _cell(row: Row, place: int) -> str:
    return row.cells[place] if place < len(row.cells) else ""


DIALECT = Dialect("OptiTrack Motive", signed(r"Format Version.*(Take Name|Capture Frame Rate|Rotation Type)"), _read)
