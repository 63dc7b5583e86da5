# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arm as a skeleton: where its frames are in each measured posture, and what each joint contributes at the tool."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.measurements.kinds import POINTS
from fastcal.place import joint_name
from fastcal.report.figures import spread_rows
from fastcal.report.language import _
from fastcal.report.view import Rows, Variable
from fastcal.robot.controller_robot import GEOMETRY
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance
    from fastcal.calibration.evaluation import Evaluation
    from fastcal.measurements.dataset import Dataset
    from fastcal.monitoring.compare import Comparison
    from fastcal.monitoring.result import CheckResult
    from fastcal.report.parameter_sizes import Moved


_APART = 0.5  # [mm] frames that are nearer than this in every posture are drawn as one point
_MOST_COMPARED = 200  # postures of a comparison
_MOST_ROWS = 500  # that contributions are found from


@dataclass(frozen=True, eq=False)
class Arm:
    """The arm in R postures, for a figure.

    Attributes:
        points: (R, P, 3) [mm] from the base along the chain to the tool, in the measuring frame.
        joints: (n,) which of the points each joint turns or slides at.
        contributions: (n,) [mm] at the tool, see `contributions`; None where there is nothing to compare.
        rows: Of each posture its set and its row in that set's file.
        labels: The same in words.
        variables: What postures can be chosen by, a value a posture.
        stations: Names of the values of the variable `station`.
    """

    points: FloatArray
    joints: list[int]
    contributions: FloatArray | None
    rows: list[tuple[int, int]]
    labels: list[str]
    variables: list[Variable] = field(default_factory=list)
    stations: tuple[str, ...] = ()

    def pick(self, chosen: NDArray[np.intp]) -> Arm:
        """Some of the postures."""
        return Arm(
            self.points[chosen],
            self.joints,
            self.contributions,
            [self.rows[k] for k in chosen],
            [self.labels[k] for k in chosen],
            [replace(variable, values=variable.values[chosen]) for variable in self.variables],
            self.stations,
        )


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
    points, joints = skeleton(model, np.vstack(q))
    judged = next(of for _rows, of in sets if of is not None)
    stations = next((of.data.station_names for _rows, of in sets if of is not None), ())
    contributed = contributions(model, before, judged.data)
    return Arm(points, joints, contributed, numbers, labels, _variables(drawn), stations)


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


def checked_arm(found: CheckResult) -> tuple[FloatArray, FloatArray, Arm] | None:
    """Measured points and errors (R, 3) [mm] of a check, and the arm there; None where no whole point was measured.

    A joint's contribution is how far its changes move the tool, each as found alone, root of their squares' sum.
    """
    if found.main.kind.name != POINTS:
        return None
    errors = found.main.errors.numbers.reshape(len(found.data), -1)[:, :3]
    kept = np.flatnonzero(np.isfinite(errors).all(axis=1) & np.isfinite(found.data.points).all(axis=1))
    if len(kept) == 0:
        return None
    model, q = found.model, found.data.q[kept]
    points, joints = skeleton(model, q)
    J = np.asarray(model.joint_jacobian(q))[:, :3]
    square = np.zeros(model.joint_count)
    for change in found.changed:
        for i in range(model.joint_count):
            if change.owner == joint_name(i) and change.unit in ("deg", "mm"):
                moved = J[:, :, i] * to_si(change.change, change.unit)
                square[i] += np.mean(np.sum(moved**2, axis=1))
    contributed = np.asarray(from_si(np.sqrt(square), "mm")) if square.any() else None
    labels = [_("row {row}", row=int(row)) for row in kept]
    arm = Arm(points, joints, contributed, [(0, int(row)) for row in kept], labels)
    return np.asarray(from_si(found.data.points[kept], "mm")), np.asarray(from_si(errors[kept], "mm")), arm


def compared_arm(found: Comparison, moved: Sequence[Moved]) -> tuple[FloatArray, FloatArray, Arm]:
    """Points of the first model, the way to the second's (R, 3) [mm] and the arm there, in the first one's base.

    A joint's contribution is how far its significant differences move the tool, root of their squares' sum.
    """
    chosen = spread_rows(len(found.q), _MOST_COMPARED)
    model = found.first
    points, joints = skeleton(model, found.q[chosen])
    T = np.asarray(model.core.base_and_tool(model.core.nominal)[0])
    points = (points - from_si(T[:3, 3], "mm")) @ T[:3, :3]
    square = np.zeros(model.joint_count)
    for m in moved:
        for i in range(model.joint_count):
            if m.parameter.owner == joint_name(i) and m.is_significant:
                square[i] += m.size**2
    contributed = np.sqrt(square) if square.any() else None
    labels = [_("posture {number}", number=int(k) + 1) for k in chosen]
    arm = Arm(points, joints, contributed, [(0, int(k)) for k in chosen], labels)
    return np.asarray(from_si(found.points[chosen], "mm")), np.asarray(from_si(found.apart[chosen], "mm")), arm


def accepted_arm(found: Acceptance) -> tuple[FloatArray, FloatArray, Arm]:
    """Commanded points, the mean of what was attained less them (K, 3) [mm], and the arm there, in its base."""
    model, test = found.model, found.campaign
    q = np.array([test.data.q[station.rows[0]] for station in test.stations])
    points, joints = skeleton(model, q)
    T = np.asarray(model.core.base_and_tool(model.core.nominal)[0])
    points = (points - from_si(T[:3, 3], "mm")) @ T[:3, :3]
    off = np.array([test.errors(k).mean(axis=0) for k in range(len(test.stations))])
    labels = [f"{station.pose} {station.direction}".strip() for station in test.stations]
    arm = Arm(points, joints, None, [(0, k) for k in range(len(labels))], labels)
    return np.asarray(from_si(test.commanded, "mm")), np.asarray(from_si(off, "mm")), arm


def skeleton(robot: Robot, q: FloatArray) -> tuple[FloatArray, list[int]]:
    """Points (R, P, 3) [mm] of the chain at q (R, n), those that lie on each other once, and those of the joints."""
    frames = np.asarray(from_si(np.asarray(robot.core.frame_origins(np.ascontiguousarray(q))), "mm"))
    kept, place = [0], [0]
    for f in range(1, frames.shape[1]):
        if np.linalg.norm(frames[:, f] - frames[:, kept[-1]], axis=1).max() > _APART:
            kept.append(f)
        place.append(len(kept) - 1)
    return frames[:, kept], [place[2 * i + 1] for i in range(robot.joint_count)]


def contributions(model: Robot, before: Robot, data: Dataset) -> FloatArray | None:
    """(n,) [mm] how far the tool is off (RMS over rows) where one joint alone is left as it was.

    Joint i then has the geometry that it had `before`, and no effect that is of it or of its link. None where the two
    robots are written in different kinematics.
    """
    if model.kinematics != before.kinematics or model.joint_types != before.joint_types:
        return None
    rows = data.select(np.unique(np.linspace(0, len(data) - 1, min(len(data), _MOST_ROWS)).astype(np.intp)))
    now = model.poses(rows)[:, :3, 3]
    out = []
    for i, was in enumerate(before.joints):
        joints = list(model.joints)
        joints[i] = replace(joints[i], **{key: getattr(was, key) for key in GEOMETRY})
        own = (joint_name(i), f"link{i + 1}")
        effects = [entry for entry in model.entries if entry["owner"] not in own]
        without = model.with_(joints=joints, effects=effects)
        away = without.poses(rows)[:, :3, 3] - now
        out.append(float(np.sqrt(np.mean(np.sum(away**2, axis=1)))))
    return np.asarray(from_si(np.array(out), "mm"))
