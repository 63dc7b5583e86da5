# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""ROS and ROS 2 joint_states: PlotJuggler's tables, ros2 topic echo (YAML or --csv) and rostopic echo -p.

By the conventions of ROS positions are in rad (m for a sliding joint). A message may list its joints in any order,
often by the alphabet, so a joint is known by its name; where that holds no number, the map has to say which it is.
"""

from __future__ import annotations

import re
from dataclasses import replace

from fastcal.importers.dialect import Dialect, made
from fastcal.importers.export import Export, number
from fastcal.importers.grid import Grid
from fastcal.importers.layout import read_table

_ECHO = re.compile(r"^name:.*?^position:", re.M | re.S)
_FIELDS = re.compile(r"^field\.(name|position)(\d+)$")
_LONGEST = 50_000  # characters of a message; one of 20 joints has a few thousand
_HEAD = 3  # sec, nanosec, frame_id of ros2 topic echo --csv


def _recognizes(grid: Grid) -> bool:
    return (
        re.search(r"joint_states?\b.*\bposition|field\.position0", grid.opening) is not None
        or (bool(_ECHO.search(grid.text[:20000])) and "velocity:" in grid.text[:20000])
        or _width(grid) is not None
    )


def _width(grid: Grid) -> int | None:
    """The number of joints in a line of ros2 topic echo --csv; None where it is none."""
    cells = next((row.cells for row in grid.rows if not row.blank), ())
    if len(cells) <= _HEAD or not all(cell.isdecimal() for cell in cells[:2]):
        return None
    count = next((k for k, cell in enumerate(cells[_HEAD:]) if number(cell) is not None), 0)
    return count if count > 1 and len(cells) >= _HEAD + 2 * count else None


def _read(grid: Grid) -> Export:
    if _ECHO.search(grid.text[:20000]):
        return _echoed(grid)
    if (width := _width(grid)) is not None:
        names = next(row for row in grid.rows if not row.blank).cells[_HEAD : _HEAD + width]
        titles = ["time [s]", *(f"/joint_states/{name}/position" for name in names)]
        rows, lines = [], []
        for row in grid.rows:
            if not row.blank:
                place = {name: k for k, name in enumerate(row.cells[_HEAD : _HEAD + width])}
                positions = row.cells[_HEAD + width : _HEAD + 2 * width]
                if set(place) != set(names) or len(positions) < width:
                    raise grid.error("names other joints than the first message, or lacks their positions", row.line)
                rows.append([f"{row.cells[0]}.{row.cells[1].zfill(9)}", *(positions[place[name]] for name in names)])
                lines.append(row.line)
        return made(grid, titles, rows, lines)
    return read_table(_renamed(grid))


def _renamed(grid: Grid) -> Grid:
    """Rostopic echo -p: the columns position0 ... by the names in name0 ..."""
    header = next((k for k, row in enumerate(grid.rows) if any(_FIELDS.match(cell) for cell in row.cells)), None)
    if header is None or header + 1 >= len(grid.rows):
        return grid
    first = grid.rows[header + 1].cells
    names = {
        m[2]: first[k]
        for k, cell in enumerate(grid.rows[header].cells)
        if (m := _FIELDS.match(cell)) and m[1] == "name"
    }
    cells = [
        f"/joint_states/{names[m[2]]}/position"
        if (m := _FIELDS.match(cell)) and m[1] == "position" and m[2] in names
        else cell
        for cell in grid.rows[header].cells
    ]
    row = replace(grid.rows[header], cells=tuple(cells), comment=False)
    return replace(grid, rows=(*grid.rows[:header], row, *grid.rows[header + 1 :]))


def _echoed(grid: Grid) -> Export:
    """ros2 topic echo: one YAML document a message."""
    names: list[str] | None = None
    rows, lines, line = [], [], 1
    for message in re.split(r"^---\s*$", grid.text, flags=re.M):
        if len(message) > _LONGEST:
            raise grid.error(f"expected messages of at most {_LONGEST} characters, got {len(message)}", line)
        listed, positions = _listed(message, "name"), _listed(message, "position")
        if listed and len(listed) == len(positions):
            names = names or listed
            if set(listed) != set(names):
                raise grid.error("names other joints than the first message", line)
            place = {name: k for k, name in enumerate(listed)}
            seconds = re.search(r"\bsecs?:\s*(\d+)\s+nano?se?cs?:\s*(\d+)|\bsec:\s*(\d+)\s+nanosec:\s*(\d+)", message)
            parts = [part for part in seconds.groups() if part] if seconds else []
            time = f"{parts[0]}.{parts[1].zfill(9)}" if parts else ""
            rows.append([time, *(positions[place[name]] for name in names)])
            lines.append(line)
        line += message.count("\n")
    if names is None:
        raise grid.error("holds no message with names and positions of joints")
    return made(grid, ["time [s]", *(f"/joint_states/{name}/position" for name in names)], rows, lines)


def _listed(message: str, key: str) -> list[str]:
    """A list of a message, in either of YAML's forms."""
    flow = re.search(rf"^{key}:\s*\[(.*?)\]", message, re.M | re.S)
    if flow:
        return [entry.strip().strip("'\"") for entry in flow[1].split(",")]
    block = re.search(rf"^{key}:\s*\n((?:\s*- .*\n?)+)", message, re.M)
    return [entry.strip().strip("'\"") for entry in re.findall(r"^\s*- (.*)$", block[1], re.M)] if block else []


DIALECT = Dialect(
    "ROS joint states", _recognizes, _read, units={"length": ("m", 1.0), "angle": ("rad", 1.0)}, controller=True
)
