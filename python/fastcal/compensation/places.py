# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the targets of a program are: between their numbers and the pose of the model's tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.compensation.configurations import at_axes
from fastcal.errors import ParseError
from fastcal.programs import Cell, Frames, Program, Target
from fastcal.robot import se3
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]


class Places:
    """Between the numbers of targets and the pose of the model's tool in the measuring frame."""

    def __init__(self, robot: Robot, nominal: Robot, program: Program, cell: Cell) -> None:
        self.robot, self.nominal, self.program, self.cell = robot, nominal, program, cell
        self.T_world_base, self.T_last_tool = robot.core.base_and_tool(robot.core.nominal)
        self.frames = Frames(program, _told_from_flange(cell, robot), self.T_last_tool)

    def leaving(self, reasons: Mapping[int, str]) -> Places:
        """Without the targets that are left as they are, each for a reason.

        Raises:
            InvalidInput: None remains.
        """
        program = self.program.leaving(reasons)
        program.check_targets()
        return Places(self.robot, self.nominal, program, self.cell)

    def world(self, place: int, T_frame_tool: FloatArray) -> FloatArray:
        """T_world_tool of the model for the numbers of a target."""
        return np.asarray(self.T_world_base @ self.frames.to_base(place, T_frame_tool) @ self.T_last_tool)

    def in_frame(self, place: int, T_world_tool: FloatArray) -> FloatArray:
        """T_frame_tool of the numbers of a target at which the model's tool is there; the inverse of `world`."""
        T_base_last = se3.inverse(self.T_world_base) @ T_world_tool @ se3.inverse(self.T_last_tool)
        return self.frames.from_base(place, T_base_last)

    def tool_at(self, place: int, T_world_tool: FloatArray) -> FloatArray:
        """T_world_tool of the target's own tool where the model's is there."""
        return np.asarray(T_world_tool @ se3.inverse(self.T_last_tool) @ self.frames.tool(place))


class TargetRefused(ParseError):  # noqa: N818 - as its parent's siblings
    """A target that cannot be reached, or is not one of this arm; `target`: which."""

    target: Target | None = None


def target_points(model: Robot, program: Program, cell: Cell | None = None) -> FloatArray:
    """(N, 3) where a program has the model's tool at each target, m in the measuring frame; NaN where not known."""
    robot = nominal_robot(model)
    places = Places(robot, robot, program, cell or Cell())
    out = np.full((len(program.targets), 3), np.nan)
    for k, target in enumerate(program.targets):
        if target.kind == "joints":
            if len(target.values) == robot.pendant.axis_count:
                out[k] = robot.forward(at_axes(robot, target.values)[np.newaxis])[0, :3, 3]
        elif k not in places.frames.left:
            out[k] = places.world(k, program.language.pose(target.values))[:3, 3]
    return out


def _told_from_flange(cell: Cell, robot: Robot) -> Cell:
    """The cell with its flange, which is told from the last row of a table, in the robot's own flange."""
    own = robot.description.flange
    if cell.T_last_flange is None or own is None or robot.kinematics == "urdf":
        return cell
    return replace(cell, T_last_flange=se3.inverse(own.T) @ cell.T_last_flange)
