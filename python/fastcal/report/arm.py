# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arm as a skeleton: where its frames are in each measured posture, and what each joint contributes at the tool.

Frames are a tree: each is drawn from the one that it stands on, so arms that branch, closed loops and cells of several
arms are drawn as one arm is. What else stands there, cameras and boards, goes through points of its own.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IndexArray
from fastcal.measurements.kinds import POINTS
from fastcal.place import joint_name
from fastcal.report.figures import spread_rows
from fastcal.report.language import _
from fastcal.report.view import Rows, Variable
from fastcal.robot.controller_robot import GEOMETRY
from fastcal.robot.loops import joints_beside, loop_pins
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance
    from fastcal.calibration.evaluation import Evaluation
    from fastcal.cells.cell import Cell
    from fastcal.measurements.dataset import Dataset
    from fastcal.monitoring.compare import Comparison
    from fastcal.monitoring.result import CheckResult
    from fastcal.report.parameter_sizes import Moved


_APART = 0.5  # [mm] frames that are nearer than this in every posture are drawn as one point
_MOST_COMPARED = 200  # postures of a comparison
_MOST_ROWS = 500  # that contributions are found from
LINK, LINK_WIDTH = "#5f7180", 12
_THIN = 4
GAP = -1  # where a line is lifted, among the points that it goes through


@dataclass(frozen=True)
class Run:
    """A line through points of an arm, or marks on them.

    Attributes:
        through: Places of the points; GAP: the line is lifted.
        colour: Of all of it.
        width: Of the line; 0: marks.
        names: Of marks, written beside them.
        symbol: Of marks.
    """

    through: list[int]
    colour: str = LINK
    width: int = LINK_WIDTH
    names: tuple[str, ...] = ()
    symbol: str = "diamond"


@dataclass(frozen=True, eq=False)
class Arm:
    """The arm, or all that stands in a cell, in R postures, for a figure.

    Attributes:
        points: (R, P, 3) [mm] in the measuring frame: of one arm from the base along the chain to the tool; NaN where
            something is not seen in a posture.
        runs: What is drawn through them.
        joints: (n,) which of the points each joint turns or slides at.
        names: (n,) of the joints, in words.
        contributions: (n,) [mm] at the tool, see `contributions`; None where there is nothing to compare.
        rows: Of each posture its set and its row in that set's file.
        labels: The same in words.
        measured: Which of the points were measured.
        variables: What postures can be chosen by, a value a posture.
        stations: Names of the values of the variable `station`.
    """

    points: FloatArray
    runs: list[Run]
    joints: list[int]
    names: list[str]
    contributions: FloatArray | None
    rows: list[tuple[int, int]]
    labels: list[str]
    measured: list[int] = field(default_factory=list)
    variables: list[Variable] = field(default_factory=list)
    stations: tuple[str, ...] = ()

    def pick(self, chosen: NDArray[np.intp]) -> Arm:
        """Some of the postures."""
        return replace(
            self,
            points=self.points[chosen],
            rows=[self.rows[k] for k in chosen],
            labels=[self.labels[k] for k in chosen],
            variables=[replace(variable, values=variable.values[chosen]) for variable in self.variables],
        )

    def with_measured(self, positions: FloatArray) -> Arm:
        """With the point (R, 3) [mm] that was measured in each posture."""
        place = self.points.shape[1]
        points = np.concatenate([self.points, positions[:, np.newaxis]], axis=1)
        return replace(self, points=points, measured=[*self.measured, place])


def arm_of(model: Robot, before: Robot, sets: Sequence[tuple[Rows | None, Evaluation | None]]) -> Arm | None:
    """The arm in the postures that arrows are drawn for, set after set; None where there are none.

    Args:
        model: As it is now.
        before: As it was: joints are judged by what became of them.
        sets: Rows and the evaluation that they are of, training first; None where there are none.
    """
    q, numbers, labels = [], [], []
    drawn = []
    for k, (rows, of) in enumerate(sets):
        if rows is None or of is None:
            continue
        places = np.flatnonzero(rows.with_arrows)
        drawn.append((rows, of, places))
        q.append(of.data.q[places])
        numbers += [(k, int(row)) for row in rows.numbers[places]]
        labels += [_("{set}, row {row}", set=rows.name, row=int(row)) for row in rows.numbers[places]]
    if not numbers:
        return None
    judged = next(of for _rows, of in sets if of is not None)
    stations = next((of.data.station_names for _rows, of in sets if of is not None), ())
    contributed = contributions(model, before, judged.data)
    arm = posed(model, np.vstack(q), contributed, numbers, labels)
    return replace(arm, variables=_variables(drawn), stations=stations)


