# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What one standard deviation of an input does to the measured points of a campaign.

With b the beam from the instrument o to the point p, L = |p - o|, u and v across it: range moves p by b (b L where it
is per length), angle by u and by v (u L, v L per length or angle); a target's centring by R_tool e_k; a temperature by
alpha (p - p_base); payload and masses by the model's own derivative. Each is a field (K, 3) over the K poses, or, where
an input is drawn again at each pose, one field a pose.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.budget.inputs import Budget, Input
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Link

_SAME_POSE = 1e-6  # m
_STEP = 0.5  # of a standard uncertainty, for the derivative by a payload or by masses


@dataclass(frozen=True, eq=False)
class Scene:
    """Where the points of a campaign are, all in the frame in which they are judged.

    Attributes:
        points: (K, 3) [m].
        rotations: (K, 3, 3) of the tool.
        instrument: (3,) [m].
        base: (3,) origin of the arm's base [m].
        model, q, payload: What moves with loads: the arm, (K, n) its joints and [kg] its load; None: not known.
        to_frame: (3, 3) from the model's measuring frame to the frame of the points.
        conditions: Other ones of the arm, as `Robot.forward` takes them.
    """

    points: FloatArray
    rotations: FloatArray
    instrument: FloatArray
    base: FloatArray
    model: Robot | None = None
    q: FloatArray | None = None
    payload: float = 0.0
    to_frame: FloatArray | None = None
    conditions: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Component:
    """One independent random number of a budget, with what its standard deviation does.

    Attributes:
        input: Whose it is.
        shift: (K, 3) of the points [m].
        turn: (K, 3) of the orientations, about the tool's axes [rad].
    """

    input: Input
    shift: FloatArray
    turn: FloatArray


def components_of(budget: Budget, scene: Scene) -> list[Component]:
    """All independent components of a budget at the points of a scene.

    Raises:
        InvalidInput: An input needs what the scene does not have.
    """
    # One pose that is approached from several sides is one place of the instrument's error.
    at = np.unique(np.round(scene.points / _SAME_POSE), axis=0, return_inverse=True)[1].ravel()
    poses = [np.asarray(at == k, dtype=float)[:, np.newaxis] for k in range(at.max() + 1)]
    out = []
    for each in budget.inputs:
        for shift, turn in _fields(each, scene):
            shift, turn = each.standard * shift, each.standard * turn
            if each.common:
                out.append(Component(each, shift, turn))
            else:
                out += [Component(each, rows * shift, rows * turn) for rows in poses]
    return [c for c in out if np.any(c.shift) or np.any(c.turn)]


def _fields(each: Input, scene: Scene) -> Iterator[tuple[FloatArray, FloatArray]]:
    """(shift, turn) for a unit of the input's size."""
    count = len(scene.points)
    none = np.zeros((count, 3))
    if each.kind == "orientation":
        for axis in np.eye(3):
            yield none, np.tile(axis, (count, 1))
        return
    for shift in _shifts(each, scene, count):
        yield shift, none


def _shifts(each: Input, scene: Scene, count: int) -> list[FloatArray]:
    """(K, 3) fields of the points, for a unit of the input's size."""
    beam = scene.points - scene.instrument
    length = np.linalg.norm(beam, axis=1, keepdims=True)
    along = beam / np.maximum(length, np.finfo(float).tiny)
    lever = np.ones((count, 1)) if each.quantity == "length" else length
    if each.kind == "range":
        return [along * lever]
    if each.kind == "angle":
        return [across * lever for across in _across(along)]
    if each.kind == "position":
        return [np.tile(axis, (count, 1)) for axis in np.eye(3)]
    if each.kind == "target":
        return [scene.rotations[:, :, axis].copy() for axis in range(3)]
    if each.kind == "temperature":
        return [each.expansion * (scene.points - scene.base)]
    return [_by_load(each, scene)]


def _across(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors (K, 3) across each beam: level, and above it; any where a beam is upright."""
    level = np.cross([0.0, 0.0, 1.0], along)
    size = np.linalg.norm(level, axis=1, keepdims=True)
    level = np.where(size > 1e-9, level / np.maximum(size, 1e-9), np.array([1.0, 0.0, 0.0]))
    return level, np.cross(along, level)


def _by_load(each: Input, scene: Scene) -> FloatArray:
    """(K, 3) how the model's tool moves with one kg more, or with all link masses twice as large, by differences."""
    if scene.model is None or scene.q is None:
        raise InvalidInput(f"'{each.name}': {each.kind} needs a model whose joints yield")
    step = _STEP * each.standard
    if each.kind == "payload":
        step = min(step, scene.payload) or step
        low, high = max(scene.payload - step, 0.0), scene.payload + step
        ends = [scene.model.forward(scene.q, **{**scene.conditions, "payload": load})[:, :3, 3] for load in (low, high)]
        field = (ends[1] - ends[0]) / (high - low)
    else:
        ends = [
            _with_masses(scene.model, 1 + sign * step).forward(
                scene.q, **{**scene.conditions, "payload": scene.payload}
            )[:, :3, 3]
            for sign in (-1, 1)
        ]
        field = (ends[1] - ends[0]) / (2 * step)
    return np.asarray(field if scene.to_frame is None else field @ scene.to_frame.T)


def _with_masses(model: Robot, factor: float) -> Robot:
    """The model with all link masses and inertias scaled."""
    return model.with_(joints=[replace(joint, link=_scaled(joint.link, factor)) for joint in model.joints])


def _scaled(link: Link | None, factor: float) -> Link | None:
    if link is None:
        return None
    inertia = None if link.inertia_kg_m2 is None else tuple(factor * value for value in link.inertia_kg_m2)
    return replace(link, mass_kg=factor * link.mass_kg, inertia_kg_m2=inertia)
