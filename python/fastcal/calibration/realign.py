# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibrated model before another instrument: base and tool refitted, all that was identified or trained kept."""

from __future__ import annotations

from fastcal.calibration.alignment import align
from fastcal.calibration.prediction import without_correction
from fastcal.errors import Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.robot.identified_spec import moved
from fastcal.robot.robot import Robot

ROUNDS = 3  # the correction turns with the base, whose turn is known to a thousandth after the first


def realign(robot: Robot, data: Dataset, *, threads: int = 1) -> Robot:
    """The model with the base and tool that fit the data best, in closed form; a trained correction stays in force.

    A few rows do, twenty say: nine numbers are fitted where points were measured, twelve where orientations were.

    Raises:
        InvalidInput: Nothing was measured.
        Undetermined: The poses fix no base.
    """
    kept = robot.correction
    for _ in range(ROUNDS if kept is not None else 1):
        bare = robot.with_(correction=None)
        found = align(bare, without_correction(robot, data), threads)
        if not found.found:
            raise Undetermined(f"{data.source}: {found.message}")
        robot = moved(bare, found.T_world_base, found.T_flange_tool).with_(correction=kept)
    return robot
