# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of a robot with closed loops that were meant otherwise: those of its motors, the only ones there are.

The other joints go where the loops close. A reading by which they close nowhere near is put out of the way of all
points, so that no base and no tool bring it near.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.column_check import Points, Suspicion
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.joint_maps import JointMap, JointMaps, Joints

Closed = Callable[[FloatArray], tuple[FloatArray, NDArray[np.bool_]]]

_AWAY = 10.0  # reaches that a posture is put away by; alternately to both sides, which no shift of the base meets


class _Motors(Joints):
    """The joints of a robot of which only the columns of the motors can be read otherwise."""

    def __init__(self, types: Sequence[str], motors: Sequence[int]) -> None:
        """`motors`: the joints that have one, from 0."""
        super().__init__(types)
        self._motors = list(motors)
        self._own = Joints([types[joint] for joint in motors])
        self.shiftable = []  # no zero is fitted: closing loops takes a hundred times as long as going along a chain

    @cached_property
    def near(self) -> JointMaps:
        return self.simple

    @cached_property
    def simple(self) -> JointMaps:
        maps = self._own.single
        plain: JointMap = self.as_read
        matrices = np.tile(plain.matrix, (len(maps), 1, 1))
        zeros = np.tile(plain.zero, (len(maps), 1))
        matrices[np.ix_(range(len(maps)), self._motors, self._motors)] = maps.matrices
        zeros[:, self._motors] = maps.zeros
        return JointMaps(matrices, zeros)


@cache
def _motors_of(types: tuple[str, ...], motors: tuple[int, ...]) -> _Motors:
    return _Motors(types, motors)


def plausible_motors(dataset: Dataset, robot: RobotFacts, closed: Closed) -> Suspicion | None:
    """A reading of the motors' columns by which points fit that are, as read, farther off than any nominal robot is.

    Args:
        dataset: Up to 60 of its rows with a whole point are looked at.
        robot: The nominal robot, which has passive joints.
        closed: Poses (N, 4, 4) of its last frame at q (N, n), and where (N,) its loops close.
    """

    def poses(q: FloatArray) -> FloatArray:
        T, fits = closed(q)
        T = np.array(T)
        lost = np.flatnonzero(~fits)
        T[lost] = np.eye(4)
        T[lost, 0, 3] = _AWAY * robot.reach * (1.0 - 2.0 * (lost % 2))
        return T

    passive = set(robot.passive)
    motors = tuple(joint for joint in range(len(robot.joint_types)) if joint not in passive)
    points = Points(dataset, robot, poses, _motors_of(tuple(robot.joint_types), motors))
    return points.suspicion() if points.far_off else None
