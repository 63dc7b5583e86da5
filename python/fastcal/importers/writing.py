# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What was imported as a table of the contract: for a measurement file, or as a data set at once."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import ParseError
from fastcal.importers.reading import Column, Reading
from fastcal.io.measurements import dataset_from_table
from fastcal.io.table import Cells, Table
from fastcal.io.tables import write_csv
from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.dataset import Dataset
from fastcal.robot.pendant import Pendant
from fastcal.units import unit_names

_MEASURED = re.compile(r"(x|y|z|rx|ry|rz|sigma|sigma_rot)_[^@]*$|q[wxyz]$")  # of a target
_LATEST = 1e12  # [s] 30,000 years: what is beyond tells no time


@dataclass(frozen=True)
class _AnyRobot:
    """An arm of which only the kinds of its joints are known, by the units of their columns."""

    joint_types: list[str]
    reach: float = float("inf")
    mimics: tuple[tuple[int, int, float, float], ...] = ()
    passive: tuple[int, ...] = ()
    beside: tuple[int, ...] = ()

    @property
    def pendant(self) -> Pendant:
        n = len(self.joint_types)
        return Pendant(np.eye(n), np.zeros(n), tuple(range(n)))

    def follow(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        return q

    @property
    def limits(self) -> NDArray[np.float64]:
        return np.tile([-np.inf, np.inf], (len(self.joint_types), 1))


def table_of(reading: Reading) -> Table:
    """The columns of the contract in its order: name, joints, point, orientation, conditions."""
    columns: dict[str, Column] = {}
    if reading.names is not None:
        columns["name"] = reading.names
    order = ("q", "x_", "y_", "z_", "qw", "qx", "qy", "qz", "rx", "ry", "rz")

    def rank(name: str) -> tuple[int, int]:
        if "@" in name:  # of another target, as the map has them
            return 3, 0
        if name[0] in "qj" and name[1].isdigit():
            return int("_read_" in name), int("".join(filter(str.isdigit, name.split("_")[0])))
        return 2, next((k for k, start in enumerate(order[1:]) if name.startswith(start)), len(order))

    for name in sorted(reading.columns, key=rank):
        columns[name] = reading.columns[name]
    if reading.times is not None and not any(name.startswith("time_") for name in columns):
        seconds = reading.times.seconds
        if np.isfinite(seconds).all() and np.abs(seconds).max() < _LATEST:
            columns["time_s"] = np.round(seconds - seconds.min(), 6)
    cells: list[Cells] = list(columns.values())
    return Table(reading.path, list(columns), cells, lines=reading.lines, notes=tuple(reading.notes))


def imported_dataset(reading: Reading, robot: RobotFacts | None) -> Dataset:
    """The rows as a data set in SI, checked as a measurement file is.

    Raises:
        ParseError: A value is invalid; names file, line and column.
    """
    if robot is None:
        units = [
            next(n for n in reading.columns if n.startswith((f"q{j}_", f"j{j}_"))) for j in range(1, reading.joints + 1)
        ]
        lengths = unit_names("length")
        robot = _AnyRobot(["prismatic" if name.split("_")[-1] in lengths else "revolute" for name in units])
    try:
        return dataset_from_table(table_of(reading), robot)
    except ParseError as error:
        if reading.sheet is None:
            raise
        raise type(error)(f"sheet '{reading.sheet}': {error.message}", error.path, error.line) from None


def write_imported(path: str | os.PathLike[str], reading: Reading, robot: RobotFacts | None) -> int:
    """Writes a measurement file with the numbers and units of the export, whole or not at all; returns its rows.

    Raises:
        ParseError: A value is invalid. InvalidInput: The file can't be written.
    """
    imported_dataset(reading, robot)
    table = table_of(reading)
    names = [f"{name}@{reading.target}" if reading.target and _MEASURED.match(name) else name for name in table.names]
    write_csv(path, {name: list(map(_plain, column)) for name, column in zip(names, table.columns, strict=True)})
    return len(reading)


def _plain(value: float | str) -> float | str:
    """A number without the dust of a change of units: 12 significant digits, beyond any instrument."""
    return value if isinstance(value, str) else float(f"{value:.12g}")
