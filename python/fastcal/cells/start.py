# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the members of a cell stand, in closed form, from the readings alone.

A reading sees a target from a sensor: T_world_sensor S = T_world_target with S measured. For one member that stands at
X on its frame F, every reading in which it is one of the ends gives a point or a whole pose of X on F, once all others
are where they are. So each is placed given the others, in turn, the robust mean of what its readings say, a few rounds:
    X = F^-1 T_world_sensor S          (a target)
    X = F^-1 T_world_target S^-1       (a sensor, a whole pose)
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.hand_eye import gross, hand_eye
from fastcal.calibration.picture_arm import meant_by_poses
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput
from fastcal.measurements.rotations import nearest_rotation
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import frame_spec

FloatArray = NDArray[np.float64]
_ROUNDS = 8
_LEAST = 3  # readings that place a member


def started(cell: Cell, readings: Readings) -> tuple[Cell, Readings, list[int]]:
    """The cell with its free targets and sensors where the readings put them, as far as they say.

    With the readings that belong to it, and the rows of those that do not.
    """
    loose = [of for of in cell.points if not of.known.fixed and of.known.sigma_mm is None]
    if not any(view.partition(":")[2] for view in readings.views):
        return cell, readings, []  # read from the world: what the file says is near enough for the fit
    cell, left, wrong = _closed_form(cell, readings, {of.name for of in loose})
    readings = readings.without(wrong)
    for _ in range(_ROUNDS):
        for point in loose:
            if point.name in left:
                cell = _placed(cell, readings, point.name)
    return cell, readings, sorted({row for rows in wrong.values() for row in rows})


def _closed_form(cell: Cell, readings: Readings, loose: set[str]) -> tuple[Cell, set[str], dict[str, list[int]]]:
    """The cell with sensors and targets that see each other, both free, where the closed form puts them.

    With what is left to be placed, and by view the rows whose readings are of something else.

    A T_frame_sensor S = T_other_target, A the sensor's frame in that of the target.
    """
    model, samples = cell.model, readings.samples(cell)
    wrong: dict[str, list[int]] = {}
    for view in readings.views:
        target, _, sensor = view.partition(":")
        seen = _measured_poses(readings, view)
        if seen is None or not {target, sensor} <= loose:
            continue
        places = {of.name: of for of in cell.points}
        frame, other = (_world_poses(model, samples, places[name].on, len(readings)) for name in (sensor, target))
        A, whole = se3.inverses(other) @ frame, np.isfinite(seen).all(axis=(1, 2))
        found = hand_eye(A[whole], seen[whole])
        if found is None:
            continue
        if meant := meant_by_poses(A[whole], seen[whole]):
            raise InvalidInput(f"{readings.source}: poses of {target} as {sensor} saw it: {meant}")
        wrong[view] = np.flatnonzero(whole)[gross(A[whole], seen[whole], *found)].tolist()
        moved = {sensor: found[0], target: found[1]}
        points = tuple(replace(of, place=frame_spec(moved[of.name])) if of.name in moved else of for of in cell.points)
        cell = replace(cell, points=points)
        loose = loose - set(moved)
    return cell, loose, wrong


def _world_poses(model: _core.ErrorModel, samples: _core.Samples, of: str, count: int) -> FloatArray:
    """(N, 4, 4) of a frame of the cell."""
    if of in ("", "world"):
        return np.broadcast_to(np.eye(4), (count, 4, 4))
    return np.asarray(model.predict(samples, model.start, of=of))


def _placed(cell: Cell, readings: Readings, name: str) -> Cell:
    """The cell with one point where all its readings of whole poses put it."""
    point = next(of for of in cell.points if of.name == name)
    model, samples = cell.model, readings.samples(cell)

    def poses(of: str) -> FloatArray:
        return _world_poses(model, samples, of, len(readings))

    found = []
    for view in readings.views:
        target, _, sensor = view.partition(":")
        seen = _measured_poses(readings, view)
        if seen is None or name not in (target, sensor):
            continue
        T = poses(sensor) @ seen if name == target else poses(target) @ se3.inverses(seen)
        found.append(se3.inverses(poses(point.on)) @ T)
    every = [T for T in np.concatenate(found) if not np.isnan(T).any()] if found else []
    if len(every) < _LEAST:
        return cell
    place = frame_spec(_mean(np.array(every), pose(point.place)))
    points = tuple(replace(of, place=place) if of.name == name else of for of in cell.points)
    return replace(cell, points=points)


def _measured_poses(readings: Readings, view: str) -> FloatArray | None:
    """(N, 4, 4) T_sensor_target as measured, NaN where not whole; None where the view has no whole poses."""
    p, wxyz = readings.tables.get(f"position@{view}"), readings.tables.get(f"rotation@{view}")
    if p is None or wxyz is None:
        return None
    out = np.full((len(p), 4, 4), np.nan)
    for i in np.flatnonzero(np.isfinite(np.hstack([p, wxyz])).all(axis=1)):
        out[i] = se3.pose(_core.quaternion_to_rotation(wxyz[i]), p[i])
    return out


def _mean(T: FloatArray, near: FloatArray) -> FloatArray:
    """A robust mean of poses (N, 4, 4): the median of positions, and of turns about the best rotation of all."""
    R = nearest_rotation(T[:, :3, :3].sum(axis=0))
    turns = np.array([_core.log_so3(R.T @ each) for each in T[:, :3, :3]])
    out = near.copy()
    out[:3, :3] = R @ _core.exp_so3(np.median(turns, axis=0))
    out[:3, 3] = np.median(T[:, :3, 3], axis=0)
    return out
