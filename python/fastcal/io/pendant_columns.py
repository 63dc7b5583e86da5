# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joints of a cell's arms as their controllers show them: columns ARM.j1_deg, of a cell's only arm j1_deg."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from fastcal.cells.cell import Arm, Cell
from fastcal.io.table import Cells, Table
from fastcal.place import joint_position
from fastcal.units import UNITS, parse_name, to_si, unit_names

_SHOWN = re.compile(r"(?:([^.]+)\.)?j(\d{1,3})")


def with_chain_columns(table: Table, cell: Cell) -> Table:
    """The table with ARM.q1_rad ... (or _m) in place of ARM.j1_deg ..., q as the arm's `pendant` counts it from J.

    An arm that has columns of both keeps q alone.

    Raises:
        ParseError: Of an axis that moves a joint there is no column, or one without a unit of it.
    """
    arms = {arm.name: arm for arm in cell.arms}
    shown: dict[str, dict[int, int]] = {}
    for place, title in enumerate(table.names):
        if match := _SHOWN.fullmatch(parse_name(title)[0]):
            name = match[1] or (cell.arms[0].name if len(arms) == 1 else "")
            if name in arms:
                shown.setdefault(name, {})[int(match[2]) - 1] = place
    if not shown:
        return table
    names, columns = list[str](), list[Cells]()
    gone = {place for places in shown.values() for place in places.values()}
    for place, (title, column) in enumerate(zip(table.names, table.columns, strict=True)):
        if place not in gone:
            names.append(title)
            columns.append(column)
    own = {parse_name(title)[0] for title in names}
    for name, places in shown.items():
        first = f"{name}.{joint_position(0)}"
        if own.isdisjoint((first, joint_position(0)) if len(arms) == 1 else (first,)):
            for title, values in _chain(table, arms[name], places).items():
                names.append(title)
                columns.append(values)
    exact = table.exact
    again = None if exact is None else lambda: with_chain_columns(exact(), cell)
    return replace(table, names=names, columns=columns, exact=again)


def _chain(table: Table, arm: Arm, places: dict[int, int]) -> dict[str, Cells]:
    """Columns of an arm's chain, SI."""
    pendant, types = arm.robot.pendant, arm.robot.joint_types
    J = np.zeros((len(table), pendant.axis_count))
    for joint, of in enumerate(types):
        axis = pendant.axis(joint)
        if axis is None:
            continue
        kind = "angle" if of == "revolute" else "length"
        title = f"{arm.name}.j{axis + 1}"
        if axis not in places:
            raise table.error(f"there is no column of {title}; expected {title}_{'deg' if kind == 'angle' else 'mm'}")
        place = places[axis]
        unit = parse_name(table.names[place])[1]
        if unit is None or UNITS[unit].kind != kind:
            expected = ", ".join(unit_names(kind))
            raise table.error(f"column '{table.names[place]:.60}' has no unit of {kind}; expected one of {expected}")
        J[:, axis] = to_si(table.numbers(place), unit)
    q = pendant.chain(J)
    units = ["rad" if of == "revolute" else "m" for of in types]
    return {f"{arm.name}.{joint_position(i)}_{unit}": q[:, i] for i, unit in enumerate(units)}
