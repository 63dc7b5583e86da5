# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Warnings about extrapolation: joint profiles and drifts outside their range, joints that never moved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fastcal.calibration.data_notes import covered, ranges
from fastcal.effects.entries import core_options, label, traits_of
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_column, joint_name, place_of
from fastcal.robot.robot import Robot, Spec
from fastcal.robot.steady import warmed
from fastcal.said import said
from fastcal.units import from_si

_OTHERS = {"payload": said("payload"), "temperature": said("temperature")}
_LOADS = frozenset(["torque", "load"])  # what effects that yield to weights look at
# A quantity whose range in the measurements is no larger stood still.
STILL = {"deg": 1.0, "mm": 2.0, "kg": 0.0, "c": 0.5}


def range_notes(robot: Robot, data: Dataset) -> list[str]:
    """A sentence for each profile or drift that some row is outside of, and each quantity that the data move first.

    And for temperatures and payloads that are far from those that the model was fitted on.
    """
    notes = [*unmoved_notes(robot, data), *_far_temperatures(robot, data), *_heavy_payloads(robot, data)]
    for entry in robot.entries:
        known = traits_of(entry["effect"]).options_from_data
        if "range" in known:
            notes += _beyond_its_range(entry, robot, data)
        if "times" in known:
            notes += _beyond_its_times(entry, data)
    return notes


def _beyond_its_range(entry: Spec, robot: Robot, data: Dataset) -> list[str]:
    options = core_options(entry)
    if "low" not in options or "high" not in options:
        return []
    joint = place_of(entry["owner"]).index
    outside = (data.q[:, joint] < options["low"]) | (data.q[:, joint] > options["high"])
    if not outside.any():
        return []
    unit = robot.joints[joint].unit
    low, high = (from_si(options[key], unit) for key in ("low", "high"))
    return [
        said(
            "joint {joint} is outside the {low:.4g} to {high:.4g} {unit} that its profile was fitted on in {rows} "
            "of {all} rows; there the profile fades to zero within 5 {unit}",
            joint=joint + 1,
            low=float(low),
            high=float(high),
            unit=unit,
            rows=int(outside.sum()),
            all=len(data),
        )
    ]


def _beyond_its_times(entry: Spec, data: Dataset) -> list[str]:
    options = core_options(entry)
    if data.time is None or "first" not in options or "last" not in options:
        return []
    outside = (data.time < options["first"]) | (data.time > options["last"])
    if not outside.any():
        return []
    return [
        said(
            "the time is outside the {first:.6g} to {last:.6g} s that {effect} was fitted on in {rows} rows; there it "
            "is held constant",
            first=float(options["first"]),
            last=float(options["last"]),
            effect=label(entry),
            rows=int(outside.sum()),
        )
    ]


def _far_temperatures(robot: Robot, data: Dataset) -> list[str]:
    """Farther outside of the temperatures of the fit than these lie apart: a line through them says little there."""
    if not warmed(robot):
        return []
    numbers = _far_outside(robot, data, "temperature_c", lambda low, high: (2 * low - high, 2 * high - low))
    if not numbers:
        return []
    return [
        said(
            "the temperature is far outside the {low:.4g} to {high:.4g} deg C that the model was fitted on in {rows} "
            "rows ({least:.4g} to {most:.4g} deg C in all)",
            **numbers,
        )
    ]


def _heavy_payloads(robot: Robot, data: Dataset) -> list[str]:
    """More than twice the heaviest of the fit, as where they are given in another unit."""
    if all(_LOADS.isdisjoint(traits_of(entry["effect"]).depends_on) for entry in robot.entries):
        return []
    numbers = _far_outside(robot, data, "payload_kg", lambda low, high: (-np.inf, 2 * high))
    if not numbers:
        return []
    return [
        said(
            "the payload is far outside the {low:.4g} to {high:.4g} kg that the model was fitted on in {rows} rows "
            "({least:.6g} to {most:.6g} kg in all)",
            **numbers,
        )
    ]


def _far_outside(
    robot: Robot, data: Dataset, name: str, limits: Callable[[float, float], tuple[float, float]]
) -> dict[str, Any]:
    """A column's range in the fit and here, and how many rows lie beyond the limits that its fit sets; empty: none."""
    here = ranges(robot, data).get(name)
    if robot.record is None or here is None or name not in robot.record.covered:
        return {}
    low, high = map(float, robot.record.covered[name])
    least, most = limits(low, high)
    rows = int(np.sum((here < least) | (here > most)))
    if high - low <= STILL[name.rsplit("_", 1)[1]] or not rows:
        return {}
    return {"low": low, "high": high, "rows": rows, "least": float(here.min()), "most": float(here.max())}


def still_joints(robot: Robot, data: Dataset) -> list[str]:
    """The joints that stood still in these rows, by name; none of an arm of poses."""
    ranged = covered(robot, data)
    still = []
    for k, joint in enumerate(robot.joints):
        low, high = ranged.get(joint_column(k, joint.unit), (-np.inf, np.inf))
        if high - low <= STILL[joint.unit]:
            still.append(joint_name(k))
    return still


def unmoved_notes(robot: Robot, data: Dataset) -> list[str]:
    """A sentence for each joint, the payload and the temperature that the calibration's rows never moved and these do.

    What such a quantity could not show is in the stated deviations as the plausible size of what was held.
    """
    record = robot.record
    if record is None:
        return []
    here = ranges(robot, data)
    for joint in robot.passive:  # where the loops close, no motor moves them
        del here[joint_column(joint, robot.joints[joint].unit)]
    notes: list[str] = []
    for name, (low, high) in record.covered.items():
        quantity, unit = name.rsplit("_", 1)
        if name not in here or high - low > STILL[unit]:
            continue
        outside = (here[name] < low - STILL[unit] - 1e-9) | (here[name] > high + STILL[unit] + 1e-9)
        if outside.any():
            if unit in ("deg", "mm"):
                title = said("joint {number}", number=quantity.removeprefix("q"))
            else:
                title = said("the {quantity}", quantity=_OTHERS[quantity])
            if high - low < 1e-9:
                at = said("{at:.4g} {unit}", at=float(low), unit=unit.replace("c", "deg C"))
            else:
                at = said("{low:.4g} to {high:.4g} {unit}", low=float(low), high=float(high), unit=unit)
            notes.append(
                said(
                    "{what} stood still in the measurements that this model was fitted to ({at}) and is elsewhere in "
                    "{rows} rows: the stated deviations include plausible sizes of what could not be identified",
                    what=title,
                    at=at,
                    rows=int(outside.sum()),
                )
            )
    return notes
