# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How surely the numbers of each way of a cell are known, for checks to come.

A way is fitted once more alone, as one arm: by what was read of its target, and not by what others tell of the joints
that they share. So its deviations are no smaller than those of the fit of all.
"""

from __future__ import annotations

from fastcal.calibration.calibrate import calibrate
from fastcal.cells.cell import Cell
from fastcal.cells.paths import possible_ways
from fastcal.cells.readings import Readings
from fastcal.errors import FastcalError
from fastcal.robot.robot_spec import Spec


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
