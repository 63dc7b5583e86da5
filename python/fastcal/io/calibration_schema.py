# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the key `calibration` of a robot or cell file may hold: how sure an identified model is."""

from __future__ import annotations

from typing import Any

from fastcal.io.fields import Fields
from fastcal.io.rig_schema import check_unknowns
from fastcal.robot.calibration_record import unpacked
from fastcal.robot.controller_robot import GEOMETRY
from fastcal.units import UNITS

Spec = dict[str, Any]
LARGEST_MOVE = 1e6  # SI; by how much a parameter can move with another that is off by its plausible size


def check_calibration(fields: Fields, joints: list[Spec]) -> Spec:
    """How sure an identified model is: covariance = L L^T of its parameters in SI.

    Row i of L with i + 1 numbers, or all of them as `calibration_record.packed` writes them.
    """
    names = fields.names("parameters")
    record: Spec = {"parameters": names, "covariance_root": _covariance_root(fields, len(names))}
    of_points = fields.optional("sigma_mm") if fields.has("noise") else fields.take("sigma_mm")
    record["sigma_mm"] = None if of_points is None else fields.checked_number("sigma_mm", of_points)
    record["degrees_of_freedom"] = fields.count("degrees_of_freedom", 0, 10**9)
    if (turn := fields.optional("sigma_deg")) is not None:
        record["sigma_deg"] = fields.checked_number("sigma_deg", turn)
    if fields.has("noise"):
        record["noise"] = _noise(fields)
    if fields.has("held"):
        record["held"] = _held(fields.inner("held"))
    if fields.has("covered"):
        covered = fields.take("covered")
        if not isinstance(covered, dict):
            fields.fail("covered", "a range by quantity", covered)
        record["covered"] = {str(k): fields.checked_vector(f"covered.{k}", v, 2) for k, v in covered.items()}
    if fields.has("unknowns"):
        record["unknowns"] = check_unknowns(fields.inner("unknowns"), names)
    if fields.has("nominal"):
        record["nominal"] = _nominal(fields.inner("nominal"), joints)
    return record | fields.rest()


def _noise(fields: Fields) -> Spec:
    """Value and unit of the noise of each kind of reading."""
    kinds = fields.take("noise")
    if not isinstance(kinds, dict):
        fields.fail("noise", "a value and a unit by kind of reading", kinds)
    out = {}
    for kind, given in kinds.items():
        own = Fields(given, f"{fields.where}.noise.{kind}", fields.path)
        unit = own.text("unit")
        if unit not in UNITS or UNITS[unit].kind not in ("length", "angle", "pixel"):
            own.fail("unit", "a unit of length, angle or pixels", unit)
        out[str(kind)] = {"value": own.number("value"), "unit": unit}
    return out


def _covariance_root(fields: Fields, count: int) -> list[list[float]] | str:
    rows = fields.take("covariance_root")
    if isinstance(rows, str):
        try:
            unpacked(rows, count)
        except ValueError:
            numbers = count * (count + 1) // 2
            fields.fail(
                "covariance_root", f"{numbers} numbers of 8 bytes below 1e100 in base64", f"{len(rows)} characters"
            )
        return rows
    if not isinstance(rows, list) or len(rows) != count:
        fields.fail("covariance_root", f"a list of {count} rows", rows)
    return [fields.checked_vector(f"covariance_root[{i}]", row, i + 1) for i, row in enumerate(rows)]


def _held(fields: Fields) -> Spec:
    """What the measurements did not show: names of parameters, and how they move with each that was held."""
    names = fields.names("parameters")
    columns = fields.take("directions")
    if not isinstance(columns, list):
        fields.fail("directions", "a list of directions", columns)
    directions = [fields.checked_vector(f"directions[{i}]", c, len(names)) for i, c in enumerate(columns)]
    for i, column in enumerate(directions):
        if max(map(abs, column), default=0.0) > LARGEST_MOVE:
            fields.fail(f"directions[{i}]", f"numbers up to {LARGEST_MOVE:g}", max(column, key=abs))
    return {"parameters": list(names), "directions": directions}


def _nominal(fields: Fields, joints: list[Spec]) -> Spec:
    """The robot before it was calibrated: the geometry of each joint, in the keys that the model has, and its ends."""
    given = fields.entries("joints", len(joints), len(joints))
    checked = [
        {key: _alike(each, key, joint[key]) for key in GEOMETRY if key in joint}
        for each, joint in zip(given, joints, strict=True)
    ]
    for each in given:
        each.done()
    return {"joints": checked} | fields.rest()


def _alike(fields: Fields, key: str, other: Any) -> Any:
    """A number, a list of numbers or a mapping of such, where another has it."""
    if isinstance(other, dict):
        inner = fields.inner(key)
        return {name: _alike(inner, name, value) for name, value in other.items()}
    return fields.vector(key, len(other)) if isinstance(other, list) else fields.number(key)
