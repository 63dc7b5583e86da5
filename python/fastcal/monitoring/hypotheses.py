# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What may have happened to an arm since its calibration, as columns of the linear problem of a check.

Joints' zeros, the tool, each effect of the model and the compliances and gaps that it does not have are what changes in
service; a link changes its shape by a collision alone; a row may be wrong, and the noise may have grown. Each has a
typical size (`drift`) and odds against the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.effects.entries import (
    build_effects,
    edge_name,
    edge_unit,
    effect_names,
    effect_owners,
    identity,
    label,
    traits_of,
)
from fastcal.effects.registered import find
from fastcal.measurements.kinds import Kind
from fastcal.monitoring.drift import ZEROS, drift_of, new_effect
from fastcal.place import joint_name, place_of
from fastcal.robot.robot import Robot, Spec
from fastcal.units import UNITS, from_si, to_si

ODDS = {"zero": 1.0, "tool": 1.0, "effect": 1.0, "new effect": 0.2, "link": 0.05, "row": 0.02, "noise": 0.3}
_ROW_SIZE = to_si(1.0, "mm")
_ROW_TURN = to_si(0.2, "deg")
_AFTER_LOADS = (("torque",), ("approach{n}",))  # of effects that an arm gets in service: it softens, it gets play


@dataclass(frozen=True)
class Changing:
    """One number of a hypothesis.

    Attributes:
        name: With its unit at the end, as result.json has it.
        owner: Joint, tool, link, instrument.
        unit: In which it is written.
        was: In the model, in that unit.
    """

    name: str
    owner: str
    unit: str
    was: float


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One thing that may have happened.

    Attributes:
        kind: A key of ODDS.
        label: Short: "joint3 zero", "tool", "joint_compliance@joint2", "row 4".
        numbers: What it changes.
        directions: (P, d) change of the extended model's parameters by each number; None for rows and noise.
        rows: Of `row` hypotheses: the row.
        sizes: (d,) typical, SI.
        least: (d,) smallest change that the parameter's bound allows, SI; None: any.
    """

    kind: str
    label: str
    numbers: tuple[Changing, ...]
    sizes: FloatArray
    directions: FloatArray | None = None
    row: int | None = None
    least: FloatArray | None = None

    def allows(self, value: FloatArray, std: FloatArray) -> bool:
        """Could an estimate be, by the parameters' bounds?"""
        return self.least is None or bool(np.all(value >= self.least - 2 * std))

    @property
    def odds(self) -> float:
        """Against the others before any data."""
        return ODDS[self.kind]

    def columns(self, J: FloatArray, row: NDArray[np.intp], sigma: FloatArray) -> FloatArray:
        """(m, d) whitened columns of its numbers; `J` (m, P) is that of the extended model."""
        if self.directions is not None:
            return np.asarray(J @ self.directions)
        own = np.flatnonzero(row == self.row)
        out = np.zeros((len(row), len(own)))
        out[own, np.arange(len(own))] = 1.0 / sigma[own]
        return out


def extended(arm: Robot, data_columns: set[str]) -> tuple[Robot, list[Spec]]:
    """The arm with the effects at 0 that it may have got in service, and these entries.

    Args:
        arm: The model.
        data_columns: Conditions that the data have: "approach".
    """
    core = arm.core
    there = arm.entries
    held = {(simple, entry["owner"]) for entry in there for simple in traits_of(entry["effect"]).generalizes}
    known = {identity(entry) for entry in there}
    added: list[Spec] = []
    for name in effect_names():
        traits = traits_of(name)
        if traits.role != "cause" or traits.depends_on not in _AFTER_LOADS or traits.searched or find(name):
            continue
        if traits.depends_on[0].startswith("approach") and "approach" not in data_columns:
            continue
        for owner in effect_owners(name, core):
            entry: Spec = {"effect": name, "owner": owner, "parameters": {}}
            if identity(entry) not in known and (name, owner) not in held:
                added.append(entry)
    added = [entry for entry in added if len(build_effects([entry], core)[0].parameters) == 1]
    return arm.with_(effects=[*there, *added]), added


def hypotheses(arm: Robot, extended_arm: Robot, added: list[Spec], turned: bool) -> list[Hypothesis]:
    """All that concern the arm; `turned`: orientations were measured, so that a turn of the tool shows."""
    model = extended_arm.error_model
    return [*_of_geometry(arm, model, turned), *_of_effects(extended_arm, added)]


def row_hypotheses(row: NDArray[np.intp], numbers_of: Sequence[tuple[Kind, str]]) -> list[Hypothesis]:
    """That one row of the data is wrong; `numbers_of` are the kind and the name of each number."""
    out = []
    for i in np.unique(row).tolist():
        own = [numbers_of[k] for k in np.flatnonzero(row == i).tolist()]
        sizes = np.array([_ROW_SIZE if UNITS[kind.unit].kind == "length" else _ROW_TURN for kind, _ in own])
        numbers = tuple(Changing(f"{name}_{kind.unit}", f"row {i}", kind.unit, 0.0) for kind, name in own)
        out.append(Hypothesis("row", f"row {i}", numbers, sizes, row=i))
    return out


