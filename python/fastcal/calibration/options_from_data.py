# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an effect takes from the data and robot that it is first fitted on and keeps: origins, labels, ranges.

Temperature and time are counted from the middle of the data: there the geometry is as identified, and least correlated
with the effect. An effect whose range is that of its data covers, once it is fitted to further data, all of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.effects.entries import Spec, build_effects, core_options, effect_owners, label, traits_of, written_list
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import ColumnOnDisk, LongDataset
from fastcal.place import place_of
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot
from fastcal.units import from_si

Rows = Dataset | LongDataset

_COVERED = ("first_s", "last_s")
_DECIMALS = 3  # an origin is a choice: milliseconds and millikelvins of it mean nothing


def with_origins(entry: Spec, robot: Robot, data: Rows) -> Spec:
    """The entry with the options that the data decide; those that it has already stay, but for times that are covered.

    Raises:
        InvalidInput: The data have no such column, or too little in it.
    """
    filled: Spec = {}
    for option in traits_of(entry["effect"]).options_from_data:
        filled |= _FILLERS[option](entry, robot, data)
    covered = {option: filled[option] for option in _COVERED if option in filled}
    return {**filled, **entry, **covered}


def with_reference(entry: Spec, robot: Robot) -> Spec:
    """The entry with what its numbers count from on this robot: on an identified one they would count from another."""
    if "reference" not in traits_of(entry["effect"]).options_from_data:
        return entry
    return {**_reference(entry, robot), **entry}


def _parts(data: Rows, field: str, name: str = "") -> Iterator[FloatArray] | None:
    """A column, the rows of a long data set some at a time; None where there is none."""
    if isinstance(data, LongDataset):
        found = data.column(field)
        column = found.get(name) if isinstance(found, dict) else found
        return column.parts() if isinstance(column, ColumnOnDisk) else None
    values = getattr(data, field)
    if name:
        values = values.get(name)
    return None if values is None else iter([values])


def _mean(entry: Spec, data: Rows, field: str, title: str) -> float:
    parts = _parts(data, field)
    if parts is None:
        raise _missing(entry, title)
    return float(sum(np.sum(part) for part in parts) / len(data))


def _extent(parts: Iterator[FloatArray]) -> tuple[float, float]:
    """Least and greatest number."""
    ends = [(float(part.min()), float(part.max())) for part in parts]
    return min(low for low, _ in ends), max(high for _, high in ends)


def _temperature(entry: Spec, robot: Robot, data: Rows) -> Spec:
    return {"t0_c": round(from_si(_mean(entry, data, "temperature", "temperature_c"), "c"), _DECIMALS)}


def _time(entry: Spec, robot: Robot, data: Rows) -> Spec:
    return {"t0_s": round(_mean(entry, data, "time", "time_s"), _DECIMALS)}


def _times(entry: Spec, robot: Robot, data: Rows) -> Spec:
    """From the first row to the last, and what the entry covers already."""
    parts = _parts(data, "time")
    if parts is None:
        raise _missing(entry, "time_s")
    first, last = (round(t, _DECIMALS) for t in _extent(parts))
    return {"first_s": min(first, entry.get("first_s", first)), "last_s": max(last, entry.get("last_s", last))}


def _labels(entry: Spec, data: Rows, option: str) -> Spec:
    column = option.removesuffix("s")
    parts = _parts(data, column)
    if parts is None:
        raise _missing(entry, column)
    names = data.names(column) if isinstance(data, LongDataset) else getattr(data, f"{column}_names")
    present = [names[i] for i in dict.fromkeys(code for part in parts for code in dict.fromkeys(part.tolist()))]
    if len(entry.get(option, present)) < 2:
        raise InvalidInput(
            f"{label(entry)} needs at least two labels in the column {column}, and the data have only '{present[0]}'"
        )
    return {option: present}


def _begins(entry: Spec, robot: Robot, data: Rows) -> Spec:
    """When the first row was measured."""
    parts = _parts(data, "time")
    if parts is None:
        raise _missing(entry, "time_s")
    return {"begins_s": round(_extent(parts)[0], _DECIMALS)}


def _stations(entry: Spec, robot: Robot, data: Rows) -> Spec:
    return _labels(entry, data, "stations")


def _mounts(entry: Spec, robot: Robot, data: Rows) -> Spec:
    return _labels(entry, data, "mounts")


def _range(entry: Spec, robot: Robot, data: Rows) -> Spec:
    if core_options(entry).get("periodic"):
        return {}
    joint = place_of(entry["owner"]).index
    low, high = _extent(part[:, joint] for part in _parts(data, "q") or ())
    if not low < high:
        raise InvalidInput(f"{label(entry)} needs data in which joint {joint + 1} moves")
    unit = "rad" if robot.joint_types[joint] == "revolute" else "m"
    return {f"low_{unit}": low, f"high_{unit}": high}


def _order(entry: Spec, robot: Robot, data: Rows) -> Spec:
    """The order; of a wave at least half a period must fit into the joint's range, or offset and ratio do as well."""
    if entry.get("side") == "motor":
        return {}
    joint = place_of(entry["owner"]).index
    low, high = robot.limits[joint]
    order = float(core_options(entry).get("order", 1.0))
    if order * (high - low) < math.pi:
        reach = from_si(float(high - low), "deg")
        raise InvalidInput(
            f"{label(entry)}: of order {order:g} less than half a period fits into the joint's {reach:.4g} deg"
        )
    return {"order": order}


def _size(entry: Spec, robot: Robot, data: Rows) -> Spec:
    """Root mean square of the column, so that its unit does not decide what motion is plausible."""
    parts = _parts(data, "extra", str(entry.get("column", "")))
    if parts is None:
        return {}  # what reads the column says that it is not there
    squares, count = 0.0, 0
    for part in parts:
        squares += float(np.nansum(np.square(part)))
        count += int((~np.isnan(part)).sum())
    rms = math.sqrt(squares / count) if count and math.isfinite(squares) else 0.0
    return {"size": float(f"{rms:.2g}")} if rms > 0 else {}


def _reference(entry: Spec, robot: Robot, data: Rows | None = None) -> Spec:
    """What its numbers count from, as the geometry is before it is identified.

    That of a model that keeps its nominal one, where the entry is new: what an identification leaves of a length says
    little of how the link is built. The numbers that a file has already count from its own table.
    """
    core = robot.core
    if not entry.get("parameters") and robot.description.calibration.get("nominal"):
        nominal = nominal_robot(robot).core
        if entry["owner"] in effect_owners(entry["effect"], nominal):
            core = nominal
    (effect,) = build_effects([entry], core)
    return dict(written_list(*option) for option in effect.reference.items())


def _missing(entry: Spec, column: str) -> InvalidInput:
    return InvalidInput(f"{label(entry)} needs the column {column}, which the data do not have")


_FILLERS: dict[str, Callable[[Spec, Robot, Rows], Spec]] = {
    "t0_c": _temperature,
    "t0_s": _time,
    "times": _times,
    "begins_s": _begins,
    "stations": _stations,
    "mounts": _mounts,
    "range": _range,
    "order": _order,
    "size": _size,
    "reference": _reference,
}
