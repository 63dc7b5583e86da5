# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arms at one temperature, that of a program or a test: which effects ask for it, and what nobody needs to say then."""

from __future__ import annotations

from fastcal.effects import registered
from fastcal.effects.entries import label, lag_of, traits_of
from fastcal.robot.robot import Robot


def warmed(robot: Robot) -> list[str]:
    """The arm's own effects that look at the temperature, as on a command line."""
    found = []
    for entry, effect in zip(robot.spec.get("effects") or [], robot.effects, strict=True):
        own = registered.find(entry["effect"])
        columns = own.columns if own else effect.data_columns
        if "temperature" in columns and not traits_of(entry["effect"]).of_the_measurement:
            found.append(label(entry))
    return found


def steady(robot: Robot) -> dict[str, float]:
    """The condition time [s] where an effect lags behind the temperature: at one temperature any time does."""
    return {"time": 0.0} if any(lag_of(entry) > 0 for entry in robot.spec.get("effects") or []) else {}
