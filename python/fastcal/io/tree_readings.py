# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Postures of a cell and readings of its targets out of a CSV, Parquet or Excel file.

Joints are columns ARM.q1_deg (of a cell's only arm q1_deg) or a URDF's own names with their unit; readings
x_mm@TARGET (from the world) or x_mm@TARGET:SENSOR, distance_mm@TARGET:TARGET, qw@..., sigma_mm@...; x_mm alone is of
the target `tool`. Labels of what was touched, or measured from, are socket@TARGET, plane@TARGET, anchor@TARGET, or
ARM.socket where the arm has one target. Speeds of joints are ARM.qd1_deg_s, or NAME_rad_s; ARM.j1_deg is what a pendant
shows. What else an arm's own file would have: arm_readings.py.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Labels, Readings
from fastcal.errors import InvalidInput
from fastcal.io.arm_readings import arm_conditions
from fastcal.io.columns import SPEEDS, is_condition
from fastcal.io.flange_columns import flange_columns, flange_joints
from fastcal.io.pendant_columns import with_chain_columns
from fastcal.io.table import Table
from fastcal.io.tables import read_table
from fastcal.measurements.observations import tables_of
from fastcal.units import UNITS, parse_name, to_si, unit_names

_OF_A_SPEED = re.compile(r"\bqd(\d+)$")
TOOL = "tool"  # the target of columns that name none
_UNIT_LENGTH = 1e-2  # of a quaternion, that is then made one


@cache
def _read() -> dict[str, tuple[str, int, str | None]]:
    """Of the quantity of a column before its @: the field it is of, its place there, -1 for all of them, and its kind.

    All that the core's registry of observations knows, but for labels and what each link has of its own.
    """
    tables = [table for table in tables_of(0).values() if table.role != "label"]
    out = {title: (of.name, k, of.quantity) for of in tables for k, title in enumerate(of.columns)}
    return {**out, "sigma": ("sigma_position", -1, "length"), "sigma_rot": ("sigma_rotation", 0, "angle")}


@cache
def _labelled() -> dict[str, str]:
    """Of the title of a column of labels before its @: its field."""
    return {of.columns[0]: of.name for of in tables_of(0).values() if of.role == "label"}


@cache
def _touches() -> frozenset[str]:
    """Fields of labels that alone say that something was read: of a socket, a plane."""
    entries = [_core.observation_entry(kind).fields for kind in _core.observation_names()]
    alone = [own for own in entries if all(field.role != "measured" for field in own)]
    return frozenset(field.name for own in alone for field in own if field.role == "label")


def is_of_a_target(base: str) -> bool:
    """Is a column of this name, without unit and target, a reading, its label or how exact it is?"""
    return base.lower() in _read() or base.lower() in _labelled()


def load_readings(path: str | os.PathLike[str], cell: Cell, *, require_measured: bool = True) -> Readings:
    """Postures and readings of a cell; without `require_measured` a posture may be all that a row holds.

    Raises:
        ParseError: A joint has no column, a column names an arm, target or sensor that the cell does not have, has no
            unit, or a posture holds no reading; one sentence with file, line and column.
    """
    table = with_chain_columns(read_table(path), cell)
    joints: dict[int, int] = {}
    speeds: dict[int, int] = {}
    tables: dict[str, FloatArray] = {}
    labels: dict[str, Labels] = {}
    others = []
    has_tool = any(of.name == TOOL for of in cell.points)
    flanges = flange_columns(table, [arm.name for arm in cell.arms if arm.of_poses], only=len(cell.arms) == 1)
    of_flanges = {place for found in flanges.values() for place in found.values()}
    for place, title in enumerate(table.names):
        if place in of_flanges:
            continue
        quantity, at, view = title.partition("@")
        base, unit = parse_name(quantity)
        is_speed = unit is not None and UNITS[unit].kind in SPEEDS.values()
        base = _OF_A_SPEED.sub(r"q\1", base) if is_speed else base
        if (joint := _joint(table, title, base, cell)) is not None:
            kind = "angle" if cell.joint_types[joint] == "revolute" else "length"
            _check_unit(table, title, unit, SPEEDS[kind] if is_speed else kind)
            _put(table, place, joint, speeds if is_speed else joints)
        elif (field := _labelled().get(base.rpartition(".")[2].lower())) is not None:
            name = f"{field}@{_touching(table, title, cell)}"
            if name in labels:
                raise table.error(f"column '{title:.60}' gives {name:.60} a second time")
            labels[name] = Labels.of(table.labels(place))
        elif (at or has_tool) and is_of_a_target(base):
            _take(table, place, base.lower(), unit, _checked_view(table, title, view if at else TOOL, cell), tables)
        else:
            _check_known_unit(table, title, base if at else "")
            others.append(place)
    of_poses = {arm: flange_joints(table, found) for arm, found in flanges.items()}
    q = _joint_positions(table, joints, cell, others, of_poses)
    _make_unit(table, tables)
    if require_measured:
        _check_measured(table, cell, tables, labels)
    arms, notes = arm_conditions(table, others, cell, q)
    found = Readings(q, tables, table.path, (*table.notes, *notes), _speeds(table, speeds, q), arms=arms, labels=labels)
    _check_views(table, cell, found)
    return found


def _check_known_unit(table: Table, title: str, base: str) -> None:
    """Is a column of a target one whose unit alone is not known, as x_cm@smr?"""
    name, _, unit = base.lower().rpartition("_")
    kind = _read()[name][2] if name in _read() else None
    if kind is not None:
        raise table.error(
            f"column '{title:.60}': '{unit:.20}' is no unit of {kind} known here; expected one of "
            f"{', '.join(unit_names(kind))}"
        )


def _put(table: Table, place: int, joint: int, into: dict[int, int]) -> None:
    """Notes which column is of a joint. ParseError where another is."""
    if joint in into:
        first, second = table.names[into[joint]], table.names[place]
        raise table.error(f"columns '{first:.60}' and '{second:.60}' are of the same joint")
    into[joint] = place


def _check_views(table: Table, cell: Cell, found: Readings) -> None:
    """Is each kind of reading one that may be of any target?"""
    read = [name for name in found.tables if not name.startswith("sigma")]
    try:
        known = {of.field for of in found.measured(cell).observations} if read or found.labels else set()
    except InvalidInput as error:
        raise table.error(str(error)) from None
    for name in read:
        field, _, view = name.partition("@")
        if name not in known and field not in known:
            title = tables_of(0)[field].columns[0]
            raise table.error(f"{title} is read of the tool of one arm's file alone, and not of '{view}' in a cell")


def _touching(table: Table, title: str, cell: Cell) -> str:
    """The target that a column of labels is of: socket@TARGET, ARM.socket of an arm's only one, socket of `tool`."""
    quantity, at, view = title.partition("@")
    if at:
        return _checked_view(table, title, view, cell)
    arm, dot, label = quantity.rpartition(".")
    targets = [of for of in cell.points if of.role == "target"]
    if not dot:
        own = [of.name for of in targets if of.name == TOOL]
    elif arm in (arms := [of.name for of in cell.arms]):
        own = [of.name for of in targets if of.on.partition(".")[0] == arm]
    else:
        raise table.error(f"column '{title:.60}' names no arm of this cell; its arms are {', '.join(arms)}")
    if len(own) == 1:
        return own[0]
    meant = [of.name for of in targets if not dot or of.name in own]
    columns = " or ".join(f"{label}@{name}" for name in meant) or f"{label}@TARGET of a target of the cell"
    where = f"{arm} carries {len(own)} targets" if dot else "it names no target"
    raise table.error(f"column '{title:.60}': {where}; expected {columns:.200}")


def _check_measured(table: Table, cell: Cell, tables: Mapping[str, FloatArray], labels: Mapping[str, Labels]) -> None:
    """Holds each posture a reading?"""
    measured = [np.isnan(values).any(axis=1) for name, values in tables.items() if not name.startswith("sigma")]
    measured += [of.codes < 0 for name, of in labels.items() if name.partition("@")[0] in _touches()]
    if not measured:
        more = ", or corners of pictures beside it" if cell.cameras else ""
        raise table.error(f"holds no reading; expected columns such as x_mm@TARGET or x_mm@TARGET:SENSOR{more}")
    empty = np.all(measured, axis=0)
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
    table: Table, joints: Mapping[int, int], cell: Cell, others: Sequence[int], flanges: Mapping[str, FloatArray]
) -> FloatArray:
    """(N, n) of all joints, SI; `others` are columns of none, `flanges` arms of which only the pose is known."""
    q = np.empty((len(table), len(cell.joint_columns)))
    for joint, columns in enumerate(cell.joint_columns):
        arm, _, number = columns[0].rpartition(".q")
        if arm in flanges:
            q[:, joint] = flanges[arm][:, int(number) - 1]
            continue
        if joint not in joints:
            unit = "deg" if cell.joint_types[joint] == "revolute" else "mm"
            meant = [table.names[place] for place in others if not is_condition(table.names[place])]
            got = f", got columns that are of no joint: {', '.join(meant):.120}" if meant else ""
            raise table.error(f"there is no column of the joint {columns[0]}; expected {columns[0]}_{unit}{got}")
        place = joints[joint]
        q[:, joint] = _in_si(table, place, parse_name(table.names[place])[1] or "rad")
        if np.isnan(q[:, joint]).any():
            raise table.wrong_cell(place, int(np.argmax(np.isnan(q[:, joint]))), "a number")
    return q


def _speeds(table: Table, speeds: Mapping[int, int], q: FloatArray) -> FloatArray | None:
    """(N, n) speeds of all joints, SI, NaN where there is no column; None where there is none at all."""
    if not speeds:
        return None
    out = np.full(q.shape, np.nan)
    for joint, place in speeds.items():
        out[:, joint] = _in_si(table, place, parse_name(table.names[place])[1] or "rad_s")
    return out


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
    field, column, kind = _read()[base]
    _check_unit(table, table.names[place], unit, kind)
    to = tables.setdefault(f"{field}@{view}", np.full((len(table), len(tables_of(0)[field].columns)), np.nan))
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


def _make_unit(table: Table, tables: Mapping[str, FloatArray]) -> None:
    """Quaternions of length 1 but for their rounding."""
    for name, wxyz in tables.items():
        if not name.startswith("rotation"):
            continue
        with np.errstate(over="ignore"):
            length = np.linalg.norm(wxyz, axis=1)
        if (wrong := np.abs(length - 1) > _UNIT_LENGTH).any():
            row = int(np.argmax(wrong))
            raise table.error(f"{name}: expected a quaternion of length 1, got {length[row]:.4g}", row)
        wxyz /= length[:, np.newaxis]
