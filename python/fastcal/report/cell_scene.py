# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cell in three dimensions: its arms, what reads and what is read, and the errors as arrows, posture by posture.

An error of a point is drawn from where it was measured towards where it is predicted, in the axes of what reads it,
turned into the measuring frame. Of a picture that is how far the board is off across the view, the mean over its
corners of (du z / fx, dv z / fy), z their depth; it is drawn at whichever moves more, the board or the camera, of
which it is the opposite.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.calibration.evaluation import Evaluation
from fastcal.calibration.kind_errors import KindErrors
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell
from fastcal.cells.errors import view_errors
from fastcal.cells.readings import Readings
from fastcal.measurements.dataset import Dataset
from fastcal.report import standing
from fastcal.report.arm import LINK, Arm, Run, arm_of, contributions, frame_points, line_through, posed, with_joint_of
from fastcal.report.figures import Figure, Key, spread_rows
from fastcal.report.formatting import count
from fastcal.report.language import _
from fastcal.report.view import Rows, Variable
from fastcal.report.workspace import ARROW_LIMIT, scene
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners, frame_of, pictures
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Spec
from fastcal.units import from_si

ARMS = (LINK, "#8464a8", "#4f8f5f", "#a07a30", "#a8566a", "#3c8c9c")  # of arms, in turn
_MOST_POINTS = 12_000  # of all postures together, so that the page stays below 1.5 MB
_MOST_ROWS = 300  # that contributions are found from
_WORLD = "world"


@dataclass(frozen=True, eq=False)
class _Arrows:
    """Errors of one view: the posture of each (K,), where it begins and how far it goes (K, 3) [mm]."""

    of: NDArray[np.intp]
    start: FloatArray
    after: FloatArray
    before: FloatArray | None
    is_picture: bool