def _variables(drawn: Sequence[tuple[Rows, Evaluation, NDArray[np.intp]]]) -> list[Variable]:
    """What differs between the rows that are drawn of each set; stations where all sets have the same."""
    found = []
    for variable in drawn[0][0].variables:
        own = [{each.name: each.values for each in (*rows.joints, *rows.conditions)} for rows, _of, _places in drawn]
        parts = [
            values[variable.name][places] if variable.name in values else np.full(len(places), np.nan)
            for values, (_rows, _of, places) in zip(own, drawn, strict=True)
        ]
        found.append(replace(variable, values=np.concatenate(parts)))
    codes = [(of.data.station, of.data.station_names, places) for _rows, of, places in drawn]
    if len(codes[0][1]) > 1 and all(names == codes[0][1] for _codes, names, _places in codes):
        values = np.concatenate([np.asarray(station, float)[places] for station, _names, places in codes])
        found.append(Variable("station", _("station"), "", values))
    return found


def checked_arm(found: CheckResult, *, beside: bool = True) -> tuple[FloatArray, FloatArray, Arm] | None:
    """Measured points and errors (R, 3) [mm] of a check, and the arm there; None where no whole point was measured.

    A joint's contribution is how far its changes move the tool, each as found alone, root of their squares' sum.
    `beside`: with what of the arm does not move the tool, such as another arm on the same torso.
    """
    if found.main.kind.name != POINTS:
        return None
    errors = found.main.errors.numbers.reshape(len(found.data), -1)[:, :3]
    kept = np.flatnonzero(np.isfinite(errors).all(axis=1) & np.isfinite(found.data.points).all(axis=1))
    if len(kept) == 0:
        return None
    model, q = found.model, found.data.q[kept]
    J = np.asarray(model.joint_jacobian(q))[:, :3]
    square = np.zeros(model.joint_count)
    for change in found.changed:
        for i in range(model.joint_count):
            if change.owner == joint_name(i) and change.unit in ("deg", "mm"):
                moved = J[:, :, i] * to_si(change.change, change.unit)
                square[i] += np.mean(np.sum(moved**2, axis=1))
    contributed = np.asarray(from_si(np.sqrt(square), "mm")) if square.any() else None
    labels = [_("row {row}", row=int(row)) for row in kept]
    arm = posed(model, q, contributed, [(0, int(row)) for row in kept], labels)
    arm = arm if beside else _without_beside(arm, model, q)
    return np.asarray(from_si(found.data.points[kept], "mm")), np.asarray(from_si(errors[kept], "mm")), arm


def compared_arm(found: Comparison, moved: Sequence[Moved]) -> tuple[FloatArray, FloatArray, Arm]:
    """Points of the first model, the way to the second's (R, 3) [mm] and the arm there, in the first one's base.

    A joint's contribution is how far its significant differences move the tool, root of their squares' sum.
    """
    chosen = spread_rows(len(found.q), _MOST_COMPARED)
    model = found.first
    square = np.zeros(model.joint_count)
    for m in moved:
        for i in range(model.joint_count):
            if m.parameter.owner == joint_name(i) and m.is_significant:
                square[i] += m.size**2
    contributed = np.sqrt(square) if square.any() else None
    labels = [_("posture {number}", number=int(k) + 1) for k in chosen]
    arm = in_base(posed(model, found.q[chosen], contributed, [(0, int(k)) for k in chosen], labels), model)
    return np.asarray(from_si(found.points[chosen], "mm")), np.asarray(from_si(found.apart[chosen], "mm")), arm


