# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows in files as the core reads them, part by part."""

from __future__ import annotations

from collections.abc import Sequence

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.effects.entries import LAGGED, SINCE, extra_columns
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.robot.robot import Robot

Rows = tuple[_core.Samples, _core.Measurements]


class CoreRows:
    """The rows of a long data set as the core reads them, for a robot with its effects."""

    def __init__(self, robot: Robot, data: LongDataset) -> None:
        columns = extra_columns(robot.entries)
        if any(column.startswith(SINCE) for column in columns):
            raise InvalidInput(f"{data.source}: a step at a row needs all rows in memory; give time_s or fewer rows")
        if any(column.startswith(LAGGED) for column in columns):
            raise InvalidInput(
                f"{data.source}: a lag of the temperature needs all rows in memory; leave lag_s out, or take fewer rows"
            )
        self._robot, self._data = robot, data

    def __len__(self) -> int:
        return len(self._data)

    def read(self, begin: int, end: int) -> Rows:
        """Rows begin ... end - 1."""
        return self._core_rows(self._data.read(begin, end, moves=bool(self._robot.effects)))

    def pick(self, rows: Sequence[int]) -> Rows:
        """The given rows, in ascending order."""
        return self._core_rows(self._data.pick(rows))

    def _core_rows(self, part: Dataset) -> Rows:
        robot = self._robot
        samples = robot.samples(part) if robot.effects else robot.conditions(part.q)  # nothing else is looked at
        return samples, measurements(part, robot)
