# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the targets of a cell are, and its boards before its cameras, with the uncertainty of what was identified."""

from __future__ import annotations

from dataclasses import dataclass

from fastcal.arrays import FloatArray
from fastcal.cells.branches import possible_ways
from fastcal.cells.cell import Cell
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import view_poses
from fastcal.cells.view_points import all_views, deviation_of, view_points, with_rig_as_points
from fastcal.errors import FastcalError, InvalidInput
from fastcal.measurements.rotations import quaternions


@dataclass(frozen=True, eq=False)
class CellPrediction:
    """Poses of a view, TARGET or TARGET:SENSOR.

    Attributes:
        position: (N, 3) of the target in the sensor's frame [m].
        rotation: (N, 4) unit quaternion w, x, y, z.
        sigma_position: (N, 3) standard deviation that comes from the identified parameters alone [m]; NaN where the
            cell does not keep how surely the numbers behind it are known.
    """

    position: FloatArray
    rotation: FloatArray
    sigma_position: FloatArray


def predict_cell(cell: Cell, postures: Readings, *, threads: int = 1) -> dict[str, CellPrediction]:
    """Where all targets are from the world and from all sensors, cameras and boards on arms, and boards from cameras.

    And what the postures have columns of. What a camera's mount gives under its weight is not part of where it is.

    InvalidInput where the cell has nothing of it, or an effect needs a condition that the postures do not have.
    """
    rig = [name for members in (cell.cameras, cell.boards) for name, of in members.items() if of["on"] != "world"]
    asked = [view for view in postures.views if ":" in view]
    views = list(dict.fromkeys([*_targets(cell), *rig, *all_views(cell), *asked]))
    if not views:
        raise InvalidInput(f"the cell {cell.name} has no target, camera or board whose place could be predicted")
    ways = {way.name: way for way in possible_ways(cell, views)}
    seen = with_rig_as_points(cell)
    out = {}
    for view in views:
        T = view_poses(seen, postures, view, threads)
        sigma = _deviation(cell, postures, view, ways.get(view), threads)
        out[view] = CellPrediction(T[:, :3, 3].copy(), quaternions(T[:, :3, :3]), sigma)
    return out


def _targets(cell: Cell) -> list[str]:
    return [of.name for of in cell.points if of.role == "target"]


def _deviation(cell: Cell, postures: Readings, view: str, way: Way | None, threads: int) -> FloatArray:
    """(N, 3) of a view [m]: from the record of its own way, else from that of the whole cell."""
    if way is not None and way.record is not None:
        try:
            return way.robot.deviation_at(way.robot.samples(way.rows(cell, postures)), threads)
        except FastcalError:
            pass  # a way that is no serial arm
    return deviation_of(cell, view_points(cell, postures, view, threads=threads))