def cell_scene(cell: Cell, readings: Readings, before: Cell | None = None) -> Figure | None:
    """The cell in the postures of its readings; None where it has no arm, or nothing was read.

    Args:
        cell: As it is now.
        readings: What was read in it.
        before: As it was; None: errors are those of now.
    """
    views = view_errors(cell, readings)
    rows = _rows_read(views, len(readings))
    if not cell.arms or not len(rows):
        return None
    points = cell.core.frame_count + 8 * (len(cell.cameras) + len(cell.boards) + len(views))
    chosen = rows[spread_rows(len(rows), max(1, min(ARROW_LIMIT // len(views), _MOST_POINTS // points)))]
    used = readings.pick(chosen)
    errors = view_errors(cell, used, before)
    poses = _cell_poses(cell, used)
    arrows, arm = list[_Arrows](), _arms(cell, used)
    for of in cell.points:
        colour = standing.SEES if of.role == "sensor" else standing.TARGET
        at = _millimetres(poses(of.name))
        arm = standing.with_mark(arm, at, of.name, colour, None if of.on == _WORLD else _millimetres(poses(of.on)))
    arm = standing.with_rig(arm, poses, cell.cameras, cell.boards)
    origin = _millimetres(poses(_WORLD))
    far = any(_reads_from_world(name) for name in errors) and standing.is_far(arm, origin[0])
    if not far and any(_reads_from_world(name) for name in errors):
        arm = standing.with_mark(arm, origin, _("world"), standing.SEES)
    if before is not None:
        arm = replace(arm, contributions=_contributions(cell, before, readings.pick(rows), list(errors)))
    for name, read in errors.items():
        field, _at, view = name.partition("@")
        target, _colon, sensor = view.partition(":")
        if field == CORNERS:
            camera, board = cell.cameras[sensor], cell.boards[target]
            arm = _seen(arm, read, standing.middle_of(poses, camera), standing.middle_of(poses, board))
            arrows.append(_picture_arrows(read, poses, camera, board))
            continue
        if field == "position":
            arrows.append(_point_arrows(read, poses(sensor or _WORLD), used.tables[name]))
        if sensor or not far:
            arm = _seen(arm, read, _millimetres(poses(sensor or _WORLD)), _millimetres(poses(target)))
    arm = replace(arm, rows=[(0, int(row)) for row in chosen], labels=_labels(chosen), variables=_joints(cell, used))
    key = [Key(each.name, ARMS[k % len(ARMS)], "solid") for k, each in enumerate(cell.arms)]
    told = _("The instrument, far off at the origin, is not drawn.") if far else ""
    found = _drawn(arm, arrows, len(rows), is_now=before is None, told=told)
    return replace(found, key=key if len(key) > 1 else [])


def arm_and_rig(robot: Robot, before: Robot, sets: Sequence[tuple[Rows | None, Evaluation | None]]) -> Arm | None:
    """The arm as `arm_of` has it, with its cameras and boards where it has any."""
    arm = arm_of(robot, before, sets)
    q = [of.data.q[rows.with_arrows] for rows, of in sets if rows is not None and of is not None]
    return None if arm is None else with_own_rig(arm, robot, np.vstack(q))


def with_own_rig(arm: Arm, robot: Robot, q: FloatArray) -> Arm:
    """An arm's figure with its cameras and boards, where they are at q (R, n) without a load."""
    rig = robot.description.cameras, robot.description.boards
    return standing.with_rig(arm, robot_poses(robot, Dataset.from_arrays(q)), *rig) if any(rig) else arm


def pictures_scene(robot: Robot, before: Robot | None, part: Evaluation) -> Figure | None:
    """An arm with its cameras and boards, in the postures of its pictures; None where there are none.

    Args:
        robot: As it is now.
        before: As it was; None: errors are those of now.
        part: The pictures beside it.
    """
    errors = part.kinds.get(CORNERS)
    if errors is None:
        return None
    rows = _rows_read({CORNERS: errors}, len(part.data))
    chosen = rows[spread_rows(len(rows), ARROW_LIMIT // len(robot.description.cameras))]
    data = part.data.select(chosen)
    poses = robot_poses(robot, data)
    numbers = chosen if part.rows is None else part.rows[chosen]
    arm = posed(robot, data.q, None, [(0, int(row)) for row in numbers], [])
    if before is not None and arm.joints:
        arm = replace(arm, contributions=contributions(robot, before, part.data))
    arm = standing.with_rig(arm, poses, robot.description.cameras, robot.description.boards)
    arrows = []
    for (camera, board), own in pictures(robot.description).items():
        eye, plate = robot.description.cameras[camera], robot.description.boards[board]
        was = None if errors.numbers_before is None else errors.numbers_before[chosen][:, own]
        of = replace(errors, numbers=errors.numbers[chosen][:, own], numbers_before=was)
        arm = _seen(arm, of, standing.middle_of(poses, eye), standing.middle_of(poses, plate))
        arrows.append(_picture_arrows(of, poses, eye, plate))
    arm = replace(arm, labels=_labels(numbers))
    return _drawn(arm, arrows, len(rows), is_now=errors.numbers_before is None)


def _drawn(arm: Arm, arrows: Sequence[_Arrows], postures: int, *, is_now: bool, told: str = "") -> Figure:
    """The scene; `postures`: with readings, of which some are drawn; `told`: what else there is to say."""
    known = [each for each in arrows if len(each.of)]
    empty = np.zeros((0, 3))
    of = np.concatenate([each.of for each in known]) if known else np.zeros(0, dtype=np.intp)
    start, after = (np.vstack([getattr(each, name) for each in known] or [empty]) for name in ("start", "after"))
    before = after if is_now else np.vstack([each.before for each in known if each.before is not None] or [empty])
    lines = list[str]()
    if any(each.is_picture for each in known):
        pictured = _(
            "Each arrow is a picture: how far the camera or the board, whichever moves more, is off across the view, "
            "the mean over its corners."
        )
        lines.append(pictured)
    if any(not each.is_picture for each in known):
        from_points = _("Each arrow goes from where a target was measured towards where it is predicted.")
        if lines:
            from_points = _("For points it goes from where a target was measured towards where it is predicted.")
        lines.append(from_points)
    lines += [_("Thin lines join each sensor to its target."), *([told] if told else [])]
    if len(arm.rows) < postures:
        some = _(
            "{some} of {all} poses are drawn, spread evenly over the rows.",
            some=count(len(arm.rows)),
            all=count(postures),
        )
        lines.append(some)
    title, frame = _("The cell, and the errors in it"), _("the measuring frame")
    return scene(start, before, None if is_now else after, None, frame, arm, told=" ".join(lines), title=title, of=of)


def _rows_read(views: Mapping[str, KindErrors], row_count: int) -> NDArray[np.intp]:
    read = np.zeros(row_count, dtype=bool)
    for of in views.values():
        read |= np.isfinite(of.numbers).any(axis=(1, 2))
    return np.flatnonzero(read)


def _reads_from_world(name: str) -> bool:
    """Is a view of what the measuring frame's own instrument reads?"""
    return not name.startswith(CORNERS) and ":" not in name


def _labels(rows: NDArray[np.intp]) -> list[str]:
    return [_("row {row}", row=int(row)) for row in rows]


def _joints(cell: Cell, used: Readings) -> list[Variable]:
    """Joint positions, by which postures can be chosen."""
    out = []
    for k, (names, kind) in enumerate(zip(cell.joint_columns, cell.joint_types, strict=True)):
        unit, text = ("mm", "mm") if kind == "prismatic" else ("deg", "°")
        out.append(Variable(names[0], names[0], text, np.asarray(from_si(used.q[:, k], unit))))
    return [variable for variable in out if np.ptp(variable.values) > 0]


def _arms(cell: Cell, used: Readings) -> Arm:
    """All arms as one figure, a line each."""
    core = cell.core
    points, place = frame_points(cell, used.q)
    arm = Arm(points, [], [], [], None, [], [])
    branches = {branch.name: branch for branch in core.branches}
    for k, each in enumerate(cell.arms):
        branch, colour = branches[each.name], ARMS[k % len(ARMS)]
        frames = range(branch.first_frame, branch.first_frame + branch.frame_count)
        if each.of_poses:
            ends = [place[frames[0]], place[frames[-1]]]
            arm = replace(arm, runs=[*arm.runs, Run(ends, colour)])
            continue
        joints = [place[core.frame(f"{each.name}.joint{i + 1}")] for i in range(each.robot.joint_count)]
        names = [f"{each.name} {_('joint {number}', number=i + 1)}" for i in range(each.robot.joint_count)]
        run = Run(line_through(cell, place, frames), colour)
        arm = replace(arm, runs=[*arm.runs, run], joints=[*arm.joints, *joints], names=[*arm.names, *names])
    return arm


def _seen(arm: Arm, of: KindErrors, start: FloatArray, end: FloatArray) -> Arm:
    """With the lines of sight of a view, in the postures in which it was read."""
    read = np.asarray(np.isfinite(of.numbers).any(axis=(1, 2)))[:, np.newaxis]
    return standing.with_sight(arm, np.where(read, start, np.nan), np.where(read, end, np.nan))


def _cell_poses(cell: Cell, readings: Readings) -> standing.Poses:
    """Of frames of a cell in the postures of readings; each is found once."""
    model, samples = cell.model, readings.samples(cell)

    @lru_cache(None)
    def poses(name: str) -> FloatArray:
        if name == _WORLD:
            return np.tile(np.eye(4), (len(readings), 1, 1))
        return np.asarray(model.predict(samples, model.start, of=name)).reshape(-1, 4, 4)

    return poses


def robot_poses(robot: Robot, data: Dataset) -> standing.Poses:
    """Of frames that an arm's cameras and boards stand on, in the postures of its data."""
    model, samples = robot.error_model, robot.samples(data)

    @lru_cache(None)
    def poses(on: str) -> FloatArray:
        if on == _WORLD:
            return np.tile(np.eye(4), (len(data), 1, 1))
        name = robot.core.frame_name(frame_of(on, robot.joint_count))
        return np.asarray(model.predict(samples, model.start, of=name)).reshape(-1, 4, 4)

    return poses


def _millimetres(T: FloatArray) -> FloatArray:
    return np.asarray(from_si(T[:, :3, 3], "mm"))


def _point_arrows(of: KindErrors, T: FloatArray, read: FloatArray) -> _Arrows:
    """Of points (R, 3) [m] as a frame T (R, 4, 4) reads them."""
    rows = np.flatnonzero(np.isfinite(of.numbers).any(axis=(1, 2)))
    R = T[rows, :3, :3]
    start = np.einsum("rij,rj->ri", R, read[rows]) + T[rows, :3, 3]
    after, before = (
        None if own is None else np.asarray(from_si(np.einsum("rij,rj->ri", R, own[rows, 0]), "mm"))
        for own in (of.numbers, of.numbers_before)
    )
    return _Arrows(rows, np.asarray(from_si(start, "mm")), _given(after), before, is_picture=False)


def _picture_arrows(of: KindErrors, poses: standing.Poses, camera: Spec, board: Spec) -> _Arrows:
    """Of pictures of a board: how far it is off across the view, at the board or, turned round, at the camera."""
    rows = np.flatnonzero(np.isfinite(of.numbers).any(axis=(1, 2)))
    eye, plate = (poses(member["on"])[rows] @ pose(member) for member in (camera, board))
    seen = np.linalg.inv(eye) @ plate
    depth = np.einsum("rj,kj->rk", seen[:, 2, :3], board_corners(board)) + seen[:, 2, 3:4]
    places = [standing.middle_of(poses, member)[rows] for member in (camera, board)]
    moves = [float(np.linalg.norm(np.ptp(at, axis=0))) if len(at) else 0.0 for at in places]
    sign, start = (-1.0, places[0]) if moves[0] > moves[1] else (1.0, places[1])

    def shift(numbers: FloatArray) -> FloatArray:
        flat = np.nanmean(numbers[rows] * (depth[..., np.newaxis] / np.asarray(camera["focal_px"], float)), axis=1)
        return np.asarray(from_si(sign * np.einsum("rij,rj->ri", eye[:, :3, :2], flat), "mm"))

    before = None if of.numbers_before is None else shift(of.numbers_before)
    return _Arrows(rows, start, shift(of.numbers), before, is_picture=True)


def _given(vectors: FloatArray | None) -> FloatArray:
    return np.zeros((0, 3)) if vectors is None else vectors


def _contributions(cell: Cell, before: Cell, readings: Readings, views: Sequence[str]) -> FloatArray:
    """(n,) [mm] of all joints of arms that have geometry, as `contributions` of one arm.

    How far what is read is off, as what reads it sees it, where one joint alone is left as it was; RMS over postures
    and views.
    """
    used = readings.pick(spread_rows(len(readings), _MOST_ROWS))
    now = _seen_points(cell, used, views)
    out = list[float]()
    for arm in cell.arms:
        was = before.arm(arm.name).robot
        for i in range(0 if arm.of_poses else arm.robot.joint_count):
            robot = with_joint_of(arm.robot, was, i)
            arms = tuple(replace(each, robot=robot) if each is arm else each for each in cell.arms)
            away = _seen_points(replace(cell, arms=arms), used, views) - now
            out.append(float(np.sqrt(np.mean(np.sum(away**2, axis=2)))))
    return np.asarray(from_si(np.array(out), "mm"))


def _seen_points(cell: Cell, used: Readings, views: Sequence[str]) -> FloatArray:
    """(V, R, 3) [m] where what is read is, in the axes of what reads it."""
    poses = _cell_poses(cell, used)
    out = []
    for name in views:
        field, _at, view = name.partition("@")
        target, _colon, sensor = view.partition(":")
        if field == CORNERS:
            eye, plate = cell.cameras[sensor], cell.boards[target]
            T = np.linalg.inv(poses(eye["on"]) @ pose(eye)) @ poses(plate["on"]) @ pose(plate)
        else:
            T = np.linalg.inv(poses(sensor or _WORLD)) @ poses(target)
        out.append(T[:, :3, 3])
    return np.stack(out)
