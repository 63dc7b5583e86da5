# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arm as a skeleton: where its frames are in each measured posture, and what each joint contributes at the tool."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.report.language import _
from fastcal.report.view import Rows
from fastcal.robot.controller_robot import GEOMETRY
from fastcal.robot.robot import Robot
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.calibration.evaluation import Evaluation
    from fastcal.measurements.dataset import Dataset

Array = NDArray[np.float64]

_APART = 0.5  # [mm] frames that are nearer than this in every posture are drawn as one point
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
    """

    points: Array
    joints: list[int]
    contributions: Array | None
    rows: list[tuple[int, int]]
    labels: list[str]

    def pick(self, chosen: NDArray[np.intp]) -> Arm:
        """Some of the postures."""
        return Arm(
            self.points[chosen],
            self.joints,
            self.contributions,
            [self.rows[k] for k in chosen],
            [self.labels[k] for k in chosen],
        )


def arm_of(model: Robot, before: Robot, sets: Sequence[tuple[Rows | None, Evaluation | None]]) -> Arm | None:
    """The arm in the postures that arrows are drawn for, set after set; None where there are none.

    Args:
        model: As it is now.
        before: As it was: joints are judged by what became of them.
        sets: Rows and the evaluation that they are of, training first; None where there are none.
    """
    q, numbers, labels = [], [], []
    for k, (rows, of) in enumerate(sets):
        if rows is None or of is None:
            continue
        places = np.flatnonzero(rows.with_arrows)
        q.append(of.data.q[places])
        numbers += [(k, int(row)) for row in rows.numbers[places]]
        labels += [_("{set}, row {row}", set=rows.name, row=int(row)) for row in rows.numbers[places]]
    if not numbers:
        return None
    points, joints = skeleton(model, np.vstack(q))
    judged = next(of for _rows, of in sets if of is not None)
    return Arm(points, joints, contributions(model, before, judged.data), numbers, labels)


def skeleton(robot: Robot, q: Array) -> tuple[Array, list[int]]:
    """Points (R, P, 3) [mm] of the chain at q (R, n), those that lie on each other once, and those of the joints."""
    frames = np.asarray(from_si(np.asarray(robot.core.frame_origins(np.ascontiguousarray(q))), "mm"))
    kept, place = [0], [0]
    for f in range(1, frames.shape[1]):
        if np.linalg.norm(frames[:, f] - frames[:, kept[-1]], axis=1).max() > _APART:
            kept.append(f)
        place.append(len(kept) - 1)
    return frames[:, kept], [place[2 * i + 1] for i in range(robot.joint_count)]


def contributions(model: Robot, before: Robot, data: Dataset) -> Array | None:
    """(n,) [mm] how far the tool is off (RMS over rows) where one joint alone is left as it was.

    Joint i then has the geometry that it had `before`, and no effect that is of it or of its link. None where the two
    robots are written in different kinematics.
    """
    if model.kinematics != before.kinematics or model.joint_types != before.joint_types:
        return None
    rows = data.select(np.unique(np.linspace(0, len(data) - 1, min(len(data), _MOST_ROWS)).astype(np.intp)))
    now = model.poses(rows)[:, :3, 3]
    out = []
    for i, was in enumerate(before.spec["joints"]):
        joints = list(model.spec["joints"])
        joints[i] = joints[i] | {key: was[key] for key in GEOMETRY if key in was}
        own = (f"joint{i + 1}", f"link{i + 1}")
        effects = [entry for entry in model.spec.get("effects") or [] if entry["owner"] not in own]
        without = Robot({**model.spec, "joints": joints, "effects": effects})
        away = without.poses(rows)[:, :3, 3] - now
        out.append(float(np.sqrt(np.mean(np.sum(away**2, axis=1)))))
    return np.asarray(from_si(np.array(out), "mm"))
