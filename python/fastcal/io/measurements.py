# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measurement files: one row a pose, every quantity with its unit at the end of its column's name."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.columns import Column, kinds_of_columns, match_columns, would_do
from fastcal.io.flange_columns import joints_for_poses
from fastcal.io.table import Table
from fastcal.io.tables import read_table
from fastcal.measurements.checks import BadRow, RobotFacts, check_whole_rows
from fastcal.measurements.copied_rows import copied_row_notes
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.instrument import along_and_across
from fastcal.measurements.observations import expected_columns, tables_of
from fastcal.units import from_si, to_si

if TYPE_CHECKING:
    import pandas as pd


# Which fastcal writes beside what it reads: designs, predictions, and the plan of an acceptance test.
OWN_COLUMNS = frozenset({"order", "row", "status", "name", "pose", "direction", "cycle"}) | {
    f"target_{name}" for name in ("x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz")
}
_ARGUMENTS = frozenset(inspect.signature(Dataset.from_arrays).parameters)
SHOWN_ROUNDING = 1e-4  # [rad, m] between what a controller shows and the chain's joints, of two decimals of a degree
ROUNDING = 1e-8  # [rad, m] beyond a limit: of a number that went through a file, of six decimals of a degree


def load_measurements(path: str | os.PathLike[str], robot: RobotFacts, *, require_measured: bool = True) -> Dataset:
    """Reads a CSV, Parquet or Excel file of measured poses into SI arrays.

    Args:
        path: The file.
        robot: The arm that was measured: its joints say which columns q must have, its limits and its reach what
            the numbers can mean.
        require_measured: Refuse a file without any measured number. Without it q and the conditions are enough.

    Raises:
        ParseError: The file or something in it is invalid; one sentence with file, line and column.
    """
    return dataset_of(read_table(path), robot, require_measured)


def dataset_of(table: Table, robot: RobotFacts, require_measured: bool, counts: RowCounts | None = None) -> Dataset:
    """`dataset_from_table`, the exact way where something is wrong with what was read quickly."""
    try:
        return dataset_from_table(of_the_arm(table, robot), robot, require_measured, counts)
    except ParseError:
        if table.exact is None:
            raise
    return dataset_from_table(of_the_arm(table.exact(), robot), robot, require_measured, counts)


def of_the_arm(table: Table, robot: RobotFacts) -> Table:
    """The table without the name of the cell's arm before its columns: arm.q1_deg.

    Of an arm of which only the flange's pose is known, that pose becomes the joints that stand for it.
    """
    arm = str(getattr(robot, "arm", "arm"))
    if getattr(robot, "of_poses", False):
        table = joints_for_poses(table, arm)
    prefix = f"{arm}."
    if not any(name.startswith(prefix) for name in table.names):
        return table
    return replace(table, names=[name.removeprefix(prefix) for name in table.names], titles=table.names)


def dataset_of_frame(frame: pd.DataFrame, robot: RobotFacts, *, require_measured: bool = True) -> Dataset:
    """A pandas table with the columns of a measurement file as SI arrays; arguments and errors as above."""
    columns = [
        column.to_numpy(dtype=np.float64, na_value=np.nan)
        if column.dtype.kind in "fiu"
        else ["" if value is None or value != value else str(value) for value in column]
        for _, column in frame.items()
    ]
    return dataset_from_table(
        Table("the table", [str(name) for name in frame.columns], columns), robot, require_measured
    )


class RowCounts:
    """What notes count, of tables of a file that are read one after the other."""

    def __init__(self, robot: RobotFacts) -> None:
        self._robot = robot
        self._limits = np.asarray(robot.limits, dtype=np.float64)
        self._beyond = np.zeros(len(self._limits), dtype=np.int64)  # rows
        self._most = np.zeros(len(self._limits))
        self.empty_payloads = 0

    def add(self, q: FloatArray) -> None:
        """Joint positions (N, n) of further rows."""
        beyond = np.maximum(self._limits[:, 0] - q, q - self._limits[:, 1])
        self._beyond += (beyond > ROUNDING).sum(axis=0)
        self._most = np.maximum(self._most, beyond.max(axis=0))

    def notes(self) -> list[str]:
        """A sentence each."""
        empty = self.empty_payloads
        return [f"payload is empty in {empty} rows and taken as 0 there"] * (empty > 0) + [
            f"joint {joint + 1} is outside its limits in {'1 row' if count == 1 else f'{count} rows'}, "
            f"by {from_si(float(most), unit):.3g} {unit} at most"
            for joint, (kind, count, most) in enumerate(
                zip(self._robot.joint_types, self._beyond.tolist(), self._most, strict=True)
            )
            if count
            for unit in ["deg" if kind == "revolute" else "mm"]
        ]


