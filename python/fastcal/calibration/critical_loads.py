# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a piecewise linear compliance bends: a start for its critical loads, from a grid over the data's loads.

The error is not convex in a critical load, so the solver needs a start near it. For given critical loads everything
else is linear or nearly so: one Gauss-Newton step from a common fit gives the error that each would leave (RX160L
paper, equation 12, by variable projection).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.problem import CalibrationProblem
from fastcal.effects.entries import edge_name, value_at_edge
from fastcal.place import place_of
from fastcal.robot.robot import Robot

_GRID = np.linspace(0.05, 0.95, 19)  # quantiles of the loads in the data: a corner outside them is not identifiable
_SWEEPS = 3
_RIDGE = 1e-10  # of a column's own square: a direction that the data do not determine explains nothing


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


def with_critical_loads(problem: CalibrationProblem) -> CalibrationProblem:
    """The problem with starting values for all critical loads that its robot's file does not give."""
    model = problem.model
    corners = open_corners(problem.robot, model, problem.samples, problem.threads)
    if not corners:
        return problem
    theta = starting_values(model, corners)
    bent = _core.ErrorModel(model.robot, problem.robot.effects, theta[len(model.robot.parameters) :])
    fixed = {i for own in corners for i in own.indices}
    started = problem.with_(model=bent.with_equilibrium(model.at_equilibrium), asked=sorted(set(problem.asked) - fixed))
    found = started.identify()
    weights = np.sqrt(np.asarray(found.weights))
    free = list(found.free)

    def error(theta: FloatArray) -> float:
        near = started.linearize(theta, found.common_noise)
        weight = weights[np.asarray(near.row)]
        return remaining(np.asarray(near.J)[:, free] * weight[:, None], np.asarray(near.r) * weight)

    theta = best_corners(corners, np.array(found.theta), error)
    return problem.with_(robot=with_values(problem.robot, model, corners, theta))


def open_corners(robot: Robot, model: _core.ErrorModel, samples: _core.Samples, threads: int = 1) -> list[Corners]:
    """All effects with critical loads to which the robot file gives no value."""
    out = []
    at = len(model.robot.nominal)
    for k, (entry, effect) in enumerate(zip(robot.entries, robot.effects, strict=True)):
        indices = [at + i for i, p in enumerate(effect.parameters) if p.name.startswith("critical")]
        at += len(effect.parameters)
        if not indices or entry.get("parameters"):
            continue
        joint = place_of(entry["owner"]).index
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
    """The parameters (P,) with all corners at places of the grid where `error` is least.

    First the corners of an effect one after the other, those to come lying on the last one, where they do nothing; then
    each of all once more between its neighbours, until none moves.
    """
    theta = theta.copy()

    def least(tries: list[FloatArray], indices: list[int]) -> FloatArray:
        """The values at `indices` that leave the least error."""
        errors = []
        for values in tries:
            there = theta.copy()
            there[indices] = values
            errors.append(error(there))
        return tries[int(np.argmin(errors))]

    for own in corners:
        grid, count = np.quantile(own.loads, _GRID), len(own.indices)
        placed: list[float] = []
        for _ in range(count):
            sets = [sorted([*placed, critical]) for critical in grid if critical not in placed]
            tries = [np.array(some + [some[-1]] * (count - len(some))) for some in sets]
            theta[own.indices] = least(tries, own.indices)
            placed = theta[own.indices[: len(placed) + 1]].tolist()
    if sum(len(own.indices) for own in corners) == 1:
        return theta
    for _ in range(_SWEEPS):
        before = theta.copy()
        for own in corners:
            for position, index in enumerate(own.indices):
                low = theta[own.indices[position - 1]] if position > 0 else 0.0
                high = theta[own.indices[position + 1]] if position + 1 < len(own.indices) else np.inf
                between = [np.array([c]) for c in np.quantile(own.loads, _GRID) if low < c < high]
                theta[index] = least(between, [index])[0]
        if np.array_equal(before, theta):
            break
    return theta


def remaining(J: FloatArray, r: FloatArray) -> float:
    """|r|^2 after the best linear change of all parameters, J (n, p), r (n,).

    By normal equations with a little ridge: a grid is compared here and no digit is reported. The products are small,
    and einsum forms them without the threads of a BLAS, which cost more than the work where cores are shared.
    """
    J = J / np.maximum(np.sqrt(np.einsum("ij,ij->j", J, J)), np.finfo(float).tiny)
    normal = np.einsum("ij,ik->jk", J, J) + _RIDGE * np.eye(J.shape[1])
    gradient = np.einsum("ij,i->j", J, r)
    return float(r @ r - gradient @ np.linalg.solve(normal, gradient))


def with_values(robot: Robot, model: _core.ErrorModel, corners: list[Corners], theta: FloatArray) -> Robot:
    """The robot with the critical loads of theta (P,) as starting values in its file."""
    entries = list(robot.entries)
    for own in corners:
        values = {
            edge_name(model.parameters[i], geometry=False): value_at_edge(
                model.parameters[i], float(theta[i]), geometry=False
            )
            for i in own.indices
        }
        entries[own.entry] = entries[own.entry] | {"parameters": values}
    return robot.with_(effects=entries)
