# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How far the tool is from its path between the points of a program, without and with compensation.

Only the points are compensated; between them the controller drives lines or arcs of its nominal robot. So the error
between them is not zero, and shows how close points must be. ISO 9283 calls the largest distance of the attained from
the commanded path, square to it, the path accuracy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.arrays import FloatArray
from fastcal.compensation.commands import compensate
from fastcal.compensation.curves import arc, between
from fastcal.compensation.following import follow
from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.errors import InvalidInput
from fastcal.measurements.targets import Targets, targets_of
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


KINDS = ("line", "arc")
_ROUNDING = 1e-9  # of a step: ten of them that were written and read again are ten still


@dataclass(frozen=True, eq=False, repr=False)
class PathAccuracy(Shown):
    """A path of M poses; SI.

    Attributes:
        poses: (M, 4, 4) where the tool is to be.
        along: (M,) length of the path up to there.
        points: (K,) which of them are the targets, compensated and driven to.
        before, after: (M,) distance of the tool from its place, without and with compensation.
        off_before, off_after: (M,) the part of it square to the path.
        sigma: (M,) standard deviation of a coordinate [m] of what the model predicts with compensation, the root mean
            square of three; NaN for a robot that was not calibrated.
    """

    poses: FloatArray
    along: FloatArray
    points: NDArray[np.int64]
    before: FloatArray
    after: FloatArray
    off_before: FloatArray
    off_after: FloatArray
    sigma: FloatArray

    def plot_path(self) -> Figure:
        """Error of the tool along the path, without and with compensation."""
        return late.call("chart", self, "path")


def path_accuracy(
    model: Robot,
    targets: ArrayLike | Targets,
    seed: ArrayLike | None = None,
    *,
    kind: str = "line",
    step: float = 0.005,
    real: Robot | None = None,
    nominal: Robot | None = None,
    threads: int = 1,
    **conditions: Any,
) -> PathAccuracy:
    """Drives through targets on lines or arcs and looks where the tool is.

    Args:
        model: A calibrated robot; it gives the compensation.
        targets: (K, 4, 4) poses; of arcs every second one is a point that the arc passes through, so K is odd.
        seed: (n,) for the first row or (K, n).
        kind: `line` or `arc`.
        step: Distance of two poses looked at [m], at most.
        real: The robot that drives; None: the model itself.
        nominal: What the controller believes; None: what the model keeps of it.
        threads: Cores; the result does not depend on it.
        **conditions: As in `compensate`; a pose between two targets has those of the second.

    Raises:
        InvalidInput: A target or the way between two can't be reached, or three points of an arc lie on a line.
    """
    if not isinstance(targets, Targets):
        targets = targets_of(targets, seed, model.joint_count, conditions)
    count = len(targets)
    if kind not in KINDS or count < 2 or (kind == "arc" and count % 2 == 0):
        needed = "an odd number of at least 3 targets" if kind == "arc" else "at least 2 targets"
        raise InvalidInput(f"a path is a line or an arc, with {needed}; got {kind} with {count}")
    if not step > 0:
        raise InvalidInput(f"step must be above 0, got {step}")
    found = compensate(model, targets, nominal=nominal, threads=threads)
    if not found.reached.all():
        row = int(np.argmin(found.reached))
        raise InvalidInput(f"row {row} of the path is {found.status[row]}; expected targets that can all be reached")
    targets = replace(targets, conditions=found.conditions)  # with how the joints come to each
    before = nominal_robot(model, nominal)
    counts = _counts(targets.poses, kind, step)
    wanted = _drive(targets.poses, kind, counts)
    segment = np.repeat(np.arange(1, count), counts)
    rows = np.concatenate([[0], segment])
    tool = model if real is None else real
    errors = []
    for poses, start in ((wanted, found.nominal_q[0]), (_drive(before.forward(found.q), kind, counts), found.q[0])):
        q, reached, _ = follow(before, targets_of(poses, start, model.joint_count, {}), threads=threads)
        if not reached.all():
            raise InvalidInput(f"the path to row {int(rows[np.argmin(reached)])} leaves the nominal robot's workspace")
        got = tool.forward(q, threads=threads, **targets.conditions_of(rows))
        sigma = np.sqrt(np.mean(model.position_deviation(q, **targets.conditions_of(rows)) ** 2, axis=1))
        errors.append(got[:, :3, 3] - wanted[:, :3, 3])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(wanted[:, :3, 3], axis=0), axis=1))])
    t = np.gradient(wanted[:, :3, 3], axis=0)
    t /= np.maximum(np.linalg.norm(t, axis=1, keepdims=True), np.finfo(float).tiny)
    off = [np.linalg.norm(e - np.sum(e * t, axis=1, keepdims=True) * t, axis=1) for e in errors]
    size = [np.linalg.norm(e, axis=1) for e in errors]
    points = np.concatenate([[0], np.cumsum(counts)])
    return PathAccuracy(wanted, along, points, size[0], size[1], off[0], off[1], sigma)


def _counts(poses: FloatArray, kind: str, step: float) -> NDArray[np.int64]:
    """(K - 1,) poses to look at from each target to the next; the two halves of an arc share theirs by their chords."""
    chords = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    lengths = chords * (math.pi / 2 if kind == "arc" else 1.0)  # the half circle is the longest between two chords
    return np.asarray(np.maximum(np.ceil(lengths / step - _ROUNDING), 2), dtype=np.int64)


def _drive(corners: FloatArray, kind: str, counts: NDArray[np.int64]) -> FloatArray:
    """(1 + sum of counts, 4, 4) poses of a controller that drives through its corners."""
    parts = [corners[:1]]
    if kind == "line":
        parts += [between(a, b, int(n)) for (a, b), n in zip(pairwise(corners), counts, strict=True)]
    else:
        for i in range(0, len(corners) - 2, 2):
            parts.append(arc(corners[i], corners[i + 1], corners[i + 2], (int(counts[i]), int(counts[i + 1]))))
    return np.concatenate(parts)