def dataset_from_table(
    table: Table, robot: RobotFacts, require_measured: bool = True, counts: RowCounts | None = None
) -> Dataset:
    """The data set of a table whose columns are those of a measurement file.

    Args:
        table: The table.
        robot: The arm that was measured.
        require_measured: Refuse a table without any measured number.
        counts: Where given, what notes count is added to it, and its notes are not among the data's.

    Raises:
        ParseError: Something in it is invalid; one sentence with file, line and column.
    """
    known, unknown = match_columns(table, robot.joint_types)
    columns = Columns(table, known)
    try:
        data = Dataset.from_arrays(
            q=columns.joints(robot),
            **columns.observed(len(robot.joint_types)),
            **columns.tracker(),
            q_read=columns.joints_read(robot),
            speed=columns.numbers("speed", [f"qd{joint}" for joint in range(1, len(robot.joint_types) + 1)]),
            **columns.conditions(len(robot.joint_types)),
            source=table.path,
            robot=robot,
        )
    except BadRow as bad:
        raise columns.wrong(bad) from None
    if require_measured and not data.measured.any():
        targets = list(dict.fromkeys(name.partition("@")[2].partition(":")[0] for name in table.names if "@" in name))
        listed = ", ".join(f"{target:.60}: {{on: arm}}" for target in targets[:9])
        hint = f"; targets that columns name stand in the robot's file: `targets: {{{listed}}}`" if targets else ""
        raise table.error(f"holds nothing measured; expected numbers in {expected_columns()}{hint}")
    # Last, as the decimal mark is for the known columns to say.
    extra, extra_labels = unknown_columns(table, unknown)
    foreign = [table.names[place] for place in unknown if table.names[place] not in OWN_COLUMNS]
    own = RowCounts(robot) if counts is None else counts
    own.add(data.q)
    own.empty_payloads += columns.empty_payloads
    notes = [*data.notes, *table.notes]
    notes += [*(f"column '{name}' is not known and is kept as it is" for name in foreign), *columns.notes]
    if counts is None:
        notes += [*own.notes(), *copied_row_notes(data)]
    return replace(
        data,
        rotation_angles=columns.angles(),
        extra=extra,
        extra_labels=extra_labels,
        notes=tuple(notes),
    )