def accepted_arm(found: Acceptance) -> tuple[FloatArray, FloatArray, Arm]:
    """Commanded points, the mean of what was attained less them (K, 3) [mm], and the arm there, in its base."""
    model, test = found.model, found.campaign
    q = np.array([test.data.q[station.rows[0]] for station in test.stations])
    off = np.array([test.errors(k).mean(axis=0) for k in range(len(test.stations))])
    labels = [f"{station.pose} {station.direction}".strip() for station in test.stations]
    arm = in_base(posed(model, q, None, [(0, k) for k in range(len(labels))], labels), model)
    return np.asarray(from_si(test.commanded, "mm")), np.asarray(from_si(off, "mm")), arm


def joined_arms(
    parts: Sequence[tuple[FloatArray, FloatArray, Arm]],
) -> tuple[FloatArray, FloatArray, Arm, IndexArray]:
    """Points, errors (K, 3) [mm], arms as one figure, and the posture of each point, of several ways as `checked_arm`.

    A posture is a row of the file, in which each way that was read then stands; arms that ways share are drawn of each.
    """
    rows = sorted({row for _points, _errors, arm in parts for _set, row in arm.rows})
    place = {row: k for k, row in enumerate(rows)}
    whole = Arm(np.zeros((len(rows), 0, 3)), [], [], [], None, [(0, row) for row in rows], [])
    of = []
    for points, _errors, arm in parts:
        at = np.array([place[row] for _set, row in arm.rows])
        own = np.full((len(rows), arm.points.shape[1] + 1, 3), np.nan)
        own[at] = np.concatenate([arm.points, points[:, np.newaxis]], axis=1)
        first = whole.points.shape[1]
        runs = [replace(run, through=[k + first if k >= 0 else GAP for k in run.through]) for run in arm.runs]
        whole = replace(
            whole,
            points=np.concatenate([whole.points, own], axis=1),
            runs=[*whole.runs, *runs],
            joints=[*whole.joints, *(k + first for k in arm.joints)],
            names=[*whole.names, *arm.names],
            measured=[*whole.measured, first + own.shape[1] - 1],
        )
        of.append(at)
    known = [arm.contributions for _points, _errors, arm in parts]
    if any(sizes is not None for sizes in known):
        all_sizes = [
            np.zeros(len(arm.joints)) if arm.contributions is None else arm.contributions for *_of, arm in parts
        ]
        whole = replace(whole, contributions=np.concatenate(all_sizes))
    labels = [_("row {row}", row=row) for row in rows]
    positions = np.vstack([points for points, _errors, _arm in parts])
    errors = np.vstack([errors for _points, errors, _arm in parts])
    return positions, errors, replace(whole, labels=labels), np.concatenate(of)


def _without_beside(arm: Arm, model: Robot, q: FloatArray) -> Arm:
    """The arm without the joints that do not move its tool."""
    away = set(joints_beside(model.description))
    kept = [i for i in range(model.joint_count) if i not in away]
    place = frame_points(model, q)[1]
    frames = {0, len(place) - 1, *(f for i in kept for f in (2 * i + 1, 2 * i + 2))}
    return replace(
        arm,
        runs=[Run(line_through(model, place, frames))] if away else arm.runs,
        joints=[arm.joints[i] for i in kept],
        names=[arm.names[i] for i in kept],
        contributions=None if arm.contributions is None else arm.contributions[kept],
    )


def in_base(arm: Arm, model: Robot) -> Arm:
    """The arm in the axes of its base."""
    T = np.asarray(model.core.base_and_tool(model.core.nominal)[0])
    return replace(arm, points=(arm.points - from_si(T[:3, 3], "mm")) @ T[:3, :3])


