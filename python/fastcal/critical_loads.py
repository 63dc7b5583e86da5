# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a piecewise linear compliance bends: a start for its critical loads, from a grid over the data's loads.

The error is not convex in a critical load, so the solver needs a start near it. For given critical loads everything
else is linear or
nearly so: one Gauss-Newton step from a common fit tells what error each would leave (RX160L paper, equation 12, by
variable projection).
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.effects import edge_name, value_at_edge
from fastcal.robot import Robot

FloatArray = NDArray[np.float64]

_EFFECT = "joint_compliance_nonlinear"
_GRID = np.linspace(0.05, 0.95, 19)  # quantiles of the loads that are met: a corner outside them can't be told
_SWEEPS = 3


@dataclass(frozen=True, eq=False)
class _Corners:
    """The critical loads of one effect: its entry, their parameters in the model, the loads |tau| (N,) of its joint."""

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
    """The robot with starting values for the critical loads that its file lacks; the same robot where there are none.

    Args:
        robot: With the effects to identify.
        model: Its model with base and tool fitted to the data.
        samples: As for the core's `identify`, as all that follow.
        measured: What was measured.
        asked: Indices of the parameters to identify.
        anchors: (K, 3) starting places [m].
        loss: Robust loss.
        threads: Cores.
    """
    corners = list(_open_corners(robot, model, samples, threads))
    if not corners:
        return robot
    theta = np.array(model.start)
    for own in corners:
        theta[own.indices] = own.start()
    values = theta[len(model.robot.parameters) :]
    bent = _core.ErrorModel(model.robot, robot.effects, values).with_equilibrium(model.at_equilibrium)
    moving = sorted(set(asked) - {i for own in corners for i in own.indices})
    found = _core.identify(bent, samples, measured, asked=moving, anchors=anchors, loss=loss, threads=threads)
    theta = np.array(found.theta)
    weights = np.sqrt(np.asarray(found.weights))
    free = list(found.free)

    def error(at: FloatArray) -> float:
        near = _core.linearize(bent, samples, measured, at, found.common_noise, threads)
        weight = weights[np.asarray(near.row)]
        J = np.asarray(near.J)[:, free] * weight[:, None]
        r = np.asarray(near.r) * weight
        scale = np.maximum(np.linalg.norm(J, axis=0), np.finfo(float).tiny)
        step = np.linalg.lstsq(J / scale, r, rcond=1e-10)[0]
        return float(np.sum((r - (J / scale) @ step) ** 2))

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
    spec = copy.deepcopy(robot.spec)
    for own in corners:
        spec["effects"][own.entry]["parameters"] = {
            edge_name(model.parameters[i], geometry=False): value_at_edge(
                model.parameters[i], float(theta[i]), geometry=False
            )
            for i in own.indices
        }
    return Robot(spec)


def _open_corners(robot: Robot, model: _core.ErrorModel, samples: _core.Samples, threads: int) -> Iterator[_Corners]:
    """All effects with critical loads that start at no value of the robot file."""
    at = len(model.robot.parameters)
    for k, (entry, effect) in enumerate(zip(robot.spec.get("effects") or [], robot.effects, strict=True)):
        indices = [at + i for i, p in enumerate(effect.parameters) if p.name.startswith("critical")]
        at += len(effect.parameters)
        if entry["effect"] != _EFFECT or not indices or entry.get("parameters"):
            continue
        joint = int(entry["owner"].removeprefix("joint")) - 1
        axis = 5 if robot.joint_types[joint] == "revolute" else 2
        loads = model.loads(samples, model.start, entry.get("torque") == "payload", threads)
        yield _Corners(k, indices, np.abs(np.asarray(loads)[:, 2 * joint + 1, axis]))
