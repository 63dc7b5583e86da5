# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Touches of points that nobody measured, as what shows signs and zeros of joints.

The tip t of the hand is at one point s_k in all touches i of a point k: R_i t + p_i = s_k with the flange's pose
(R_i, p_i). Less their means over the touches of a point, which take s_k away, these are linear in t.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.moving_rig import frames_of
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

SOCKET = "socket"
FEWEST = 8  # touches
_SPARE = 4  # numbers more than unknowns
_LONGEST = 100.0  # [m] of a tip that the touches do not show, for each m that they miss by


@dataclass(frozen=True, eq=False)
class Touches:
    """Counts (N, n) of the joints at each touch, and which point it is of (N,)."""

    counts: FloatArray
    point: NDArray[np.intp]

    def misfits(self, robot: Robot, sign: FloatArray, zeros: FloatArray, *, turns_alone: bool) -> FloatArray:
        """(B, N, 3) by which the tip is away from the middle of its point's touches [m]; no turn shows alone."""
        del turns_alone
        q = self.counts * sign + zeros[:, np.newaxis]
        F = frames_of(robot, np.ascontiguousarray(q.reshape(-1, q.shape[2])), "arm").reshape(*q.shape[:2], 4, 4)
        R = (self._from_means @ F[..., :3, :3].reshape(*q.shape[:2], 9)).reshape(*q.shape[:2], 3, 3)
        p = self._from_means @ F[..., :3, 3]
        squares = np.einsum("bnij,bnik->bjk", R, R) + np.eye(3) / _LONGEST**2
        tip = np.linalg.solve(squares, -np.einsum("bnij,bni->bj", R, p)[..., np.newaxis])
        return np.asarray((R @ tip[:, np.newaxis])[..., 0] + p)

    @cached_property
    def _from_means(self) -> FloatArray:
        """(N, N) by which numbers of the touches are those less their means over the touches of each point."""
        same = self.point[:, np.newaxis] == self.point
        return np.asarray(np.eye(len(self.point)) - same / same.sum(axis=1))


def touches_of(data: Dataset, unknown_count: int) -> Touches:
    """The touches in some rows.

    Args:
        data: With `socket` labels; its q are what the motors count.
        unknown_count: Zeros that are to be found.

    Raises:
        InvalidInput: They are too few.
    """
    label = np.array(data.observed_labels[SOCKET])
    rows = np.flatnonzero(label != "")
    _, point, counts = np.unique(label[rows], return_inverse=True, return_counts=True)
    own, point = rows[counts[point] > 1], point[counts[point] > 1]
    shared = len(np.unique(point))
    spare = 3 * (len(own) - shared) - unknown_count - 3
    if len(own) < FEWEST or spare < _SPARE:
        raise InvalidInput(
            f"{data.source}: {len(own)} touches of points that are touched twice or more do not show signs and zeros; "
            "expected a dozen, of two points or more, in postures as different as the arm can take"
        )
    return Touches(data.q[own], point)
