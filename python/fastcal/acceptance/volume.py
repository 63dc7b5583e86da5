# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How surely a calibrated model knows where its tool is, at the poses of a test and at the corners of their volume.

The covariance of a predicted point is J C J' + J H H' J' (`Robot.position_covariance`) and what the budget adds: a
scale of the instrument, which the calibration took over into the arm's lengths, s (p - p_base); the target's centring;
the temperature; payload and masses through the model. Errors of the instrument that differ from pose to pose left
their trace in the calibration's residuals, so they are in C already.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.acceptance.visits import Campaign
from fastcal.arrays import FloatArray
from fastcal.budget import Budget, Scene, Uncertainty, combined, components_of
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.robot import se3
from fastcal.robot.robot import Robot

_OF_PREDICTIONS = ("temperature", "target", "payload", "masses")


@dataclass(frozen=True, eq=False)
class Predicted:
    """The uncertainty of a model at K points.

    Attributes:
        names: P1 ... of poses, C1 ... of the corners of the box around them.
        points: (K, 3) in the base [m].
        coordinates: (K, 3) of each coordinate along the base's axes.
        worst: (K,) along the direction in which it is largest.
    """

    names: tuple[str, ...]
    points: FloatArray
    coordinates: tuple[tuple[Uncertainty, ...], ...]
    worst: tuple[Uncertainty, ...]


def predicted_uncertainty(model: Robot, found: Campaign, budget: Budget) -> Predicted | None:
    """At the commanded poses and the corners of their box; None for a model that was not calibrated."""
    if model.record is None:
        return None
    poses = {s.pose: s.commanded for s in found.stations}
    visits = {s.pose: int(s.rows[-1]) for s in found.stations}  # the first row of all comes from nowhere
    points = np.array([T[:3, 3] for T in poses.values()])
    low, high = points.min(axis=0), points.max(axis=0)
    names, T, rows = list(poses), list(poses.values()), list(visits.values())
    for i, at in enumerate(np.ndindex(2, 2, 2), start=1):
        corner = np.where(at, high, low)
        nearest = int(np.argmin(np.linalg.norm(points - corner, axis=1)))
        names.append(f"C{i}")
        T.append(se3.pose(T[nearest][:3, :3], corner))
        rows.append(rows[nearest])
    return _at(model, found, names, np.array(T), np.array(rows), budget)


def _at(
    model: Robot, found: Campaign, names: list[str], T: FloatArray, rows: NDArray[np.int64], budget: Budget
) -> Predicted:
    """At poses T (K, 4, 4) in the base, driven to as the data's `rows` (K,) were, with the mean payload of all."""
    payload = float(found.data.payload.mean())
    T_world_base = model.core.base_and_tool(model.core.nominal)[0]
    known = found.conditions(rows) | {"payload": payload}
    solved = inverse_kinematics(model, T_world_base @ T, seed=found.data.q[rows], restarts=0, **known)
    kept = np.flatnonzero(solved.reached)
    T, q, names = T[kept], solved.q[kept], [names[i] for i in kept]
    known = found.conditions(rows[kept]) | {"payload": payload}
    R = T_world_base[:3, :3]
    inputs = tuple(
        replace(each, common=True)
        for each in budget.inputs
        if each.kind in _OF_PREDICTIONS or (each.kind == "range" and each.quantity == "per_length")
    )
    # The scale acts about the base: the instrument stands there, as far as lengths of the arm go.
    scene = Scene(T[:, :3, 3], T[:, :3, :3], np.zeros(3), np.zeros(3), model, q, payload, R.T, known)
    components = components_of(Budget(inputs), scene)
    known = np.einsum("ab,kbc,cd->kad", R.T, model.position_covariance(q, **known), R)
    freedom = float(max(model.record.degrees_of_freedom, 1)) if model.record is not None else np.inf

    def along(k: int, direction: FloatArray) -> Uncertainty:
        own = float(np.sqrt(direction @ known[k] @ direction))
        parts = [(c.input.name, abs(float(c.shift[k] @ direction)), c.input.freedom) for c in components]
        return combined(own, freedom, parts, budget.level)

    every = range(len(names))
    total = [known[k] + sum((np.outer(c.shift[k], c.shift[k]) for c in components), np.zeros((3, 3))) for k in every]
    return Predicted(
        tuple(names),
        T[:, :3, 3],
        tuple(tuple(along(k, axis) for axis in np.eye(3)) for k in every),
        tuple(along(k, np.linalg.eigh(total[k])[1][:, -1]) for k in every),
    )
