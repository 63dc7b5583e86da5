# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Points of what is read in the frame of what reads, and how they follow everything that a cell's record knows.

Boards are targets here and cameras sensors. A change of a camera or board is a motion X(d, w) in its own frame, so of a
point p = T_camera_board c:

    dp = R (d_b - c x w_b)  of the board,    dp = -d_c + p x w_c  of the camera.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.cells.cell import Cell, Point
from fastcal.cells.readings import Readings
from fastcal.cells.simulate import view_poses
from fastcal.effects.entries import full_name
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.core_model import pose
from fastcal.robot.rig import PLACEMENT
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import skew

_FOLLOWS = 1e-9  # [m per m, rad] of a derivative: less is rounding


@dataclass(frozen=True, eq=False)
class ViewPoints:
    """Points of a view in N postures.

    Attributes:
        position: (N, 3) in the frame of what reads [m].
        J: (N, 3, T) their derivatives by the parameters of `names`, SI.
    """

    position: FloatArray
    J: FloatArray
    names: list[str]


def with_rig_as_points(cell: Cell) -> Cell:
    """The cell with its boards as targets and its cameras as sensors, and nothing that pictures alone show."""
    members = [("sensor", cell.cameras), ("target", cell.boards)]
    points = [
        Point(name, role, str(entry["on"]), frame_spec(pose(entry)))
        for role, of in members
        for name, entry in of.items()
    ]
    return replace(cell, points=(*cell.points, *points), cameras={}, boards={}, distances=(), touched=())


def all_views(cell: Cell) -> list[str]:
    """TARGET:SENSOR of all targets from all sensors, BOARD:CAMERA of all boards from all cameras."""
    of = {role: [point.name for point in cell.points if point.role == role] for role in ("target", "sensor")}
    pairs = [(target, sensor) for target in of["target"] for sensor in of["sensor"]]
    return [f"{a}:{b}" for a, b in [*pairs, *((board, camera) for board in cell.boards for camera in cell.cameras)]]


def view_points(
    cell: Cell, postures: Readings, view: str, at: Sequence[float] = (0.0, 0.0, 0.0), threads: int = 1
) -> ViewPoints:
    """The origin of a target, or a point `at` (3,) of a board [m], from the world, a sensor or a camera.

    InvalidInput where an effect needs a condition that the postures do not have.
    """
    seen = with_rig_as_points(cell)
    target, _, sensor = view.partition(":")
    T_at = np.eye(4)
    T_at[:3, 3] = at
    place = next(of for of in seen.points if of.name == target)
    there = replace(place, place=frame_spec(pose(place.place) @ T_at))
    moved = replace(seen, points=tuple(there if of is place else of for of in seen.points))
    measured = Readings(postures.q, {f"position@{view}": np.zeros((len(postures), 3))}, "", arms=postures.arms)
    near = _core.linearize(
        moved.model, measured.samples(moved), measured.measured(moved), np.asarray(moved.model.start), [1.0], threads
    )
    order = np.argsort(np.asarray(near.row), kind="stable")
    p = np.asarray(near.r)[order].reshape(-1, 3)
    own = np.asarray(near.J)[order].reshape(len(p), 3, -1)
    of_rig = {*cell.cameras, *cell.boards}
    kept = [i for i, of in enumerate(moved.model.parameters) if of.owner not in of_rig]
    names, parts = [full_name(moved.model.parameters[i]) for i in kept], [own[:, :, kept]]
    if target in cell.boards:
        R = view_poses(seen, postures, view, threads)[:, :3, :3]
        names += [f"board {target} {axis}" for axis in PLACEMENT]
        parts.append(np.concatenate([R, -R @ skew(np.asarray(at, dtype=float))], axis=2))
    if sensor in cell.cameras:
        names += [f"camera {sensor} {axis}" for axis in PLACEMENT]
        parts.append(np.concatenate([np.broadcast_to(-np.eye(3), (len(p), 3, 3)), [skew(each) for each in p]], axis=2))
    return ViewPoints(p, np.concatenate(parts, axis=2), names)


def deviation_of(cell: Cell, points: ViewPoints) -> FloatArray:
    """(N, 3) standard deviations [m] by what a calibrated cell keeps of its certainty.

    NaN where the cell keeps nothing, or not of all that the points follow: joints that its readings never looked at.
    """
    record = CalibrationRecord.from_spec(cell.record)
    none = np.full(points.position.shape, np.nan)
    if record is None:
        return none
    follows = np.abs(points.J).max(axis=(0, 1)) > _FOLLOWS
    seen = {*record.parameters, *record.unknowns, *record.moved, *_given(cell)}
    if any(own and name not in seen for name, own in zip(points.names, follows.tolist(), strict=True)):
        return none
    known = [k for k, name in enumerate(points.names) if name in record.roots]
    root = np.array([record.roots[points.names[k]] for k in known])
    return np.asarray(np.linalg.norm(points.J[:, :, known] @ root, axis=2)) if known else none


def _given(cell: Cell) -> set[str]:
    """Names of what no readings have to show: places that are fixed, and effects."""
    own = {arm.name: f"{arm.name}.base" for arm in cell.arms}
    fixed = [own.get(of.name, of.name) for of in cell.core.branches if cell.known(of.name).fixed]
    rigs = (("camera", cell.cameras), ("board", cell.boards))
    fixed += [f"{kind} {name}" for kind, rig in rigs for name, of in rig.items() if of.get("fixed")]
    effects = [full_name(of) for of in list(cell.model.parameters)[len(cell.core.parameters) :]]
    return {*(f"{owner} {axis}" for owner in fixed for axis in PLACEMENT), *effects}
