# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What was measured, as the core reads it, and the best rigid fit of base and tool to it."""

from __future__ import annotations

from fastcal import _core
from fastcal.calibration.moving_rig import rig_of
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import core_tables, expected_columns, kinds_of
from fastcal.robot.robot import Robot


def measurements(data: Dataset, robot: Robot) -> _core.Measurements:
    """What was measured of a robot, as the core reads it."""
    if not kinds_of(data):
        raise InvalidInput(f"{data.source}: no measured column; expected {expected_columns()}")
    try:
        return _core.Measurements(robot.core, len(data), *core_tables(data), rig_of(robot, data))
    except InvalidInput as error:
        if str(error).startswith("column '"):  # the core knows the rows, and not the file that they are of
            raise InvalidInput(f"{data.source}: {error}") from None
        raise


def align(robot: Robot, data: Dataset, threads: int = 1) -> _core.Alignment:
    """Best rigid fit of base and tool (and the observations' unknowns) to the data; no initial guess."""
    return _core.align(robot.error_model, robot.samples(data), measurements(data, robot), threads)


def noise_by_observation(measured: _core.Measurements, noise: tuple[float, float, float]) -> list[float]:
    """A noise for each observation out of those of positions [m], of all that is in rad, of other lengths [m]."""
    position, turn, other = noise
    return [turn if of.unit == "rad" else position if of.field == "position" else other for of in measured.observations]
