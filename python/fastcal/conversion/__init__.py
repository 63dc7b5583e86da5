# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Any robot file as any other kind: the same tool pose for every q, the same bodies, limits, gears and effects."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from fastcal import units
from fastcal.arrays import FloatArray
from fastcal.conversion.chain import Body, Chain, Spec, chain_of, si
from fastcal.conversion.rows import dh_rows, mdh_rows
from fastcal.effects.entries import traits_of
from fastcal.errors import InvalidInput
from fastcal.place import joint_name
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.loops import has_branches

KINDS = ("dh", "mdh", "poe", "urdf")


class HasSpec(Protocol):
    """A robot that knows its file."""

    @property
    def spec(self) -> Spec: ...  # noqa: D102


class Conversion(NamedTuple):
    """A converted robot.

    Attributes:
        spec: The canonical spec of the new kind.
        dropped: What the new kind can't carry and was left out, such as `link_bending@link2`.
        notes: What else a reader should know, a sentence each.
    """

    spec: Spec
    dropped: tuple[str, ...]
    notes: tuple[str, ...]


class _Geometry(NamedTuple):
    """The joints and ends of the new kind, whose flange is the old one; the new base frame in the old one."""

    joints: list[Spec]
    ends: Spec
    base: FloatArray


def convert(robot: HasSpec | Spec, to: str, drop_effects: bool = False) -> Conversion:
    """Writes a robot as another kind: T_measuring_tool(q) stays within rounding (1e-12 m and rad) for every q.

    Nearly parallel neighbouring axes go to beta and never to a far d. Base and flange take what rows can't hold;
    gravity is turned with the base.

    Args:
        robot: A robot or its canonical spec.
        to: dh, mdh, poe or urdf.
        drop_effects: Leave out what refers to frames that the new kind does not have, and name it.

    Raises:
        InvalidInput: The kind is none, or the robot has effects that the new kind can't carry, or closed loops.
    """
    spec: Spec = robot if isinstance(robot, dict) else robot.spec
    if to not in KINDS:
        raise InvalidInput(f"expected dh, mdh, poe or urdf as the kind to convert to, got {to!r}")
    if to == spec["kinematics"]:
        return Conversion(copy.deepcopy(spec), (), ())
    if has_branches(spec):
        raise InvalidInput(f"{spec['name']} has branches or closed loops, which only its own kind of file carries")
    geometry = {"dh": _rows, "mdh": _rows, "poe": _as_poe, "urdf": _urdf}[to](chain_of(spec), spec, to)
    effects, dropped = _carried(spec, geometry)
    if spec.get("correction") is not None:
        dropped = (*dropped, "the trained correction")
    if dropped and not drop_effects:
        raise InvalidInput(
            f"{', '.join(dropped)} can't be carried from {spec['kinematics']} to {to}, where the frames they refer to "
            "are others; allow them to be dropped (--drop-effects) or keep the kind"
        )
    new: Spec = {"name": spec["name"], "kinematics": to, "joints": geometry.joints} | geometry.ends
    new |= {key: copy.deepcopy(spec[key]) for key in ("coupling", "pendant") if key in spec}
    new |= _surroundings(spec, geometry)
    new |= {"effects": effects, "structure": {}}
    if "notes" in spec:
        new["notes"] = list(spec["notes"])
    return Conversion(new, dropped, _notes(spec, geometry))


def _rows(chain: Chain, spec: Spec, to: str) -> _Geometry:
    table = (dh_rows if to == "dh" else mdh_rows)(chain)
    joints = []
    for row, frame, body, old in zip(table.rows, table.frames, chain.bodies, spec["joints"], strict=True):
        values = zip(("theta_deg", "d_mm", "a_mm", "alpha_deg", "beta_deg"), row, strict=True)
        shape = {name: _edge(value, name.rpartition("_")[2]) for name, value in values}
        joints.append(_joint(old, shape, body, frame))
    ends = {} if _is_identity(table.flange) else {"flange": _frame(table.flange)}
    return _Geometry(joints, ends, table.base)


def _as_poe(chain: Chain, spec: Spec, to: str) -> _Geometry:
    return poe_geometry(chain, spec["joints"])


def poe_geometry(chain: Chain, old: Sequence[Spec]) -> _Geometry:
    """A chain as screws; `old`: its joints' types, limits, gears and bodies."""
    joints = []
    for i, (body, joint) in enumerate(zip(chain.bodies, old, strict=True)):
        point = chain.point(i)
        if point is None:
            shape: Spec = {"omega": [0.0] * 3, "v": _list(chain.v[i], "1"), "d_mm": 0.0}
        else:
            shape = {"omega": _list(chain.omega[i], "1"), "point_mm": _list(point, "mm"), "theta_deg": 0.0}
        joints.append(_joint(joint, shape, body, np.eye(4)))
    return _Geometry(joints, {"home": _frame(chain.home)}, np.eye(4))


