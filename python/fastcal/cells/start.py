# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the members of a cell stand, in closed form, from the readings alone.

A reading sees a target from a sensor: T_world_sensor S = T_world_target with S measured. For one member that stands at
X on its frame F, every reading in which it is one of the ends gives a point or a whole pose of X on F, once all others
are where they are. So each is placed given the others, in turn, the robust mean of what its readings say, a few rounds:
    X = F^-1 T_world_sensor S          (a target)
    X = F^-1 T_world_target S^-1       (a sensor, a whole pose; of points the motion that fits best)
Where points read from the world miss the places of the file by far, each arm that stands there goes first, with one of
its targets, where the closed form of a serial arm has both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import align
from fastcal.calibration.hand_eye import gross, hand_eye
from fastcal.calibration.picture_arm import meant_by_poses
from fastcal.calibration.point_hand_eye import meant_by_points, point_hand_eye
from fastcal.cells.asked import arms_between
from fastcal.cells.cell import SIGMA_MM, Cell, Known, Point
from fastcal.cells.paths import Way, serial_ways
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput
from fastcal.measurements.rotations import best_motion, nearest_rotation
from fastcal.robot import se3
from fastcal.robot.core_model import pose
from fastcal.robot.robot_spec import frame_spec
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
_ROUNDS = 8
_LEAST = 3  # readings that place a member
_MANY = 0.2  # of the rows of a view: where more are gross, what carries it stands elsewhere than the file has it
_FAR = 20.0  # plausible errors of a place in the file, in the median, beyond which no fit starts there


def started(cell: Cell, readings: Readings, *, as_read: bool = False) -> tuple[Cell, Readings, list[int]]:
    """The cell with its free targets and sensors where the readings put them, as far as they say.

    With the readings that belong to it, and the rows of those that do not. as_read: do not ask what else poses and
    points of a sensor could be, which takes longer than their closed form.
    """
    cell = _aligned(cell, readings)
    loose = [of for of in cell.points if _is_free(of.known)]
    if not any(view.partition(":")[2] for view in readings.views):
        return cell, readings, []
    cell, left, wrong = _closed_form(cell, readings, {of.name for of in loose}, as_read=as_read)
    readings = readings.without(wrong)
    for _ in range(_ROUNDS):
        for point in loose:
            if point.name in left:
                cell = _placed(cell, readings, point.name)
    return cell, readings, sorted({row for rows in wrong.values() for row in rows})


def _is_free(known: Known) -> bool:
    """Does the file not say how surely it knows a place?"""
    return not known.fixed and known.sigma_mm is None


def _aligned(cell: Cell, readings: Readings) -> Cell:
    """The cell with arms that stand on the world, and their targets, where points read from there put them.

    Only those that points miss by more than _FAR plausible errors where the file has them. p = B T_k x of readings k,
    T_k the flange on the arm's base: B and x of the target that was read most in closed form; another target's x is the
    median of (B T_k)^-1 p.
    """
    ways: dict[str, list[tuple[Way, FloatArray]]] = {}
    for way in serial_ways(cell.without_effects, readings.views):
        seen = readings.tables.get(f"position@{way.name}")
        if seen is not None and _is_free(way.target.known) and _is_free(way.arms[0].known):
            ways.setdefault(way.arms[0].name, []).append((way, seen))
    for name, own in ways.items():
        if not _misses_by_far(cell, readings, own):
            continue
        way, _ = max(own, key=lambda of: int(np.isfinite(of[1]).all(axis=1).sum()))
        data = way.rows(cell, readings)
        found = align(way.robot, data.select(data.measured))
        if not found.found:
            continue
        base = frame_spec(np.asarray(found.T_world_base))
        arms = tuple(replace(of, robot=of.robot.with_(base=base)) if of.name == name else of for of in cell.arms)
        cell = _with_places(replace(cell, arms=arms), {way.name: np.asarray(found.T_flange_tool)})
        model, samples = cell.model, readings.samples(cell)
        others = {}
        for other, seen in own:
            on = _world_poses(model, samples, other.target.on, len(readings))
            on_it = np.einsum("nji,nj->ni", on[:, :3, :3], seen - on[:, :3, 3])
            if other is not way and np.isfinite(on_it).any():
                others[other.name] = se3.pose(pose(other.target.place)[:3, :3], np.nanmedian(on_it, axis=0))
        cell = _with_places(cell, others)
    return cell


def _misses_by_far(cell: Cell, readings: Readings, ways: Sequence[tuple[Way, FloatArray]]) -> bool:
    """Do points miss where the file has them by more than _FAR plausible errors, in the median?"""
    model, samples = cell.model, readings.samples(cell)
    missed = [
        np.linalg.norm(_world_poses(model, samples, way.name, len(readings))[:, :3, 3] - seen, axis=1)
        for way, seen in ways
    ]
    return bool(np.nanmedian(np.concatenate(missed)) > _FAR * to_si(SIGMA_MM, "mm"))