@dataclass
class Columns:
    """Takes quantities out of a table into the fields of a data set, and remembers which column an entry came from."""

    table: Table
    known: Mapping[str, Column]
    notes: list[str] = field(default_factory=list)
    empty_payloads: int = 0
    _sources: dict[str, Sequence[str]] = field(default_factory=dict)

    def joints(self, robot: RobotFacts) -> FloatArray:
        """The commanded joint positions (N, n) of the chain; those of joints that others drive need no column.

        They come as q1 ..., or as the controller shows them: j1 ... Joints that do not move the tool, as of a robot's
        other arm, stand at 0 where they have no column.
        """
        still = []
        driven = {mimic[0] for mimic in robot.mimics} | set(robot.passive)
        own = any(re.fullmatch(r"q\d+", name) for name in self.known)
        letter = "q" if own or not any(re.fullmatch(r"j\d+", name) for name in self.known) else "j"
        for place, joint_type in enumerate(robot.joint_types):
            axis = robot.pendant.axis(place) if letter == "j" else place
            joint = place + 1 if axis is None else axis + 1
            if f"{letter}{joint}" not in self.known and place not in driven:
                if place in robot.beside:
                    still.append(place)
                    continue
                expected = would_do(f"{letter}{joint}", "angle" if joint_type == "revolute" else "length")
                listed = _listed(self.table.names)
                raise self.table.error(f"joint {joint} has no column; expected {expected}, got {listed}")
        q = self._positions("q", letter, robot)
        if still:
            q[:, still] = 0.0
            names = ", ".join(str(joint + 1) for joint in still)
            self.notes.append(
                f"joints {names} have no column and are taken to stand at 0: if they moved, their changing load "
                "on the joints that carry them is not in the model"
            )
        if letter == "j" and robot.pendant.is_chain:
            self.notes.append("columns j1 ... are taken as q1 ..., as the robot file has no pendant")
        if own:
            self._check_shown(q, robot)
        for joint, driver, multiplier, offset in robot.mimics:
            q[:, joint] = multiplier * q[:, driver] + offset
        return robot.follow(q)

    def joints_read(self, robot: RobotFacts) -> FloatArray | None:
        """The joint positions (N, n) that were read back, NaN where they were not; None where none was."""
        for letter in "qj":
            if any(re.fullmatch(rf"{letter}\d+_read", name) for name in self.known):
                return self._positions("q_read", letter, robot)
        return None

    def _positions(self, name: str, letter: str, robot: RobotFacts) -> FloatArray:
        """The chain's joints (N, n) from columns of a letter; NaN where one is missing."""
        read = name.removeprefix("q")
        count = len(robot.joint_types) if letter == "q" else robot.pendant.axis_count
        values = self._stack(name, [f"{letter}{joint}{read}" for joint in range(1, count + 1)])
        return values if letter == "q" else robot.pendant.chain(values)

    def _check_shown(self, q: FloatArray, robot: RobotFacts) -> None:
        """Says where columns j1 ... beside q1 ... are not what the controller would show."""
        joints = [joint for joint in range(1, len(robot.joint_types) + 1) if f"j{joint}" in self.known]
        shown = robot.pendant.shown(q) if joints else q
        for joint in (joint for joint in joints if joint <= shown.shape[1]):
            off = np.abs(self._si(f"j{joint}") - shown[:, joint - 1])
            if (off > SHOWN_ROUNDING).any():
                unit = "deg" if robot.joint_types[joint - 1] == "revolute" else "mm"
                most = from_si(float(np.nanmax(off)), unit)
                self.notes.append(
                    f"column '{self.table.title(self.known[f'j{joint}'].place)}' is up to {most:.3g} {unit} from what "
                    "the controller would show at q1 ..., which are used"
                )

    def numbers(self, name: str, quantities: Sequence[str], *, partly: bool = False) -> FloatArray | None:
        """The columns of a field (N, k) in SI, None where there is none; with `partly`, a missing one is NaN."""
        missing = [quantity for quantity in quantities if quantity not in self.known]
        if len(missing) == len(quantities):
            return None
        if missing and not partly:
            expected = " and ".join(would_do(quantity, self._kind(quantity)) for quantity in missing)
            raise self.table.error(f"expected also {expected}, as {name} is given only in part")
        return self._stack(name, quantities)

    def number(self, name: str, quantity: str) -> FloatArray | None:
        """The column of a field (N,) in SI."""
        found = self.numbers(name, [quantity])
        return None if found is None else found[:, 0]

    def labels(self, name: str) -> list[str] | None:
        """The column of a field of labels."""
        if name not in self.known:
            if name == "anchor" and "distance" in self.known:
                self.notes.append("there is no column 'anchor': all lengths are taken to one and the same")
            return None
        self._sources[name] = [name]
        return self.table.labels(self.known[name].place)

    def observed(self, joint_count: int) -> dict[str, Any]:
        """All that was measured, as arguments of `Dataset.from_arrays`: its own ones and `observed`."""
        others: dict[str, FloatArray] = {}
        labels: dict[str, list[str]] = {}
        out: dict[str, Any] = {"observed": others, "observed_labels": labels}
        readers = {"rotation": self.rotation, "sigma_position": self.sigma_position}  # that can be written in two ways
        for field_name, table in tables_of(joint_count).items():
            if table.role == "label":
                values: Any = self.labels(field_name)
            elif field_name in readers:
                values = readers[field_name]()
            else:
                values = self.numbers(field_name, table.columns)
                if values is not None and len(table.columns) == 1 and field_name in _ARGUMENTS:
                    values = values[:, 0]
            if values is not None:
                (out if field_name in _ARGUMENTS else labels if table.role == "label" else others)[field_name] = values
        return out

    def rotation(self) -> FloatArray | None:
        """The orientation as quaternions (N, 4), from quaternions or from roll, pitch and yaw."""
        angles = self.angles()
        if angles is None:
            return self.numbers("rotation", ["qw", "qx", "qy", "qz"])
        if any(part in self.known for part in ("qw", "qx", "qy", "qz")):
            raise self.table.error("holds the orientation twice; expected either qw qx qy qz or rx ry rz")
        check_whole_rows("rotation", angles)
        return quaternions_of_rpy(angles)

    def angles(self) -> FloatArray | None:
        """Roll, pitch and yaw (N, 3) [rad], where the orientation is given by them."""
        return self.numbers("rotation", ["rx", "ry", "rz"])

    def sigma_position(self) -> FloatArray | None:
        """One standard deviation a row (N,), or one a coordinate (N, 3)."""
        each = self.numbers("sigma_position", ["sigma_x", "sigma_y", "sigma_z"])
        if each is None:
            return self.number("sigma_position", "sigma")
        if "sigma" in self.known or "distance" in self.known:
            rival = "sigma" if "sigma" in self.known else "distance"
            title = self.table.title(self.known[rival].place)
            raise self.table.error(f"expected one sigma column and not one a coordinate, as there is '{title}'")
        return each

    def tracker(self) -> dict[str, Any]:
        """Where the instrument stood and sigma_position along and across its beam, of range and angle; or nothing."""
        names = ["sigma_range", "sigma_angle"]
        places = ["instrument_x", "instrument_y", "instrument_z"]
        sizes = self.numbers("sigma_position", names)
        place = self.numbers("instrument", places)
        if sizes is None:
            if place is None:
                return {}
            raise self.table.error("says where the instrument stood; expected also sigma_range_mm and sigma_angle_mrad")
        position = self.numbers("position", ["x", "y", "z"])
        if position is None or any(name in self.known for name in ("sigma", "sigma_x", "distance")):
            raise self.table.error("sigma_range and sigma_angle are of points; expected no other sigma and no distance")
        if place is None:
            place = np.zeros_like(position)
        return {"instrument": place, "sigma_position": along_and_across(position, place, *sizes.T)}

    def conditions(self, joint_count: int) -> dict[str, Any]:
        """What rows say of a posture beside its joints, as arguments of `Dataset.from_arrays`."""
        joints = range(1, joint_count + 1)
        return {
            "payload": self.payload(),
            "wrench": self.numbers("wrench", ["fx", "fy", "fz", "mx", "my", "mz"]),
            "current": self.numbers("current", [f"current{joint}" for joint in joints]),
            "temperature": self.number("temperature", "temperature"),
            "time": self.number("time", "time"),
            "station": self.labels("station"),
            "mount": self.labels("mount"),
            "approach": self.approach([f"approach{joint}" for joint in joints]),
        }

    def payload(self) -> FloatArray | float:
        """The payload (N,), 0 where there is none."""
        found = self.number("payload", "payload")
        if found is None:
            return 0.0
        empty = np.isnan(found)
        self.empty_payloads = int(empty.sum())
        return np.where(empty, 0.0, found)

    def approach(self, quantities: Sequence[str]) -> FloatArray | None:
        """The approach directions (N, n), 0 where unknown, which a file says by an empty cell."""
        found = self.numbers("approach", quantities, partly=True)
        if found is None:
            return None
        if (found == 0).any():
            row, joint = (int(place) for place in np.argwhere(found == 0)[0])
            raise BadRow("approach", row, joint, "+1 or -1, or an empty cell where it is unknown", "0")
        return np.nan_to_num(found, nan=0.0)

    def wrong(self, bad: BadRow) -> ParseError:
        """The error of a data set as one of the file."""
        quantities = self._sources[bad.field]
        place = self.known[quantities[min(bad.index, len(quantities) - 1)]].place
        return self.table.wrong_cell(place, bad.row, bad.expected)

    def _kind(self, quantity: str) -> str | None:
        joints = sum(re.fullmatch(r"q\d+", name) is not None for name in self.known)
        return kinds_of_columns(joints).get(quantity, "angular speed" if quantity.startswith("qd") else "current")

    def _stack(self, name: str, quantities: Sequence[str]) -> FloatArray:
        self._sources[name] = quantities
        return np.column_stack([self._si(quantity) for quantity in quantities])

    def _si(self, quantity: str) -> FloatArray:
        if quantity not in self.known:
            return np.full(len(self.table), np.nan)
        column = self.known[quantity]
        values = self.table.numbers(column.place)
        with np.errstate(over="ignore"):  # 1e308 inches are infinite, and refused as such
            return values if column.unit is None else to_si(values, column.unit)


def quaternions_of_rpy(angles: FloatArray) -> FloatArray:
    """Quaternions w, x, y, z (N, 4) of R = Rz(rz) Ry(ry) Rx(rx) from angles rx, ry, rz (N, 3) [rad]."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles.T / 2), np.sin(angles.T / 2)
    return np.column_stack(
        [
            cx * cy * cz + sx * sy * sz,
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
        ]
    )


def unknown_columns(table: Table, places: Sequence[int]) -> tuple[dict[str, FloatArray], dict[str, list[str]]]:
    """The columns at `places` as they are: those that hold numbers, and those that hold text."""
    extra: dict[str, FloatArray] = {}
    extra_labels: dict[str, list[str]] = {}
    for place in places:
        try:
            extra[table.names[place]] = table.numbers(place)
        except ParseError:
            extra_labels[table.names[place]] = table.labels(place)
    return extra, extra_labels


def _listed(names: Sequence[str], most: int = 12) -> str:
    return ", ".join(f"'{name:.60}'" for name in names[:most]) + (", ..." if len(names) > most else "")
