# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Postures of a cell and readings of its targets out of a CSV, Parquet or Excel file.

Joints are columns ARM.q1_deg or a URDF's own names with their unit; readings x_mm@TARGET (from the world) or
x_mm@TARGET:SENSOR, distance_mm@TARGET:TARGET, qw@..., sigma_mm@...
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput
from fastcal.io.flange_columns import flange_columns, flange_joints
from fastcal.io.table import Table
from fastcal.io.tables import read_table
from fastcal.units import UNITS, parse_name, to_si, unit_names

# Quantity of a column before its @: the field it is of, its place there, and its kind.
_READ: dict[str, tuple[str, int, str | None]] = {
    **{axis: ("position", i, "length") for i, axis in enumerate("xyz")},
    **{f"q{part}": ("rotation", i, None) for i, part in enumerate("wxyz")},
    "distance": ("distance", 0, "length"),
    **{f"sigma_{axis}": ("sigma_position", i, "length") for i, axis in enumerate("xyz")},
    "sigma": ("sigma_position", -1, "length"),  # of all three
    "sigma_rot": ("sigma_rotation", 0, "angle"),
}
_WIDTH = {"position": 3, "distance": 1, "rotation": 4, "sigma_position": 3, "sigma_rotation": 1}
_UNIT_LENGTH = 1e-2  # of a quaternion, that is then made one


def load_readings(path: str | os.PathLike[str], cell: Cell, *, require_measured: bool = True) -> Readings:
    """Postures and readings of a cell; without `require_measured` a posture may be all that a row holds.

    Raises:
        ParseError: A joint has no column, a column names an arm, target or sensor that the cell does not have, has no
            unit, or a posture holds no reading; one sentence with file, line and column.
    """
    table = read_table(path)
    joints: dict[int, int] = {}
    tables: dict[str, FloatArray] = {}
    notes = []
    flanges = flange_columns(table, [arm.name for arm in cell.arms if arm.of_poses])
    of_flanges = {place for found in flanges.values() for place in found.values()}
    for place, title in enumerate(table.names):
        if place in of_flanges:
            continue
        quantity, at, view = title.partition("@")
        base, unit = parse_name(quantity)
        if (joint := _joint(table, title, base, cell)) is not None:
            if joint in joints:
                raise table.error(f"columns '{table.names[joints[joint]]:.60}' and '{title:.60}' are of the same joint")
            _check_unit(table, title, unit, "angle" if cell.joint_types[joint] == "revolute" else "length")
            joints[joint] = place
        elif at and base.lower() in _READ:
            _take(table, place, base.lower(), unit, _checked_view(table, title, view, cell), tables)
        else:
            notes.append(f"column '{title:.60}' is not known and was not read")
    q = _joint_positions(table, joints, cell, {arm: flange_joints(table, found) for arm, found in flanges.items()})
    for name, values in tables.items():
        if name.startswith("rotation"):
            _make_unit(table, name, values)
    if require_measured:
        _check_measured(table, cell, tables)
    return Readings(q, tables, table.path, (*table.notes, *notes))


def _check_measured(table: Table, cell: Cell, tables: Mapping[str, FloatArray]) -> None:
    """Holds each posture a reading?"""
    measured = [values for name, values in tables.items() if not name.startswith("sigma")]
    if not measured:
        more = ", or corners of pictures beside it" if cell.cameras else ""
        raise table.error(f"holds no reading; expected columns such as x_mm@TARGET or x_mm@TARGET:SENSOR{more}")
    empty = np.all([np.isnan(values).any(axis=1) for values in measured], axis=0)
    if empty.any():
        raise table.error("holds a posture and no reading of any target", int(np.argmax(empty)))


