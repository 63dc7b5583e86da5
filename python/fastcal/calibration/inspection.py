# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What to say about measurements before they are used: columns that were meant otherwise, joints read back."""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.calibrate import align
from fastcal.calibration.evaluation import Evaluation, distances
from fastcal.errors import InvalidInput
from fastcal.measurements import column_check as guard
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

HOPELESS_SHARE = 0.1  # of the reach; no geometric error is so large, so what calibration would find is nonsense


def suspicion(robot: Robot, data: Dataset) -> str | None:
    """What the columns were probably meant to be, with the evidence; None where they fit the robot.

    Raises:
        InvalidInput: The robot, as the columns are read, misses the points so far that nothing can be calibrated.
    """
    bare = Robot(copy.deepcopy(robot.spec) | {"effects": []})

    def misfit(q: FloatArray, position: FloatArray) -> float:
        found = align(bare, Dataset.from_arrays(q, position=position))
        return float(found.rms) if found.found else float("inf")

    found = guard.plausible(data, bare, misfit)
    if found is None:
        return None
    if found.rms_read > HOPELESS_SHARE * robot.reach:
        raise InvalidInput(f"{data.source}: {found.message}")
    return found.message


def check_fit(robot: Robot, fit: Evaluation, suspected: str | None = None) -> None:
    """Refuses a calibration that explains nothing: half of the rows are still farther off than a part of the reach.

    `suspected` is what `suspicion` said of the data, if anything.

    Raises:
        InvalidInput: The data are of another robot, or no measurements at all.
    """
    known = distances(fit.error_after, fit.length_after)
    known = known[~np.isnan(known)]
    median = float(np.median(known)) if len(known) else 0.0
    if median > guard.BAD_SHARE * robot.reach:
        if suspected is not None:
            raise InvalidInput(f"{fit.data.source}: {suspected}")
        miss, reach = (f"{from_si(length, 'mm'):.4g} mm" for length in (median, robot.reach))
        raise InvalidInput(
            f"{fit.data.source}: the points do not fit this robot: even when calibrated it misses half of them by more "
            f"than {miss}, with a reach of {reach}; is it the right robot, in the order of its joints?"
        )


def readback_notes(robot: Robot, data: Dataset) -> list[str]:
    """How far joint positions read back are from those commanded, a sentence each joint; they are never fitted."""
    if data.q_read is None:
        return []
    notes = []
    for joint, kind in enumerate(robot.joint_types):
        unit = "deg" if kind == "revolute" else "mm"
        difference = from_si(data.q_read[:, joint] - data.q[:, joint], unit)
        difference = difference[~np.isnan(difference)]
        if len(difference):
            mean, largest = float(np.mean(difference)), float(np.max(np.abs(difference)))
            notes.append(
                f"joint {joint + 1} read back less commanded: {mean:.4g} {unit} on average, {largest:.4g} {unit} at "
                f"most, in {len(difference)} rows; not used"
            )
    return notes
