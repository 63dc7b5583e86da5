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
from fastcal.arrays import FloatArray
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.unknowns import kept_unknowns
from fastcal.cells.asked import WEAK
from fastcal.cells.branches import possible_ways
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.cells.since_moved import as_since
from fastcal.effects.entries import full_name
from fastcal.errors import FastcalError
from fastcal.monitoring.update import update
from fastcal.robot.calibration_record import CalibrationRecord, lower_root
from fastcal.robot.controller_robot import nominal_record
from fastcal.robot.identified_spec import Solution
from fastcal.robot.rig import about_found
from fastcal.robot.robot_spec import Spec

JOINTS = "joints"  # beside the kinds of readings in the noise of a record: what joints repeat to


def cell_record(
    found: Solution,
    measured: _core.Measurements,
    parameters: Sequence[_core.Parameter],
    noise: dict[str, tuple[float, str]],
    freedom: int,
    to_written: FloatArray,
) -> CalibrationRecord:
    """The covariance of all that was identified of a cell.

    Args:
        found: Of the tree's parameters, then the unknowns of `measured`.
        measured: What was read.
        parameters: Of the tree and its effects.
        noise: As a record has it.
        freedom: Degrees of freedom.
        to_written: (P, P) as `motions.to_written` has it.
    """
    covariance, count = np.array(found.covariance), len(parameters)
    own = [i for i in found.free if i < count]
    change = to_written[np.ix_(own, own)]
    covariance[: len(own)] = change @ covariance[: len(own)]
    covariance[:, : len(own)] = covariance[:, : len(own)] @ change.T
    return CalibrationRecord(
        [full_name(parameters[i]) for i in own],
        lower_root(covariance[: len(own), : len(own)]),
        noise,
        freedom,
        unknowns=(unknowns := kept_unknowns(found, measured, count, covariance))[0],
        unknown_root=unknowns[1],
    )


def cell_directions(
    found: _core.Identification,
    theta: FloatArray,
    near: _core.Linearization,
    measured: _core.Measurements,
    to_written: FloatArray,
) -> tuple[list[str], FloatArray]:
    """Names of all that moves with what was held, cameras and boards too, and the directions (M, held).

    As of `CalibrationRecord`, of the places found. A direction that would take something by more than WEAK plausible
    sizes is as much shorter; what the readings see of it where the fit is in the end is taken up by what is free.

    Args:
        found: The core's fit, whose gauge held them.
        theta: (T,) of the tree's parameters, then the unknowns of `measured`, as they are in the end.
        near: The readings there.
        measured: What was read.
        to_written: (P, P) as `motions.to_written` has it.
    """
    held = np.asarray(found.held_directions)
    if not held.size:
        return [], np.zeros((0, 0))
    size = np.array([of.sigma for of in found.parameters])
    whole = np.zeros((len(size), held.size // len(found.asked)))
    whole[list(found.asked)] = held.reshape(len(found.asked), -1)
    whole /= np.maximum(np.abs(whole / size[:, np.newaxis]).max(axis=0) / WEAK, 1.0)
    free = list(found.free)
    J, A = np.asarray(near.J), np.asarray(near.J)[:, free] * size[free]
    seen = np.linalg.solve(A.T @ A + np.eye(len(free)) / WEAK**2, A.T @ (J @ whole))
    whole[free] -= size[free, np.newaxis] * seen
    count = len(size) - len(measured.parameters)
    whole[:count] = to_written @ whole[:count]
    whole[count:] = about_found(measured.parameters, theta[count:]) @ whole[count:]
    rows = np.flatnonzero(whole.any(axis=1))
    return [full_name(found.parameters[i]) for i in rows], whole[rows]


def updated_records(cell: Cell, readings: Readings, threads: int = 1) -> dict[str, Spec]:
    """The records of a calibrated cell's ways with new readings; as they were where these do not fix a way."""
    out = dict(cell.records)
    for way in possible_ways(cell, [view for view in readings.views if view in out]):
        try:
            record = update(way.robot, way.rows(cell, readings), threads=threads).model.record
        except FastcalError:
            continue
        if record is not None:
            out[way.name] = record.to_spec() | {k: v for k, v in out[way.name].items() if k == "nominal"}
    return out


def way_records(cell: Cell, given: Cell, readings: Readings, threads: int = 1) -> dict[str, Spec]:
    """`calibration` blocks by target, with the geometry of the cell `given`, which the controllers have.

    None of a way that its own readings do not fix.
    """
    out: dict[str, Spec] = {}
    readings = as_since(cell, readings)
    before = {way.name: way for way in possible_ways(given, readings.views)}
    for way in possible_ways(cell, readings.views):
        try:
            found = calibrate(way.robot, way.rows(cell, readings), checks=False, threads=threads)
        except FastcalError:
            continue  # too few readings of this target, or an arm that is no part of a way
        record = found.model.record
        if found.status == "converged" and record is not None:
            out[way.name] = record.to_spec()
            start = before[way.name].robot
            if start.joint_count == way.robot.joint_count:  # no branch has been found to weigh on it
                out[way.name]["nominal"] = nominal_record(start.spec)
    return out
