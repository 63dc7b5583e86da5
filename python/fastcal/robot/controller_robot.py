# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The kinematics that a robot's controller has: geometry as the calibration found it given, and no effects."""

from __future__ import annotations

from typing import Any

from fastcal.errors import InvalidInput
from fastcal.robot.core_model import ROW_KEYS
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot import Robot, Spec

GEOMETRY = (*ROW_KEYS.values(), "omega", "point_mm", "v", "v_mm", "origin", "axis")  # keys of a joint
_ENDS = ("home", "flange", "loops")  # keys of the robot


def nominal_record(start: Spec) -> Spec:
    """What a calibrated model keeps of the robot that it came from: the first one, however often it was calibrated."""
    earlier = (start.get("calibration") or {}).get("nominal")
    if earlier:
        return plain_copy(dict(earlier))
    record: Spec = {key: plain_copy(start[key]) for key in _ENDS if key in start}
    record["joints"] = [{key: plain_copy(joint[key]) for key in GEOMETRY if key in joint} for joint in start["joints"]]
    return record


def nominal_robot(model: Robot, given: Robot | None = None) -> Robot:
    """The robot as its controller has it, in the model's base and with the model's tool.

    Args:
        model: A calibrated model, or any robot: without a calibration its own geometry is the controller's.
        given: The nominal robot, where the model does not keep one.

    Raises:
        InvalidInput: The model is calibrated and says nothing of what it was before.
    """
    spec = model.spec
    ends: dict[str, Any] = {"base": spec["base"], "tool": spec["tool"], "effects": []}
    if given is not None:
        if given.joint_types != model.joint_types:
            raise InvalidInput(f"{given.name} and {model.name} don't have the same joints; expected one robot")
        return Robot(_same_end(_plain(given.spec), spec) | ends)
    record = (spec.get("calibration") or {}).get("nominal")
    if record is None:
        if spec.get("calibration"):
            raise InvalidInput(f"{model.name} does not keep its nominal geometry; give the nominal robot file as well")
        return Robot(_plain(spec) | ends)
    joints = [
        {key: value for key, value in joint.items() if key not in GEOMETRY} | geometry
        for joint, geometry in zip(spec["joints"], record["joints"], strict=True)
    ]
    kept = {key: record[key] for key in _ENDS if key in record}
    return Robot(_plain(spec) | kept | {"joints": joints} | ends)


def _same_end(given: Spec, spec: Spec) -> Spec:
    """The given table with the flange of the model's table, from which the model's tool is told."""
    if not {given["kinematics"], spec["kinematics"]} <= {"dh", "mdh"}:
        return given
    return {key: value for key, value in given.items() if key != "flange"} | {
        key: spec[key] for key in ("flange",) if key in spec
    }


def _plain(spec: Spec) -> Spec:
    """The spec without what belongs to a calibration or to loads."""
    return {
        key: value
        for key, value in spec.items()
        if key not in ("calibration", "correction", "structure", "compensator")
    }
