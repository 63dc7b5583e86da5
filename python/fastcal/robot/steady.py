# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms at one temperature, that of a program or a test: which effects ask for it, and what nobody needs to say then."""

from __future__ import annotations

from fastcal.effects.entries import conditions_read, label, lag_of, traits_of
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.robot import Robot
from fastcal.units import from_si


def warmed(robot: Robot) -> list[str]:
    """The arm's own effects that look at the temperature, as on a command line."""
    found = []
    for entry, effect in zip(robot.entries, robot.effects, strict=True):
        if "temperature" in conditions_read(entry, effect) and not traits_of(entry["effect"]).of_the_measurement:
            found.append(label(entry))
    return found


def assumed_temperature(record: CalibrationRecord) -> str:
    """`record.temperature` in words, where nobody says one: in degC, and why that."""
    why = "the middle of what the model was fitted on" if "temperature_c" in record.covered else "a room's"
    return f"{from_si(record.temperature, 'c'):.4g} degC, {why}"


def steady(robot: Robot) -> dict[str, float]:
    """The condition time [s] where an effect lags behind the temperature: at one temperature any time does."""
    return {"time": 0.0} if any(lag_of(entry) > 0 for entry in robot.entries) else {}