def _of_geometry(arm: Robot, model: _core.ErrorModel, turned: bool) -> Iterator[Hypothesis]:
    parameters, own = model.parameters, len(model.robot.parameters)
    start = np.asarray(model.start)
    by_owner: dict[str, list[int]] = {}
    for i, p in enumerate(parameters[:own]):
        if p.owner != "base" and (p.owner != "tool" or turned or not p.name.startswith("r")):
            by_owner.setdefault(p.owner, []).append(i)
    turned_alone = {
        owner: _zero(arm, place_of(owner).index, indices, parameters, start)
        for owner, indices in by_owner.items()
        if place_of(owner).kind == "joint"
    }
    for owner, indices in by_owner.items():
        if owner == "tool":
            yield _plain("tool", "tool", indices, parameters, start)
            continue
        if owner not in turned_alone:  # a rod or a pin of a closed loop
            yield _plain("link", f"{owner} geometry", indices, parameters, start)
            continue
        joint = place_of(owner).index
        if joint not in arm.passive:  # without a motor no zero
            zero, direction = turned_alone[owner]
            # A motor's zero moves the joints that its gear is coupled to as well.
            for entry in arm.description.coupling:
                if entry.source == joint + 1:
                    direction = direction + entry.ratio * turned_alone[joint_name(entry.joint - 1)][1]
            yield Hypothesis("zero", f"{owner} zero", (zero,), _zero_size(arm, joint), directions=direction[:, None])
        others = [i for i in indices if parameters[i].name not in _zero_names(arm, joint)]
        if others and joint < arm.joint_count - 1:  # the last link carries the tool and is as good as part of it
            yield _plain("link", f"{owner} geometry", others, parameters, start)


def _zero_names(arm: Robot, joint: int) -> tuple[str, ...]:
    if arm.joint_types[joint] == "prismatic":
        return ("d",)
    return ZEROS


def _zero_size(arm: Robot, joint: int) -> FloatArray:
    prismatic = arm.joint_types[joint] == "prismatic"
    return np.array([to_si(0.1, "mm") if prismatic else to_si(0.02, "deg")])


def zero_direction(arm: Robot, joint: int) -> FloatArray:
    """(P,) how the parameters of a model move when the zero of a joint, counted from 0, is off by 1 rad or m."""
    model = arm.error_model
    own = [i for i, p in enumerate(model.parameters[: len(model.robot.parameters)]) if p.owner == joint_name(joint)]
    return _zero(arm, joint, own, model.parameters, np.asarray(model.start))[1]


def _zero(
    arm: Robot, joint: int, indices: list[int], parameters: list[_core.Parameter], start: FloatArray
) -> tuple[Changing, FloatArray]:
    """The zero of a joint as the file has it, and the direction of the parameters that is a turn about its axis."""
    direction = np.zeros(len(parameters))
    kind = arm.joint_types[joint]
    names = _zero_names(arm, joint)
    for i in indices:
        if parameters[i].name in names:
            direction[i] = 1.0
            unit = edge_unit(parameters[i], geometry=True)
            was = from_si(float(start[i]), unit)
            return Changing(edge_name(parameters[i], geometry=True), parameters[i].owner, unit, was), direction
    # urdf: the error is a motion of the joint's origin in its own axes, and the axis is any direction of these
    axis = np.asarray(arm.joints[joint].axis, dtype=float)
    axes = ("rx", "ry", "rz") if kind == "revolute" else ("x", "y", "z")
    for i in indices:
        if parameters[i].name in axes:
            direction[i] = axis[axes.index(parameters[i].name)]
    unit = "deg" if kind == "revolute" else "mm"
    return Changing(f"zero_{unit}", joint_name(joint), unit, 0.0), direction


def _plain(
    kind: str, name: str, indices: list[int], parameters: list[_core.Parameter], start: FloatArray
) -> Hypothesis:
    """A change of several parameters of the geometry."""
    numbers, sizes = [], []
    for i in indices:
        unit = edge_unit(parameters[i], geometry=True)
        numbers.append(
            Changing(edge_name(parameters[i], geometry=True), parameters[i].owner, unit, from_si(float(start[i]), unit))
        )
        sizes.append(drift_of(parameters[i], float(start[i]), geometry=True).event)
    return Hypothesis(kind, name, tuple(numbers), np.array(sizes), directions=np.eye(len(parameters))[:, indices])


def _of_effects(arm: Robot, added: list[Spec]) -> Iterator[Hypothesis]:
    model = arm.error_model
    start = np.asarray(model.start)
    at = len(model.robot.parameters)
    new = {identity(entry) for entry in added}
    for entry, effect in zip(arm.entries, arm.effects, strict=True):
        indices = list(range(at, at + len(effect.parameters)))
        at += len(effect.parameters)
        if traits_of(entry["effect"]).role == "curve" or traits_of(entry["effect"]).of_the_measurement:
            continue
        is_new = identity(entry) in new
        numbers, sizes = [], []
        for i, p in zip(indices, effect.parameters, strict=True):
            unit = edge_unit(p, geometry=False)
            value = float(start[i])
            numbers.append(Changing(edge_name(p, geometry=False), p.owner, unit, from_si(value, unit)))
            sizes.append(new_effect(p) if is_new else drift_of(p, value, geometry=False).event)
        kind = "new effect" if is_new else "effect"
        directions = np.eye(len(model.parameters))[:, indices]
        least = np.array([p.lower for p in effect.parameters]) - start[indices]
        yield Hypothesis(kind, label(entry), tuple(numbers), np.array(sizes), directions=directions, least=least)
