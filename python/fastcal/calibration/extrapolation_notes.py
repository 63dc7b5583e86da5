# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a model's joint profiles say nothing, in words: rows outside the joint range that they were fitted on."""

from __future__ import annotations

from fastcal.effects.entries import core_options, traits_of
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, length_or_angle_unit
from fastcal.units import from_si


def range_notes(robot: Robot, data: Dataset) -> list[str]:
    """A sentence for each profile that some row lies outside of."""
    notes = []
    for entry in robot.spec.get("effects") or []:
        options = core_options(entry) if "range" in traits_of(entry["effect"]).options_from_data else {}
        if "low" not in options or "high" not in options:
            continue
        joint = int(entry["owner"].removeprefix("joint")) - 1
        outside = (data.q[:, joint] < options["low"]) | (data.q[:, joint] > options["high"])
        if outside.any():
            unit = length_or_angle_unit(robot.spec["joints"][joint])
            low, high = (from_si(options[key], unit) for key in ("low", "high"))
            notes.append(
                f"joint {joint + 1} is outside the {low:.4g} to {high:.4g} {unit} that its profile was fitted on in "
                f"{int(outside.sum())} rows; there the profile fades to zero within 5 {unit}"
            )
    return notes
