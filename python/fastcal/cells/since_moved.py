# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What was read before a target or sensor was moved, as it would have been read since: of ways, which know no rows.

With T_before and T_since the poses of the target seen from the sensor in one posture, D = T_since T_before^-1 takes
what was read then to where it is since. Of a sensor that was moved, D is the same in all postures.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.cells.cell import Cell
from fastcal.cells.knocked import name_since
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import view_poses
from fastcal.measurements.rotations import quaternions, rotations
from fastcal.robot.se3 import inverses


def as_since(cell: Cell, readings: Readings) -> Readings:
    """Readings of a cell as if its members had stood from the first row on where they stand now.

    Args:
        cell: Says what was moved, from which row on and by how much.
        readings: In the order of measuring.
    """
    apart = readings.of_frames(cell)
    if apart is readings:
        return readings
    tables = dict(readings.tables)
    postures = replace(readings, tables={}, labels={})
    for name, there in apart.tables.items():
        field, _, view = name.partition("@")
        since = name_since(view)
        if since == view or field.startswith("sigma"):
            continue
        own = np.flatnonzero(np.isfinite(there).all(axis=1))
        if not len(own):
            continue
        now, before = (view_poses(cell, postures.pick(own), each) for each in (since, view))
        D = now @ inverses(before)
        table = tables[f"{field}@{since}"].copy()
        if field == "position":
            table[own] = np.einsum("nij,nj->ni", D[:, :3, :3], table[own]) + D[:, :3, 3]
        elif field == "rotation":
            table[own] = quaternions(D[:, :3, :3] @ rotations(table[own]))
        elif field == "distance":
            lengths = [np.linalg.norm(T[:, :3, 3], axis=1, keepdims=True) for T in (now, before)]
            table[own] += lengths[0] - lengths[1]
        tables[f"{field}@{since}"] = table
    return replace(readings, tables=tables)