def _with_places(cell: Cell, places: Mapping[str, FloatArray]) -> Cell:
    """The cell with some points elsewhere on their frames."""
    moved = {name: frame_spec(T) for name, T in places.items()}
    points = tuple(replace(of, place=moved[of.name]) if of.name in moved else of for of in cell.points)
    return replace(cell, points=points)


def _closed_form(
    cell: Cell, readings: Readings, loose: set[str], *, as_read: bool
) -> tuple[Cell, set[str], dict[str, list[int]]]:
    """The cell with sensors and targets that see each other, both free, where the closed form puts them.

    With what is left to be placed, and by view the rows whose readings are of something else.

    A T_frame_sensor S = T_other_target, A the sensor's frame in that of the target; of points A T_frame_sensor s = b.
    """
    model, samples = cell.model, readings.samples(cell)
    wrong: dict[str, list[int]] = {}
    for view in readings.views:
        target, _, sensor = view.partition(":")
        if not {target, sensor} <= loose:
            continue
        places = {of.name: of for of in cell.points}
        frame, other = (_world_poses(model, samples, places[name].on, len(readings)) for name in (sensor, target))
        A, seen = se3.inverses(other) @ frame, _measured_poses(readings, view)
        if seen is None:
            at = _measured_points(readings, view)
            there = np.isfinite(at).all(axis=1)
            if not as_read and (meant := meant_by_points(A[there], at[there])):
                raise InvalidInput(f"{readings.source}: points of {target} as {sensor} saw them: {meant}")
            if (by_points := point_hand_eye(A[there], at[there])) is not None:
                X, b = by_points
                turn = pose(places[target].place)[:3, :3]
                cell, loose = _with_places(cell, {sensor: X, target: se3.pose(turn, b)}), loose - {sensor, target}
            continue
        whole = np.isfinite(seen).all(axis=(1, 2))
        found = hand_eye(A[whole], seen[whole])
        if found is None:
            continue
        if not as_read and (meant := meant_by_poses(A[whole], seen[whole])):
            raise InvalidInput(f"{readings.source}: poses of {target} as {sensor} saw it: {meant}")
        off = np.flatnonzero(whole)[gross(A[whole], seen[whole], *found)].tolist()
        is_told = all(cell.arm(name).of_poses for name in arms_between(cell, view))  # by controllers, and not by files
        wrong[view] = off if is_told or len(off) <= _MANY * whole.sum() else []
        cell = _with_places(cell, {sensor: found[0], target: found[1]})
        loose = loose - {sensor, target}
    return cell, loose, wrong


def _world_poses(model: _core.ErrorModel, samples: _core.Samples, of: str, count: int) -> FloatArray:
    """(N, 4, 4) of a frame of the cell."""
    if of in ("", "world"):
        return np.broadcast_to(np.eye(4), (count, 4, 4))
    return np.asarray(model.predict(samples, model.start, of=of))


def _placed(cell: Cell, readings: Readings, name: str) -> Cell:
    """The cell with one target or sensor where all its readings put it, those of whole poses if there are any."""
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
    if len(every) >= _LEAST:
        return _with_places(cell, {name: _mean(np.array(every), pose(point.place))})
    by_points = _placed_by_points(point, readings, poses)
    return cell if by_points is None else _with_places(cell, {name: by_points})


def _placed_by_points(point: Point, readings: Readings, poses: Callable[[str], FloatArray]) -> FloatArray | None:
    """(4, 4) on its frame: a target at the median of what was read, a sensor by W. Kabsch (1976); None: too little was.

    Args:
        point: The target or sensor.
        readings: Of points.
        poses: (N, 4, 4) of a frame, a target or a sensor in the world.
    """
    own, other = list[FloatArray](), list[FloatArray]()  # as a sensor reads it, and where that is on its frame
    for view in readings.views:
        target, _, sensor = view.partition(":")
        if not sensor or point.name not in (target, sensor) or _measured_poses(readings, view) is not None:
            continue
        seen, on = _measured_points(readings, view), se3.inverses(poses(point.on))
        there = np.isfinite(seen).all(axis=1)
        if point.name == target:
            seen = np.einsum("nij,nj->ni", poses(sensor)[:, :3, :3], seen) + poses(sensor)[:, :3, 3]
        at = seen if point.name == target else poses(target)[:, :3, 3]
        own.append(seen[there])
        other.append((np.einsum("nij,nj->ni", on[:, :3, :3], at) + on[:, :3, 3])[there])
    if sum(map(len, own)) < _LEAST:
        return None
    if point.name in {view.partition(":")[0] for view in readings.views}:
        return se3.pose(pose(point.place)[:3, :3], np.median(np.concatenate(other), axis=0))
    return best_motion(np.concatenate(own), np.concatenate(other))


def _measured_points(readings: Readings, view: str) -> FloatArray:
    """(N, 3) of a view, NaN where not measured."""
    p = readings.tables.get(f"position@{view}")
    return np.full((len(readings), 3), np.nan) if p is None else p


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