def _urdf(chain: Chain, spec: Spec, to: str) -> _Geometry:
    """Each joint's frame has z on its axis, turned and moved from the frame before no more than that takes."""
    joints = []
    T = np.eye(4)
    for i, (body, old) in enumerate(zip(chain.bodies, spec["joints"], strict=True)):
        u, point = chain.direction(i), chain.point(i)
        origin = T[:3, 3] if point is None else point + ((T[:3, 3] - point) @ u) * u
        now = se3.pose(se3.turn_between(T[:3, 2], u, T[:3, 0]) @ T[:3, :3], origin)
        shape = {"origin": _frame(se3.inverse(T) @ now), "axis": [0.0, 0.0, 1.0]}
        joints.append({"name": joint_name(i)} | _joint(old, shape, body, now))
        T = now
    return _Geometry(joints, {"flange": _frame(se3.inverse(T) @ chain.home)}, np.eye(4))


def _joint(old: Spec, shape: Spec, body: Body | None, frame: FloatArray) -> Spec:
    """Type, shape, limits, gear and the body seen from `frame`, in the order of the canonical form."""
    unit = "deg" if old["type"] == "revolute" else "mm"
    kept = {key: old[key] for key in (f"min_{unit}", f"max_{unit}", "motor_ratio", "mimic") if key in old}
    joint: Spec = {"type": old["type"]} | shape | kept
    if body is not None:
        seen = body.moved(se3.inverse(frame))
        joint["link"] = {"mass_kg": seen.mass, "com_mm": _list(seen.com, "mm")}
        if seen.inertia is not None:
            moments = seen.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            joint["link"]["inertia_kg_m2"] = _list(moments, "kg_m2")
    return joint


def _surroundings(spec: Spec, geometry: _Geometry) -> Spec:
    """Base and gravity in the new frames, untouched where the frames are the old ones; tool and payload."""
    kept: Spec = {key: copy.deepcopy(spec[key]) for key in ("base", "tool", "payload", "gravity_m_s2")}
    kept |= {key: spec[key] for key in ("gravity_frame", "wrench_frame", "equilibrium") if key in spec}
    if not _is_identity(geometry.base):
        kept["base"] = _frame(pose(spec["base"]) @ geometry.base)
        if spec["gravity_frame"] == "base":
            kept["gravity_m_s2"] = _list(geometry.base[:3, :3].T @ si(spec["gravity_m_s2"], "m_s2"), "m_s2")
    return kept


def _carried(spec: Spec, geometry: _Geometry) -> tuple[list[Spec], tuple[str, ...]]:
    """The effects that keep their meaning, and the names of what does not."""
    stays = {"axes": True, "base": _is_identity(geometry.base), "flange": True, "rows": False}
    is_kept = {e["effect"]: stays[traits_of(e["effect"]).refers_to] for e in spec["effects"]}
    kept = [copy.deepcopy(effect) for effect in spec["effects"] if is_kept[effect["effect"]]]
    dropped = [f"{e['effect']}@{e['owner']}" for e in spec["effects"] if not is_kept[e["effect"]]]
    return kept, (*dropped, *(key for key in ("compensator",) if spec.get(key)))


def _notes(spec: Spec, geometry: _Geometry) -> tuple[str, ...]:
    notes = []
    if spec["wrench_frame"] == "base" and not _is_identity(se3.pose(geometry.base[:3, :3])):
        notes.append("the base frame was turned: fx_n ... mz_nm are read along its new axes")
    if spec.get("structure"):
        notes.append("the structure's nodes are fixed to frames of the old form: it was left out")
    if spec.get("calibration"):
        notes.append("the uncertainties of the identified parameters belong to the old kind and were left out")
    return tuple(notes)


def _is_identity(T: FloatArray) -> bool:
    return bool(np.array_equal(T, np.eye(4)))


def _frame(T: FloatArray) -> Spec:
    return {"xyz_mm": _list(T[:3, 3], "mm"), "rpy_deg": _list(se3.rotation_to_rpy(T[:3, :3]), "deg")}


def _list(values: FloatArray, unit: str) -> list[float]:
    return [_edge(value, unit) for value in values]


def _edge(value: float, unit: str) -> float:
    """An SI number in the unit of the file; a rounding error beside a number of few digits is taken off."""
    converted = units.from_si(float(value), unit)
    short = round(converted, 6)
    rounding = 1e-15 if unit == "1" else 1e-12  # a direction's error grows with the arm
    return short + 0.0 if abs(converted - short) <= rounding else converted
