# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a cell's file of postures says of one way from the world to a target, as one arm's measurements."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from fastcal.cells.cell import Cell
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.cells.sensor_ways import SensorWay
from fastcal.io.measurements import dataset_of
from fastcal.io.pendant_columns import with_chain_columns
from fastcal.io.table import Cells, Table
from fastcal.io.tables import read_table
from fastcal.io.tree_readings import TOOL, is_of_a_target
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
    table, out = with_chain_columns(read_table(path), cell), list[Dataset]()
    joints = {title for titles in cell.joint_columns for title in titles}
    for way in ways:
        pictures = isinstance(way, SensorWay) and way.has_pictures
        titles = way.titles(cell)
        own = _seen_by(table, way, titles, joints - titles.keys())
        data = dataset_of(own, way.robot, require_measured=not pictures)
        out.append(way.measured(cell, data, readings) if isinstance(way, SensorWay) else data)
    return out


def _seen_by(table: Table, way: Way, titles: Mapping[str, str], others: Collection[str]) -> Table:
    """The columns of one way, by the names that one arm's file has.

    `titles` are those of its joints by what it calls them, `others` those of joints that are not on it.
    """
    names, columns = list[str](), list[Cells]()
    for title, column in zip(table.names, table.columns, strict=True):
        if (name := _own_name(title, way, titles, others)) is not None:
            names.append(name)
            columns.append(column)
    exact = table.exact
    again = None if exact is None else lambda: _seen_by(exact(), way, titles, others)
    return replace(table, names=names, columns=columns, exact=again)


def _own_name(title: str, way: Way, titles: Mapping[str, str], others: Collection[str]) -> str | None:
    """What one arm's file calls a column; None where it is of something else."""
    quantity, at, view = title.partition("@")
    if at:
        return quantity if view.partition(":world")[0] == way.name else None
    base, unit = parse_name(title)
    own = titles.get(base) or titles.get(title)
    if own is not None:
        return f"{own}_{unit or 'rad'}"
    if base in others or title in others:
        return None
    arm, dot, rest = base.partition(".")
    if not dot:
        return title if way.name == TOOL or not is_of_a_target(base) else None
    if found := _OF_A_JOINT.fullmatch(rest):
        at_joint = {(own_arm.name, index): k for k, (own_arm, index) in enumerate(way.joints)}
        k = at_joint.get((arm, int(found[2]) - 1))
        return None if k is None else f"{found[1]}{k + 1}" + (f"_{unit}" if unit else "")
    return title.partition(".")[2] if arm == way.arms[-1].name else None
