# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arm before calibration: nominal, with everything fitted that the measurements leave free.

Fitted are base and tool, and anchors, planes and mountings where needed, so that the remaining error measures the arm
and not the position of the instrument.
"""

from __future__ import annotations

from dataclasses import dataclass

from fastcal.arrays import FloatArray
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.unknowns import unknowns_by_owner
from fastcal.robot.identified_spec import moved
from fastcal.robot.robot import Robot


@dataclass(frozen=True, eq=False)
class NominalArm:
    """The nominal robot where the measurements put it, and the observations' unknowns by what they are of.

    Attributes:
        is_fitted: Did the fit converge? What is left says nothing otherwise.
    """

    robot: Robot
    unknowns: dict[str, FloatArray]
    is_fitted: bool

    @property
    def judged(self) -> Robot | None:
        """The robot that "before" is told of; None where nothing can be told."""
        return self.robot if self.is_fitted else None


def nominal_arm(problem: CalibrationProblem) -> NominalArm:
    """The arm before calibration."""
    place = problem.alignment
    robot = moved(problem.robot, place.T_world_base, place.T_flange_tool)
    return NominalArm(robot, unknowns_by_owner(problem.measured, place.unknowns), place.is_fitted)