def posed(
    robot: Robot,
    q: FloatArray,
    contributed: FloatArray | None,
    rows: Sequence[tuple[int, int]],
    labels: Sequence[str],
) -> Arm:
    """A robot at q (R, n), with what its joints contribute (n,) [mm] and what its postures are called.

    Of an arm whose joints stand for the pose of its flange only base and flange are known.
    """
    points, joints, through = skeleton(robot, q)
    if robot.of_poses:
        return Arm(
            points,
            [Run([through[0], through[-1]], width=_THIN)] if through else [],
            [],
            [],
            None,
            list(rows),
            list(labels),
        )
    names = [_("joint {number}", number=i + 1) for i in range(len(joints))]
    return Arm(points, [Run(through)], joints, names, contributed, list(rows), list(labels))


def skeleton(robot: Robot, q: FloatArray) -> tuple[FloatArray, list[int], list[int]]:
    """Points (R, P, 3) [mm] of a robot at q (R, n), which are its joints', and the line through them.

    A loop is drawn from the one frame to its pin or ball there, to the other one's, to the other frame.
    """
    points, place = frame_points(robot, q)
    joints, through = [place[2 * i + 1] for i in range(robot.joint_count)], line_through(robot, place)
    for start, end, pins in loop_pins(robot.core, robot.description, q):
        first = points.shape[1]
        through += [GAP, place[start], first, first + 1, place[end]]
        points = np.concatenate([points, from_si(pins, "mm")], axis=1)
    return points, joints, through


def through_points(points: FloatArray, through: Sequence[int]) -> FloatArray:
    """Points (K, 3) of (P, 3) that a line goes through, NaN where it is lifted."""
    places = np.asarray(through, dtype=np.intp)
    return np.where(places[:, np.newaxis] < 0, np.nan, points[places])


def frame_points(tree: Robot | Cell, q: FloatArray) -> tuple[FloatArray, list[int]]:
    """Points (R, P, 3) [mm] of the frames of a robot or cell at q (R, n), and the point of each frame.

    A frame that is always where the one is that it stands on has its point.
    """
    core = tree.core
    origins = np.asarray(from_si(np.asarray(core.frame_origins(np.ascontiguousarray(q))), "mm"))
    kept, place = list[int](), list[int]()
    for f, parent in enumerate(core.parents):
        on = None if parent < 0 else kept[place[parent]]
        if on is None or np.linalg.norm(origins[:, f] - origins[:, on], axis=1).max(initial=0.0) > _APART:
            kept.append(f)
            place.append(len(kept) - 1)
        else:
            place.append(place[parent])
    return origins[:, kept], place


def line_through(tree: Robot | Cell, place: Sequence[int], frames: Collection[int] | None = None) -> list[int]:
    """The points that a line goes through which draws each frame, or each of some, from the one that it stands on."""
    out = list[int]()
    for f, parent in enumerate(tree.core.parents):
        if parent < 0 or place[f] == place[parent] or (frames is not None and f not in frames):
            continue
        if not out or out[-1] != place[parent]:
            out += [*([GAP] if out else []), place[parent]]
        out.append(place[f])
    return out


def contributions(model: Robot, before: Robot, data: Dataset) -> FloatArray | None:
    """(n,) [mm] how far the tool is off (RMS over rows) where one joint alone is left as it was.

    Joint i then has the geometry that it had `before`, and no effect that is of it or of its link. None where the two
    robots are written in different kinematics.
    """
    if model.kinematics != before.kinematics or model.joint_types != before.joint_types:
        return None
    rows = data.select(spread_rows(len(data), _MOST_ROWS))
    now = model.poses(rows)[:, :3, 3]
    out = []
    for i in range(model.joint_count):
        away = with_joint_of(model, before, i).poses(rows)[:, :3, 3] - now
        out.append(float(np.sqrt(np.mean(np.sum(away**2, axis=1)))))
    return np.asarray(from_si(np.array(out), "mm"))


def with_joint_of(model: Robot, before: Robot, index: int) -> Robot:
    """The model, one joint (from 0) with the geometry that it had `before` and without effects of it and its link."""
    joints = list(model.joints)
    joints[index] = replace(joints[index], **{key: getattr(before.joints[index], key) for key in GEOMETRY})
    own = (joint_name(index), f"link{index + 1}")
    return model.with_(joints=joints, effects=[entry for entry in model.entries if entry["owner"] not in own])
