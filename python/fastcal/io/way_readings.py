# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a cell's file of postures says of one way from the world to a target, as one arm's measurements."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Sequence
from dataclasses import replace

from fastcal.cells.cell import Cell
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.cells.sensor_ways import SensorWay
from fastcal.io.measurements import dataset_of
from fastcal.io.table import Cells, Table
from fastcal.io.tables import read_table
from fastcal.measurements.dataset import Dataset
from fastcal.units import parse_name

_OF_A_JOINT = re.compile(r"(approach|qd|current)(\d+)")


def way_datasets(path: str | os.PathLike[str], cell: Cell, ways: Sequence[Way], readings: Readings) -> list[Dataset]:
    """The postures of a cell as each way's own: its joints, its arms' conditions, what was read of its target.

    Rows are those of the file: where a way's target was not read, its row holds a posture alone.

    Args:
        path: The file.
        cell: Of which these are ways.
        ways: From the world or a sensor to a target, from a camera to a board.
        readings: Of the whole cell in that file, with corners where pictures were taken.

    Raises:
        ParseError: Something in the file is invalid; one sentence with file, line and column.
    """
    table, out = read_table(path), list[Dataset]()
    joints = {title for titles in cell.joint_columns for title in titles}
    for way in ways:
        pictures = isinstance(way, SensorWay) and way.has_pictures
        own = _seen_by(table, way, joints - way.titles.keys())
        data = dataset_of(own, way.robot, require_measured=not pictures)
        out.append(way.measured(cell, data, readings) if isinstance(way, SensorWay) else data)
    return out


def _seen_by(table: Table, way: Way, others: Collection[str]) -> Table:
    """The columns of one way, by the names that one arm's file has; `others`: joints that are not on it."""
    names, titles, columns = list[str](), list[str](), list[Cells]()
    for title, column in zip(table.names, table.columns, strict=True):
        if (name := _own_name(title, way, others)) is not None:
            names.append(name)
            titles.append(title)
            columns.append(column)
    exact = table.exact
    again = None if exact is None else lambda: _seen_by(exact(), way, others)
    return replace(table, names=names, titles=titles, columns=columns, exact=again)


def _own_name(title: str, way: Way, others: Collection[str]) -> str | None:
    """What one arm's file calls a column; None where it is of something else."""
    quantity, at, view = title.partition("@")
    if at:
        return quantity if view.partition(":world")[0] == way.name else None
    base, unit = parse_name(title)
    own = way.titles.get(base) or way.titles.get(title)
    if own is not None:
        return f"{own}_{unit or 'rad'}"
    if base in others or title in others:
        return None
    arm, dot, rest = base.partition(".")
    if not dot:
        return title
    if found := _OF_A_JOINT.fullmatch(rest):
        at_joint = {(own_arm.name, index): k for k, (own_arm, index) in enumerate(way.joints)}
        k = at_joint.get((arm, int(found[2]) - 1))
        return None if k is None else f"{found[1]}{k + 1}" + (f"_{unit}" if unit else "")
    return title.partition(".")[2] if arm == way.arms[-1].name else None
