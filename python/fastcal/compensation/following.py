# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One configuration along a path: each row's joints from those of the row before, so that nothing jumps.

A row far from the one before is reached through poses between the two, on the straight line and the least turn; where
that way leaves the workspace, the row is searched on its own and noted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.compensation.curves import between
from fastcal.ik.inverse_kinematics import InverseKinematics, inverse_kinematics
from fastcal.measurements.targets import Targets
from fastcal.robot.robot import Robot

NEAR = 0.2  # rad, or reaches: a row that a joint needs to move by less for can't be in another configuration
_STEP = 0.1  # of the same, between two poses on the way
_MOST_STEPS = 60
_BLOCK = 64  # rows that are followed at once, at most: twice as many after each success, one after a failure


def follow(
    robot: Robot, targets: Targets, hold: Sequence[int] = (), threads: int = 1
) -> tuple[FloatArray, NDArray[np.bool_], list[int]]:
    """Joint positions (N, n) of a path, whether each reaches its pose (N), and the rows at which they jump.

    Rows with a seed of their own begin there instead. Joints in `hold`, from 1, stay where the first row has them.
    `robot` is taken without conditions: it is the nominal one.
    """
    count = len(targets)
    q = np.full((count, robot.joint_count), np.nan)
    reached = np.zeros(count, dtype=bool)
    jumps: list[int] = []
    own = targets.seeded
    last = -1  # the last row that was reached
    row, size = 0, _BLOCK
    while row < count:
        if own[row] or last < 0:
            seed = targets.seed[row] if own[row] and targets.seed is not None else None
            found = inverse_kinematics(robot, targets.poses[row], seed=seed, hold=hold, threads=threads)
            q[row], reached[row] = found.q[0], found.reached[0]
        else:
            block = slice(row, min(row + size, count))
            done = _follow_block(robot, targets.poses[block], q[last], own[block], hold)
            if len(done):
                rows = slice(row, row + len(done))
                q[rows], reached[rows] = done, True
                row, last = rows.stop, rows.stop - 1
                size = min(2 * size, _BLOCK) if rows == block else 1
                continue
            size = 1
            q[row], reached[row], smooth = _across(robot, targets.poses[last], targets.poses[row], q[last], hold)
            if reached[row] and not smooth:
                jumps.append(row)
        last = row if reached[row] else last
        row += 1
    return q, reached, jumps


def _follow_block(
    robot: Robot, poses: FloatArray, start: FloatArray, own: NDArray[np.bool_], hold: Sequence[int]
) -> FloatArray:
    """The leading rows that are reached in small steps from `start`."""
    stop = int(np.argmax(own)) if own.any() else len(poses)
    # The row before is the first of a path, so that no row begins anywhere else.
    before = robot.forward(start)
    path = np.concatenate([before, poses[:stop]])
    found = inverse_kinematics(robot, path, seed=start, hold=hold, along_path=True, restarts=0)
    steps = [_moved(robot, a, b) for a, b in pairwise(found.q)]
    good = found.reached[1:] & (np.array(steps) < NEAR)
    return found.q[1:][: int(np.argmin(good)) if not good.all() else stop]


def _across(
    robot: Robot, T_from: FloatArray, T_to: FloatArray, start: FloatArray, hold: Sequence[int]
) -> tuple[FloatArray, bool, bool]:
    """A far row: its joints, whether they reach it, and whether the way there is smooth."""
    direct = inverse_kinematics(robot, T_to, seed=start, hold=hold, restarts=0)
    found = direct if direct.reached[0] else inverse_kinematics(robot, T_to, seed=start, hold=hold)
    if not found.reached[0]:
        # What nothing reaches stays near where the arm was: another configuration would only be a jump.
        return direct.q[0], False, True
    far = _moved(robot, start, found.q[0])
    poses = between(T_from, T_to, int(np.clip(math.ceil(far / _STEP), 2, _MOST_STEPS)))
    steps = inverse_kinematics(robot, poses, seed=start, hold=hold, along_path=True, restarts=0)
    if steps.reached.all() and _largest_step(robot, start, steps) < NEAR * 2:
        return steps.q[-1], True, True
    return found.q[0], True, bool(direct.reached[0]) and far < NEAR


def _largest_step(robot: Robot, start: FloatArray, found: InverseKinematics) -> float:
    q = np.vstack([start, found.q])
    return max(_moved(robot, a, b) for a, b in pairwise(q))


def _moved(robot: Robot, q: FloatArray, other: FloatArray) -> float:
    """The largest joint move, a slider's by the reach."""
    sizes = [1.0 if kind == "revolute" else robot.reach for kind in robot.joint_types]
    return float(np.max(np.abs(other - q) / sizes))
