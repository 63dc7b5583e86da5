# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arm before calibration: nominal, with all that the measurements leave free fitted to them.

Base and tool, and anchors, planes and mountings where something hangs on them: what then is left measures the arm and
not where the instrument stood.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.parameter_table import unknowns_by_owner
from fastcal.calibration.problem import CalibrationProblem
from fastcal.robot.identified_spec import moved
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

_LOSS = "huber"  # as the rigid fit of base and tool: gross rows hardly move it, and the arm's own errors all count


@dataclass(frozen=True, eq=False)
class NominalArm:
    """The nominal robot where the measurements put it.

    Attributes:
        unknowns: Of the observations, by what they are of.
        is_fitted: Did the fit converge? What is left says nothing otherwise.
    """

    robot: Robot
    unknowns: dict[str, FloatArray]
    is_fitted: bool


def nominal_arm(problem: CalibrationProblem) -> NominalArm:
    """Points and orientations have it from the rigid fit; anchors, planes and mountings ask for a fit with the tool."""
    start, own = problem.robot, len(problem.model.robot.nominal)
    if not problem.unknown_count:
        T_base, T_tool = problem.alignment.T_world_base, problem.alignment.T_flange_tool
        return NominalArm(moved(start, T_base, T_tool), {}, is_fitted=True)
    ends = [i for i in problem.asked if i < own and problem.parameters[i].owner in ("base", "tool")]
    found = problem.identify(asked=ends, loss=_LOSS)
    theta = np.asarray(found.theta)
    robot = moved(start, *problem.model.robot.base_and_tool(theta[:own]))
    unknowns = unknowns_by_owner(problem.measured, theta[len(problem.model.start) :])
    return NominalArm(robot, unknowns, is_fitted=found.status == "converged")