def _joint(table: Table, title: str, base: str, cell: Cell) -> int | None:
    """The joint that a column is of, in the order of the tree; None where it is of none."""
    for joint, names in enumerate(cell.joint_columns):
        if base in names or title in names:
            return joint
    arm, dot, own = base.partition(".")
    if not dot:
        return None
    if arm not in (arms := [of.name for of in cell.arms]):
        raise table.error(f"column '{title:.60}' names no arm of this cell; its arms are {', '.join(arms)}")
    if re.fullmatch(r"q\d+", own):
        count = cell.arm(arm).robot.joint_count
        raise table.error(f"column '{title:.60}' names no joint of its arm; its joints are numbered 1 to {count}")
    return None


def _joint_positions(
    table: Table, joints: Mapping[int, int], cell: Cell, flanges: Mapping[str, FloatArray]
) -> FloatArray:
    """(N, n) of all joints, SI; `flanges` are those of arms of which only the pose is known."""
    q = np.empty((len(table), len(cell.joint_columns)))
    for joint, columns in enumerate(cell.joint_columns):
        arm, _, number = columns[0].rpartition(".q")
        if arm in flanges:
            q[:, joint] = flanges[arm][:, int(number) - 1]
            continue
        if joint not in joints:
            unit = "deg" if cell.joint_types[joint] == "revolute" else "mm"
            raise table.error(f"there is no column of the joint {columns[0]}; expected {columns[0]}_{unit}")
        place = joints[joint]
        q[:, joint] = _in_si(table, place, parse_name(table.names[place])[1] or "rad")
        if np.isnan(q[:, joint]).any():
            raise table.wrong_cell(place, int(np.argmax(np.isnan(q[:, joint]))), "a number")
    return q


def _checked_view(table: Table, title: str, view: str, cell: Cell) -> str:
    """TARGET or TARGET:SENSOR, of frames that there are."""
    known = {of.name for of in cell.points}
    for name in view.split(":", 1):
        if name in known or name == "world":
            continue
        try:
            cell.core.frame(name)
        except InvalidInput:
            listed = ", ".join(sorted(known)) or "none"
            raise table.error(
                f"column '{title:.60}' names '{name:.60}', which is no target or sensor here; there are {listed}"
            ) from None
    return view.removesuffix(":world")


def _take(table: Table, place: int, base: str, unit: str | None, view: str, tables: dict[str, FloatArray]) -> None:
    """Puts a column where it belongs, in SI."""
    field, column, kind = _READ[base]
    _check_unit(table, table.names[place], unit, kind)
    to = tables.setdefault(f"{field}@{view}", np.full((len(table), _WIDTH[field]), np.nan))
    values = table.numbers(place) if unit is None else _in_si(table, place, unit)
    if field.startswith("sigma") and (none := values <= 0).any():
        raise table.wrong_cell(place, int(np.argmax(none)), "a standard deviation above 0")
    if column < 0:
        to[:] = values[:, np.newaxis]
    else:
        to[:, column] = values


def _in_si(table: Table, place: int, unit: str) -> FloatArray:
    with np.errstate(over="ignore"):
        values = np.asarray(to_si(table.numbers(place), unit))
    if (beyond := np.isinf(values)).any():
        raise table.wrong_cell(place, int(np.argmax(beyond)), "a number")
    return values


def _check_unit(table: Table, title: str, unit: str | None, kind: str | None) -> None:
    if kind is not None and (unit is None or UNITS[unit].kind != kind):
        raise table.error(f"column '{title:.60}' has no unit of {kind}; expected one of {', '.join(unit_names(kind))}")


def _make_unit(table: Table, name: str, wxyz: FloatArray) -> None:
    """Quaternions of length 1 but for their rounding."""
    with np.errstate(over="ignore"):
        length = np.linalg.norm(wxyz, axis=1)
    if (wrong := np.abs(length - 1) > _UNIT_LENGTH).any():
        row = int(np.argmax(wrong))
        raise table.error(f"{name}: expected a quaternion of length 1, got {length[row]:.4g}", row)
    wxyz /= length[:, np.newaxis]
