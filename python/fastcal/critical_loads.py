# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a piecewise linear compliance bends: a start for its critical loads, from a grid over the data's loads.

The error is not convex in a critical load, so the solver needs a start near it. For given critical loads everything
else is linear or nearly so: one Gauss-Newton step from a common fit tells what error each would leave (RX160L paper,
equation 12, by variable projection).
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.effects import edge_name, value_at_edge
from fastcal.parameter_limits import parameter_limits
from fastcal.robot import Robot

FloatArray = NDArray[np.float64]

_EFFECT = "joint_compliance_nonlinear"
_GRID = np.linspace(0.05, 0.95, 19)  # quantiles of the loads that are met: a corner outside them can't be told
_SWEEPS = 3
_RANK = 1e-12  # of the largest eigenvalue: less is no direction


@dataclass(frozen=True, eq=False)
class Corners:
    """The critical loads of one effect.

    Attributes:
        entry: Its place in the robot file's effects.
        indices: Of the critical loads in the model's parameters, ascending.
        loads: (N,) |tau| of its joint [N m or N].
    """

    entry: int
    indices: list[int]
    loads: FloatArray

    def start(self) -> FloatArray:
        """Corners that give every piece the same share of the rows."""
        return np.quantile(self.loads, np.arange(1, len(self.indices) + 1) / (len(self.indices) + 1))


def with_critical_loads(
    robot: Robot,
    model: _core.ErrorModel,
    samples: _core.Samples,
    measured: _core.Measurements,
    asked: list[int],
    anchors: FloatArray,
    *,
    loss: str,
    threads: int = 1,
) -> Robot:
    """The robot with starting values for all critical loads that its file does not give; itself where there are none.

    Args:
        robot: With the effects to identify.
        model: Its model with base and tool fitted to the data.
        samples: Conditions of the rows.
        measured: What was measured.
        asked: Indices of the parameters to identify.
        anchors: (anchors, 3) starting places.
        loss: Robust loss.
        threads: Cores to use.
    """
    corners = open_corners(robot, model, samples, threads)
    if not corners:
        return robot
    theta = starting_values(model, corners)
    bent = _core.ErrorModel(model.robot, robot.effects, theta[len(model.robot.parameters) :])
    bent = bent.with_equilibrium(model.at_equilibrium)
    moving = sorted(set(asked) - {i for own in corners for i in own.indices})
    limits: dict[str, Any] = parameter_limits(robot, bent, len(anchors), priors=False)
    found = _core.identify(bent, samples, measured, asked=moving, anchors=anchors, loss=loss, threads=threads, **limits)
    weights = np.sqrt(np.asarray(found.weights))
    free = list(found.free)

    def error(theta: FloatArray) -> float:
        near = _core.linearize(bent, samples, measured, theta, found.common_noise, threads)
        weight = weights[np.asarray(near.row)]
        return remaining(np.asarray(near.J)[:, free] * weight[:, None], np.asarray(near.r) * weight)

    theta = best_corners(corners, np.array(found.theta), error)
    return with_values(robot, model, corners, theta)


def open_corners(robot: Robot, model: _core.ErrorModel, samples: _core.Samples, threads: int = 1) -> list[Corners]:
    """All effects with critical loads to which the robot file gives no value."""
    out = []
    at = len(model.robot.parameters)
    for k, (entry, effect) in enumerate(zip(robot.spec.get("effects") or [], robot.effects, strict=True)):
        indices = [at + i for i, p in enumerate(effect.parameters) if p.name.startswith("critical")]
        at += len(effect.parameters)
        if entry["effect"] != _EFFECT or not indices or entry.get("parameters"):
            continue
        joint = int(entry["owner"].removeprefix("joint")) - 1
        axis = 5 if robot.joint_types[joint] == "revolute" else 2
        loads = model.loads(samples, model.start, entry.get("torque") == "payload", threads)
        out.append(Corners(k, indices, np.abs(np.asarray(loads)[:, 2 * joint + 1, axis])))
    return out


def starting_values(model: _core.ErrorModel, corners: list[Corners]) -> FloatArray:
    """(P,) the model's start with corners that share the rows evenly."""
    theta = np.array(model.start)
    for own in corners:
        theta[own.indices] = own.start()
    return theta


def best_corners(corners: list[Corners], theta: FloatArray, error: Callable[[FloatArray], float]) -> FloatArray:
    """The parameters (P,) with the corners, one by one and again, at the place of the grid where `error` is least."""
    theta = theta.copy()
    single = sum(len(own.indices) for own in corners) == 1
    for _ in range(1 if single else _SWEEPS):
        before = theta.copy()
        for own in corners:
            for position, index in enumerate(own.indices):
                low = theta[own.indices[position - 1]] if position > 0 else 0.0
                high = theta[own.indices[position + 1]] if position + 1 < len(own.indices) else np.inf
                tries = [c for c in np.quantile(own.loads, _GRID) if low < c < high] or [theta[index]]
                errors = []
                for critical in tries:
                    there = theta.copy()
                    there[index] = critical
                    errors.append(error(there))
                theta[index] = tries[int(np.argmin(errors))]
        if np.array_equal(before, theta):
            break
    return theta


def remaining(J: FloatArray, r: FloatArray) -> float:
    """|r|^2 after the best linear change of all parameters, J (n, p), r (n,).

    By normal equations: a grid is compared here and no digit is reported; an SVD of J would fight over cores with
    whoever else runs.
    """
    J = J / np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
    value, vector = np.linalg.eigh(J.T @ J)
    kept = value > _RANK * value[-1]
    explained = (vector[:, kept].T @ (J.T @ r)) ** 2 / value[kept]
    return float(r @ r - explained.sum())


def with_values(robot: Robot, model: _core.ErrorModel, corners: list[Corners], theta: FloatArray) -> Robot:
    """The robot with the critical loads of theta (P,) as starting values in its file."""
    spec = copy.deepcopy(robot.spec)
    for own in corners:
        spec["effects"][own.entry]["parameters"] = {
            edge_name(model.parameters[i], geometry=False): value_at_edge(
                model.parameters[i], float(theta[i]), geometry=False
            )
            for i in own.indices
        }
    return Robot(spec)
