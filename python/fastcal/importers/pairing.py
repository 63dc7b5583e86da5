# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tries the robot on a join: does each point lie where its joints bring the tool, and which belongs to which?

Base and tool are unknown. A stretch of rows whose pairs are right fits the nominal arm to millimetres; one with a slip
misses by the distance between poses. From the stretch that fits best the arm is placed, each point goes to the pose
that explains it, the lists kept in order where they can be, and the geometry is calibrated on what was found, so that
what is judged last is judged to fractions of a millimetre.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.calibrate import align, calibrate
from fastcal.calibration.realign import realign
from fastcal.errors import FastcalError
from fastcal.importers.sequence import matched
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

Pair = tuple[int, int]

FEWEST_ROWS = 10  # base and tool alone adapt to nine numbers
_STRETCH = (8, 20)  # rows of a stretch
_SLIPS = 6  # rows by which a stretch may have slipped, beyond the difference of the counts
_STRETCHES = 12
_HOPELESS = 0.05  # of the reach, RMS; the best stretch of right pairs is far below
_ENOUGH_TO_CALIBRATE = 30  # rows
_GATE = 8.0  # medians of the misfit: beyond is no pair
_FINEST_GATE = 1e-4  # [m]; a pair that is nearer is right for every purpose
_ROUNDS = 4


@dataclass(frozen=True)
class Pairing:
    """Which pose each point was measured at.

    Attributes:
        pairs: (pose, point), in the order of the poses.
        rms: RMS distance of the pairs from the arm [m].
    """

    pairs: list[Pair]
    rms: float


def pair_by_robot(robot: Robot, q: FloatArray, points: FloatArray, expected: Sequence[Pair] | None) -> Pairing | None:
    """Pairs joint positions q (M, n) [rad or m] with points (N, 3) [m]; None where the arm explains no stretch.

    Args:
        robot: The nominal arm; its effects are left out.
        q: In the order in which the poses were visited.
        points: In the order in which they were measured; where names give the order, in that of the poses.
        expected: The pairs as names, times or the order have them; None where counts differ and nothing else decides.
    """
    bare = robot.with_(effects=[])
    start = _start(bare, q, points, expected)
    if start is None:
        return None
    from scipy.spatial.distance import cdist  # takes long to import

    arm, pairs, gate = bare, start[0], max(_GATE * start[1], _HOPELESS * robot.reach)
    for round_ in range(_ROUNDS):
        arm, off = _fitted(bare, q, points, pairs, round_)
        gate = max(_GATE * float(np.median(off)), _FINEST_GATE) if round_ else gate
        distance = cdist(arm.forward(q)[:, :3, 3], points)
        pairs = _assigned(distance, gate, expected)
        if len(pairs) < FEWEST_ROWS:
            return None
    off = np.array([distance[pair] for pair in pairs])
    return Pairing(pairs, float(np.sqrt(np.mean(off**2))))


def _start(
    robot: Robot, q: FloatArray, points: FloatArray, expected: Sequence[Pair] | None
) -> tuple[list[Pair], float] | None:
    """The stretch of pairs that fits the arm best, and its RMS [m]."""
    found: tuple[float, list[Pair]] | None = None
    for pairs in _stretches(len(q), len(points), expected):
        at, to = (np.array(part) for part in zip(*pairs, strict=True))
        fit = align(robot, Dataset.from_arrays(q[at], position=points[to]))
        if fit.found and (found is None or float(fit.rms) < found[0]):
            found = float(fit.rms), pairs
    if found is None or found[0] > _HOPELESS * robot.reach:
        return None
    return found[1], found[0]


def _stretches(poses: int, points: int, expected: Sequence[Pair] | None) -> Iterator[list[Pair]]:
    """Stretches of consecutive rows: as expected, and slipped by a few rows."""
    fewest = min(poses, points)
    length = min(max(_STRETCH[0], fewest // 5), _STRETCH[1], fewest)
    starts = np.unique(np.linspace(0, fewest - length, min(_STRETCHES, fewest - length + 1)).astype(int))
    if expected is not None:
        last = len(expected) - length
        yield from (list(expected[max(0, min(start, last)) :][:length]) for start in starts)
    slips = range(-_SLIPS - max(0, points - poses), _SLIPS + max(0, poses - points) + 1)
    for start in starts:
        for slip in slips:
            if (slip or expected is None) and 0 <= start + slip <= poses - length:
                yield [(int(start) + slip + k, int(start) + k) for k in range(length)]


def _fitted(
    robot: Robot, q: FloatArray, points: FloatArray, pairs: list[Pair], round_: int
) -> tuple[Robot, FloatArray]:
    """The arm on the pairs, placed or (in later rounds, of enough of them) calibrated; and its misfits (K,) [m]."""
    at, to = (np.array(part) for part in zip(*pairs, strict=True))
    data = Dataset.from_arrays(q[at], position=points[to])
    arm = realign(robot, data)
    off = np.linalg.norm(arm.forward(q[at])[:, :3, 3] - points[to], axis=1)
    near = off <= max(4 * float(np.median(off)), _FINEST_GATE)
    if near.sum() >= FEWEST_ROWS and not near.all():
        arm = realign(robot, data.select(near))
    if round_ > 1 and near.sum() >= _ENOUGH_TO_CALIBRATE:
        try:
            result = calibrate(robot, data.select(near), loss="tukey")
        except FastcalError:
            result = None
        if result is not None and result.status == "converged":
            arm = result.model
    return arm, np.linalg.norm(arm.forward(q[at])[:, :3, 3] - points[to], axis=1)


def _assigned(distance: FloatArray, gate: float, expected: Sequence[Pair] | None) -> list[Pair]:
    """Pairs within the gate: those expected, else in the same order, and of what is left those that fit anyhow."""
    if expected is not None:
        kept = [pair for pair in expected if distance[pair] <= gate]
        if len(kept) == len(expected):
            return kept
    pairs = matched(distance, gate)
    if expected is not None:
        # Names or the order hold where the arm agrees as well.
        wanted = dict(expected)
        better = [
            (i, wanted[i])
            for i, j in pairs
            if i in wanted and j != wanted[i] and distance[i, wanted[i]] <= gate / _GATE
        ]
        taken = {j for _, j in better}
        moved = {i for i, _ in better}
        pairs = sorted([*((i, j) for i, j in pairs if i not in moved and j not in taken), *better])
    left = sorted({*range(len(distance))} - {i for i, _ in pairs})
    free = sorted({*range(distance.shape[1])} - {j for _, j in pairs})
    if left and free:
        from scipy.optimize import linear_sum_assignment  # takes long to import

        rest = np.minimum(distance[np.ix_(left, free)], 2 * gate)
        pairs += [(left[i], free[j]) for i, j in zip(*linear_sum_assignment(rest), strict=True) if rest[i, j] <= gate]
    return sorted(pairs)
