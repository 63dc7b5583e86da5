# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How surely the numbers of a cell and of each of its ways are known, for checks and updates to come.

A way is fitted once more alone, as one arm: by what was read of its target, and not by what others tell of the joints
that they share. So its deviations are no smaller than those of the fit of all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal import _core
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.unknowns import kept_unknowns
from fastcal.cells.branches import possible_ways
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.effects.entries import full_name
from fastcal.errors import FastcalError
from fastcal.monitoring.update import update
from fastcal.robot.calibration_record import CalibrationRecord, lower_root
from fastcal.robot.identified_spec import Solution
from fastcal.robot.robot_spec import Spec

JOINTS = "joints"  # beside the kinds of readings in the noise of a record: what joints repeat to


def cell_record(
    found: Solution,
    measured: _core.Measurements,
    parameters: Sequence[_core.Parameter],
    noise: dict[str, tuple[float, str]],
    freedom: int,
) -> CalibrationRecord:
    """The covariance of all that was identified of a cell.

    Args:
        found: Of the tree's parameters, then the unknowns of `measured`.
        measured: What was read.
        parameters: Of the tree and its effects.
        noise: As a record has it.
        freedom: Degrees of freedom.
    """
    covariance, count = np.asarray(found.covariance), len(parameters)
    own = [i for i in found.free if i < count]
    return CalibrationRecord(
        [full_name(parameters[i]) for i in own],
        lower_root(covariance[: len(own), : len(own)]),
        noise,
        freedom,
        unknowns=(unknowns := kept_unknowns(found, measured, count, covariance))[0],
        unknown_root=unknowns[1],
    )


def updated_records(cell: Cell, readings: Readings, threads: int = 1) -> dict[str, Spec]:
    """The records of a calibrated cell's ways with new readings; as they were where these do not fix a way."""
    out = dict(cell.records)
    for way in possible_ways(cell, [view for view in readings.views if view in out]):
        try:
            record = update(way.robot, way.rows(cell, readings), threads=threads).model.record
        except FastcalError:
            continue
        if record is not None:
            out[way.name] = record.to_spec()
    return out


def way_records(cell: Cell, readings: Readings, threads: int = 1) -> dict[str, Spec]:
    """`calibration` blocks by target; none of a way that its own readings do not fix."""
    out: dict[str, Spec] = {}
    for way in possible_ways(cell, readings.views):
        try:
            found = calibrate(way.robot, way.rows(cell, readings), checks=False, threads=threads)
        except FastcalError:
            continue  # too few readings of this target, or an arm that is no part of a way
        record = found.model.record
        if found.status == "converged" and record is not None:
            out[way.name] = record.to_spec()
    return out
