# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where the arm may work, and which pose of those tells most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.design.instruments import Instruments
from fastcal.design.measurable import candidates_and_obstacles
from fastcal.live.belief import Belief
from fastcal.live.judging import SAME_POSTURE
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import from_si

_DRAWN = 2000  # postures, of which those clear of the mounting are kept
_POOL = 300
_FIRST = 0.35  # of the range about its middle: the first poses, before anything is known


@dataclass(frozen=True)
class NextPose:
    """A pose to measure.

    Attributes:
        q: (n,) of the chain [rad or m].
        shown: (n,) the same as the controller shows it, in degrees or mm.
        planned: Which pose of the plan it is, from 0; None where there is no plan.
        after: Predicted standard deviation once it is measured [m]; None while nothing is known.
    """

    q: FloatArray
    shown: FloatArray
    planned: int | None
    after: float | None


class Workspace:
    """The postures that an arm is to be accurate in, and those that may be measured.

    Args:
        robot: The nominal arm.
        plan: Poses to measure; None: drawn like the others.
        seed: Of the draw.
    """

    def __init__(self, robot: Robot, plan: Dataset | None, seed: int) -> None:
        self.robot = robot
        everywhere, obstacle = candidates_and_obstacles(robot, "random", _DRAWN, None, (0.0,), seed, 1, Instruments())
        clear = everywhere.q[obstacle == 0]
        drawn = (clear if len(clear) else everywhere.q)[:_POOL]
        self.pool = Dataset.from_arrays(_unwound(robot, drawn), source="workspace")
        self.plan = plan

    @property
    def planned(self) -> FloatArray:
        """(K, n) the postures of the plan; none without one."""
        return np.zeros((0, self.robot.joint_count)) if self.plan is None else self.plan.q

    def deviation(self, belief: Belief) -> float:
        """Standard deviation of a predicted coordinate over the workspace [m]."""
        return belief.deviation(belief.derivatives(self.pool))

    def next_pose(self, belief: Belief | None, measured: FloatArray) -> NextPose | None:
        """The pose that lowers the variance most; before anything is known, one that is far from those measured."""
        candidates = self.pool if self.plan is None else self.plan
        free = np.flatnonzero([not _is_among(q, measured) for q in candidates.q])
        if len(free) == 0:
            return None
        after = None
        if belief is None:
            best = int(free[0] if self.plan is not None else self._farthest(candidates.q[free], measured, free))
        else:
            targets = belief.derivatives(self.pool)
            gains = belief.gains(belief.derivatives(candidates.select(free)), targets)
            best = int(free[np.argmax(gains)])
            after = float(np.sqrt(max(0.0, belief.deviation(targets) ** 2 - gains.max())))
        q = candidates.q[best]
        shown = self.robot.pendant.shown(q)
        units = ["deg" if kind == "revolute" else "mm" for kind in self.robot.joint_types]
        edge = np.array([from_si(float(value), unit) for value, unit in zip(shown, units, strict=True)])
        return NextPose(q, edge, None if self.plan is None else best, after)

    def _farthest(self, q: FloatArray, measured: FloatArray, free: NDArray[np.intp]) -> int:
        """Of postures near the middle of the ranges, the one farthest from those measured; each joint by its range."""
        low, width = q.min(axis=0), np.maximum(np.ptp(q, axis=0), 1e-9)
        scaled = (q - low) / width
        if len(measured) == 0:
            return int(free[np.argmin(np.linalg.norm(scaled - 0.5, axis=1))])
        away = np.linalg.norm(scaled[:, None] - ((measured - low) / width)[None], axis=2).min(axis=1)
        middle = np.abs(scaled - 0.5).max(axis=1) < 0.5 - _FIRST / 2
        return int(free[np.argmax(np.where(middle | ~middle.any(), away, -1.0))])


def _unwound(robot: Robot, q: FloatArray) -> FloatArray:
    """The same postures (N, n) with joints within half a turn of zero, where their limits allow it."""
    near = np.where(np.array(robot.joint_types) == "revolute", np.remainder(q + np.pi, 2 * np.pi) - np.pi, q)
    allowed = np.asarray(np.all((near >= robot.limits[:, 0]) & (near <= robot.limits[:, 1]), axis=1))
    return np.asarray(np.where(allowed[:, np.newaxis], near, q))


def _is_among(q: FloatArray, measured: FloatArray) -> bool:
    return len(measured) > 0 and bool((np.abs(measured - q).max(axis=1) < SAME_POSTURE).any())
