# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Geometry together with joint profiles: what both can explain is assigned to the geometry.

Over the joints' ranges in the data smooth curves of every joint's error do much of what lengths and angles do. Fitted
together, what the model lacks moves the two far apart, in opposite directions that nobody notices until a joint leaves
its range, the curve fades and the geometry stands alone. So the solver pulls geometry to where it would be without
profiles: curves take what geometry can't. Where the data tell the two apart, they outvote the pull.
"""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.problem import CalibrationProblem
from fastcal.effects.entries import curve_of
from fastcal.robot.robot import Robot

PULL_SIZES = 0.05  # plausible sizes: 0.05 mm and 0.05 mrad


def pull_deviations(robot: Robot, model: _core.ErrorModel) -> FloatArray:
    """(P,) how far each parameter may lie from its fit without profiles at the cost of one deviation; inf: anywhere."""
    out = np.full(len(model.parameters), np.inf)
    if any(_curves(robot)):
        out[: len(model.robot.parameters)] = geometry_pulls(model)
    return out


def geometry_pulls(model: _core.ErrorModel) -> FloatArray:
    """`pull_deviations` of the robot's own parameters; base and tool are free."""
    own = model.robot.parameters
    return np.array([np.inf if p.owner in ("base", "tool") else PULL_SIZES * p.sigma for p in own])


def pulls(problem: CalibrationProblem) -> dict[str, FloatArray]:
    """Options of `problem.identify` that pull geometry to its fit without profiles; none without profiles.

    The effects' origins and curvatures are set.
    """
    if not any(_curves(problem.robot)):
        return {}
    sigma = pull_deviations(problem.robot, problem.model)
    if not np.isfinite(sigma[problem.asked]).any():
        return {}
    curves = {i for curve, own in zip(_curves(problem.robot), problem.effect_places, strict=True) if curve for i in own}
    alone = problem.with_(asked=[i for i in problem.asked if i not in curves]).identify()
    free = np.full(problem.unknown_count, np.inf)
    return {"pull_mean": np.asarray(alone.theta), "pull_sigma": np.concatenate([sigma, free])}


def _curves(robot: Robot) -> list[bool]:
    """Which effects are curves of joints, and no cause: a cause is fitted with the geometry from the start."""
    return [entry["effect"] == curve_of("joint") for entry in robot.entries]
