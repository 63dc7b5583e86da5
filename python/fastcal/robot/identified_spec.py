# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The robot file of an identified model: found numbers in the table of its own kind, effects with their deviations."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.effects.entries import traits_of
from fastcal.effects.values import written_parameters
from fastcal.place import joint_name
from fastcal.robot.core_model import ROW_KEYS, ROW_UNITS, pose, screw
from fastcal.robot.loops import write_loops
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot import Robot, Spec
from fastcal.robot.robot_spec import Joint, frame_spec, structured
from fastcal.units import from_si


class Solution(Protocol):
    """Identified parameters, SI: the core's `Identification` is one."""

    @property
    def theta(self) -> FloatArray:
        """(P,) all parameters of a model, then the places of anchors."""

    @property
    def free(self) -> list[int]:
        """Indices, ascending, of those that were identified."""

    @property
    def covariance(self) -> FloatArray:
        """(F, F) of these."""


@dataclass(frozen=True, eq=False)
class Values:
    """A solution: theta (P,), and which of it has a covariance; none where it is unknown."""

    theta: FloatArray
    free: list[int] = field(default_factory=list)
    covariance: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))


def with_frames(spec: Spec, T_world_base: FloatArray, T_flange_tool: FloatArray) -> Spec:
    """The spec with other base and tool, in edge units."""
    out = plain_copy(spec)
    out["base"], out["tool"] = frame_spec(T_world_base), frame_spec(T_flange_tool)
    return out


def moved(robot: Robot, T_world_base: FloatArray, T_flange_tool: FloatArray) -> Robot:
    """The robot with other base and tool; the chain between them is not built again."""
    return robot.with_(base=frame_spec(T_world_base), tool=frame_spec(T_flange_tool))


def identified_spec(start: Robot, model: _core.ErrorModel, found: Solution) -> Spec:
    """The robot file of the identified model: the start's, with the found numbers in its own table."""
    theta = np.asarray(found.theta)[: len(model.start)]
    own = len(model.robot.nominal)
    spec = with_frames(start.spec, *model.robot.base_and_tool(theta[:own]))
    values: dict[str, dict[str, float]] = {}
    for parameter, value in zip(model.parameters[:own], theta[:own].tolist(), strict=True):
        values.setdefault(parameter.owner, {})[parameter.name] = value
    for i, joint in enumerate(spec["joints"]):
        _set_joint(joint, spec["kinematics"], values.get(joint_name(i), {}))
    write_loops(spec, values)
    if not start.effects:
        return spec
    covariance = np.full((len(theta), len(theta)), np.nan)
    free = [i for i in found.free if i < len(theta)]
    covariance[np.ix_(free, free)] = np.asarray(found.covariance)[
        : len(free), : len(free)
    ]  # free ones ascend, anchors come last
    at = own
    for entry, effect in zip(spec.get("effects") or [], start.effects, strict=True):
        part = slice(at, at + len(effect.parameters))
        written = written_parameters(entry, effect, theta[part], covariance[part, part])
        for option in traits_of(entry["effect"]).among_parameters:
            entry.pop(option, None)
        entry["parameters"] = written
        at = part.stop
    return spec


def _set_joint(joint: Spec, kinematics: str, values: dict[str, float]) -> None:
    """Writes identified SI numbers into one joint of a spec."""
    if kinematics in ("dh", "mdh"):
        for name, key in ROW_KEYS.items():
            joint[key] = from_si(values[name], ROW_UNITS[key])
        return
    shift = np.eye(4)
    shift[:3, 3] = [values["x"], values["y"], values.get("z", 0.0)]
    shift[:3, :3] = (
        _core.rotation_about("x", values["rx"])
        @ _core.rotation_about("y", values["ry"])
        @ _core.rotation_about("z", values.get("rz", 0.0))
    )
    if kinematics == "urdf":
        joint["origin"] = frame_spec(pose(joint["origin"]) @ shift)
        return
    direction, point = _poe_axis(screw(structured(Joint, joint)), joint["type"], shift)
    if joint["type"] == "prismatic":
        joint["v"] = direction.tolist()
        joint["d_mm"] = from_si(values["d"], "mm")
    else:
        joint["omega"] = direction.tolist()
        joint["theta_deg"] = from_si(values["theta"], "deg")
        joint.pop("v_mm", None)
        joint["point_mm"] = [from_si(float(v), "mm") for v in point]


def _poe_axis(values: FloatArray, kind: str, shift: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Direction (3,) and a point (3,) [m] of a screw after the error motion `shift` of its axis frame."""
    omega, v = values[:3], values[3:6]
    frame = np.eye(4)
    frame[:3, :3] = _core.rotation_to_axis(v if kind == "prismatic" else omega)
    if kind != "prismatic":
        frame[:3, 3] = np.cross(omega, v)
    moved = frame @ shift
    return moved[:3, 2], moved[:3, 3]
