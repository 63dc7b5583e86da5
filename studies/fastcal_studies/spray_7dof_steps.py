# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The spray robot's least squares step by step, and what damping or fewer singular values make of redundant errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fastcal.calibration.regularization import regularized_least_squares
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal_studies.exhibits import MM
from fastcal_studies.simulated import FloatArray
from fastcal_studies.study import Run

NOISE = 4e-5  # m: 15 um + 6 um/m at 4 m
STEPS, DONE, LOST = 30, 1e-7, 1e3
SIZE = 1e-2  # m and rad: how far damped errors may lie from nominal
DAMPINGS = np.geomspace(1e-3, 1e3, 25)


@dataclass(frozen=True, eq=False)
class Descent:
    """Gauss-Newton with the coupled Jacobian J* (5.2).

    Attributes:
        theta: Where it ends.
        steps: Largest change of an error in each round [m, rad].
        left: RMS distance before each round, and behind the last that it could be taken of [mm].
    """

    theta: FloatArray
    steps: list[float] = field(default_factory=list)
    left: list[float] = field(default_factory=list)


def descent(robot: Robot, data: Dataset, names: Sequence[str], *, damped: bool = False) -> Descent:
    """Rounds of least squares in the errors `names` until none changes by DONE; it may wander off.

    Damped, the errors themselves are held near 0 by SIZE, not their steps.
    """
    start = np.array(robot.error_model.start)
    columns = _columns(robot, names)
    out = Descent(start.copy())
    for _ in range(STEPS):
        try:
            r = _off(robot, data, out.theta)
            out.left.append(_rms_mm(r))
            if out.steps and not DONE <= out.steps[-1] <= LOST:
                break
            J = _jacobian(robot, data, out.theta, columns)
        except InvalidInput:  # no such arm: its beams lie where they hold nothing
            break
        x = out.theta[columns] - start[columns]
        if damped:
            step = regularized_least_squares(J / NOISE, (r + J @ x) / NOISE, strength=1.0, sizes=SIZE).x - x
        else:
            step = np.asarray(np.linalg.lstsq(J, r, rcond=None)[0])
        out.theta[columns] += step
        out.steps.append(float(np.abs(step).max()))
    return out


def paths(robot: Robot, data: Dataset, unseen: Dataset, names: Sequence[str], kept: Descent) -> dict[str, Run]:
    """What each damping, and each number of singular values kept, makes of all errors `names`, redundant ones too.

    Linearized where the errors that can be identified fit the rows, at the end of `kept`: with r what is left there,
    J (x - x_there) = r for errors x.

    Returns:
        By method: used (numbers that it uses), largest (error found [m, rad]), fitted and unseen (RMS [mm], None where
        there is no such arm), lists over the path; chosen: the same of the strength by cross-validation. prior: of
        damping 1. removed: of `kept`.
    """
    at, start, columns = kept.theta, np.array(robot.error_model.start), _columns(robot, names)
    J = _jacobian(robot, data, at, columns)
    r = _off(robot, data, at) + J @ (at - start)[columns]

    def point(method: str, strength: float | None) -> Run:
        found = regularized_least_squares(J / NOISE, r / NOISE, method=method, strength=strength, sizes=SIZE)
        theta = start.copy()
        theta[columns] += found.x
        left = {"fitted": _left(robot, data, theta), "unseen": _left(robot, unseen, theta)}
        return {"used": found.used, "largest": float(np.abs(found.x).max()), **left}

    strengths = {"levenberg": [*DAMPINGS], "truncated": [*map(float, range(1, len(names) + 1))]}
    out: dict[str, Run] = {}
    for method, tried in strengths.items():
        points = [point(method, strength) for strength in tried]
        out[method] = {key: [own[key] for own in points] for key in points[0]} | {"chosen": point(method, None)}
    out["prior"] = point("levenberg", 1.0)
    out["removed"] = {"used": float(np.sum(at != start)), "unseen": _left(robot, unseen, at)}
    return out


def _columns(robot: Robot, names: Sequence[str]) -> list[int]:
    return [robot.parameter_names.index(name) for name in names]


def _off(robot: Robot, data: Dataset, theta: FloatArray) -> FloatArray:
    """(3 N,) measured less predicted points [m]."""
    model = robot.error_model
    return np.asarray(data.position - np.asarray(model.predict(robot.samples(data), theta))[:, :3, 3]).ravel()


def _jacobian(robot: Robot, data: Dataset, theta: FloatArray, columns: Sequence[int]) -> FloatArray:
    """(3 N, P) of the points by some parameters."""
    J = np.asarray(robot.error_model.parameter_jacobian(robot.samples(data), theta))
    return np.asarray(J[:, :, columns].reshape(-1, len(columns)))


def _left(robot: Robot, data: Dataset, theta: FloatArray) -> float | None:
    try:
        return _rms_mm(_off(robot, data, theta))
    except InvalidInput:  # as above
        return None


def _rms_mm(r: FloatArray) -> float:
    """Root mean square of the lengths of points' errors (3 N,) [m], in mm."""
    return float(np.sqrt(3 * np.mean(r**2)) / MM)
