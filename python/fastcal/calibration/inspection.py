# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What to say about measurements before they are used: columns that were meant otherwise, joints read back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.alignment import align
from fastcal.calibration.evaluation import Evaluation, distances
from fastcal.errors import InvalidInput
from fastcal.measurements.column_check import plausible
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

BAD_SHARE = 0.01  # of the reach; calibrated arms miss by a thousandth at most
ACCEPT = "--as-read (in Python as_read=True) accepts the columns as they are"


def check_columns(robot: Robot, data: Dataset, *, as_read: bool = False) -> list[str]:
    """Refuses columns that were probably meant otherwise; with `as_read`, a note says so instead.

    Raises:
        InvalidInput: Another reading of the columns fits at least five times better; both misfits and what was meant.
    """
    bare = Robot(robot.spec | {"effects": []})

    def misfit(q: FloatArray, position: FloatArray) -> float:
        found = align(bare, Dataset.from_arrays(q, position=position))
        return float(found.rms) if found.found else float("inf")

    suspicion = plausible(data, bare, misfit, bare.forward)
    if suspicion is None:
        return []
    if as_read:
        return [suspicion.message]
    raise InvalidInput(f"{data.source}: {suspicion.message}; {ACCEPT}")


def check_fit(robot: Robot, fit: Evaluation, *, as_read: bool = False) -> list[str]:
    """Refuses a calibration that explains nothing: half of the rows are still farther off than a part of the reach.

    With `as_read`, a note says so instead.

    Raises:
        InvalidInput: The data are of another robot, or no measurements at all.
    """
    limit = BAD_SHARE * robot.reach
    if fit.rows is None and fit.after is not None and 2 * fit.after.mean < limit:
        return []  # half of some lengths are at most twice their mean
    known = distances(fit.error_after, fit.length_after)
    known = known[~np.isnan(known)]
    median = float(np.median(known)) if len(known) else 0.0
    if median <= limit:
        return []
    miss, reach = (f"{from_si(length, 'mm'):.4g} mm" for length in (median, robot.reach))
    message = (
        f"the points do not fit this robot: even when calibrated it misses half of them by more than {miss}, with a "
        f"reach of {reach}; is it the right robot, with its joints in order and every point in the row of its pose?"
    )
    if as_read:
        return [message]
    raise InvalidInput(f"{fit.data.source}: {message}")


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
