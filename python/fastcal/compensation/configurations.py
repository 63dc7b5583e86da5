# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joint positions of the nominal robot at the targets of a program, in the configurations that the program asks for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.ik.posture import SphericalWristArm
from fastcal.programs.program import Language, Target
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

_TURN = 2 * np.pi
_SEEDS = 256  # quasi-random postures, from which all (at most eight) solutions of a pose are found
_EDGE = 0.01  # rad by which a joint may miss the range that a word names: words are rounded too
_SAME = 1e-4  # rad: two solutions that are one


class Configurations:
    """Chooses among the solutions of a pose as a controller would.

    Args:
        nominal: The robot as its controller has it.
        language: How the program names configurations.
    """

    def __init__(self, nominal: Robot, language: Language) -> None:
        self.nominal, self.language, self.arm = nominal, language, SphericalWristArm(nominal)
        finite = np.where(np.isfinite(nominal.limits), nominal.limits, [[-np.pi, np.pi]])
        low, high = np.clip(finite, -np.pi, np.pi).T
        # A Kronecker sequence with the roots of x^(n + 1) = x + 1: even in n dimensions (M. Roberts, 2018).
        root = 2.0
        for _ in range(30):
            root = (1 + root) ** (1 / (nominal.joint_count + 1))
        steps = root ** -np.arange(1, nominal.joint_count + 1)
        self._seeds = low + (high - low) * np.mod(0.5 + np.outer(np.arange(_SEEDS), steps), 1.0)

    def solve(
        self, target: Target, T_world_tool: FloatArray, before: FloatArray | None
    ) -> tuple[FloatArray, str | None]:
        """Joint positions (n,) of a pose, and notes on them.

        Args:
            target: Whose words ask for a configuration.
            T_world_tool: Where the nominal robot's tool is to be.
            before: The joints at the target before, which settle what the words leave open.
        """
        asked = self.language.asked_branch(target) if self.arm.has_configurations else ()
        if before is not None:
            near = inverse_kinematics(self.nominal, T_world_tool, seed=before, restarts=0)
            if near.reached[0] and self._fits(near.q[0], asked):
                return self._turned(near.q[0], target, before), None
        ways = self._ways(T_world_tool, before)
        if not len(ways):
            # Without a solution the nearest pose is as good as any: the caller refuses the target.
            return inverse_kinematics(self.nominal, T_world_tool, seed=before).q[0], None
        fitting = [q for q in ways if self._fits(q, asked)]
        turned = [self._turned(q, target, before) for q in fitting or ways]
        middle = np.zeros(self.nominal.joint_count) if before is None else before
        best = min(turned, key=lambda q: float(np.abs(q - middle).max()))
        if fitting:
            return best, None
        words = ", ".join(f"{name} {word.text}" for name, word in target.words.items())
        return best, f"no solution is in the configuration {words}; the one nearest to the target before is taken"

    def _fits(self, q: FloatArray, asked: tuple[bool | None, ...]) -> bool:
        """Is q in the asked configuration, as far as both are known?"""
        if not asked:
            return True
        is_in = self.language.branch(q, self.arm)
        return all(a is None or b is None or a == b for a, b in zip(asked, is_in, strict=True))

    def _ways(self, T_world_tool: FloatArray, before: FloatArray | None) -> list[FloatArray]:
        """All solutions that the seeds lead to."""
        seeds = self._seeds if before is None else np.vstack([before, self._seeds])
        poses = np.broadcast_to(T_world_tool, (len(seeds), 4, 4))
        found = inverse_kinematics(self.nominal, poses, seed=seeds, restarts=0)
        ways: list[FloatArray] = []
        for q in found.q[found.reached]:
            if all(np.abs(np.mod(q - other + np.pi, _TURN) - np.pi).max() > _SAME for other in ways):
                ways.append(q)
        return ways

    def _turned(self, q: FloatArray, target: Target, before: FloatArray | None) -> FloatArray:
        """The solution with whole turns added: into the ranges that the words name, else near the previous target."""
        ranges: Mapping[int, tuple[float, float]] = self.language.asked_turns(target)
        out, pendant = q.copy(), self.nominal.pendant
        for joint in pendant.order:
            if self.nominal.joint_types[joint] != "revolute":
                continue
            low, high = self.nominal.limits[joint]
            ways = [q[joint] + k * _TURN for k in range(-3, 4) if low <= q[joint] + k * _TURN <= high] or [q[joint]]
            near = q[joint] if before is None else before[joint]

            def cost(way: float, joint: int = joint, near: float = near) -> tuple[float, float]:
                out[joint] = way
                shown, asked = pendant.shown(out)[joint], ranges.get(joint)
                missed = 0.0 if asked is None else max(asked[0] - shown, shown - asked[1], 0.0)
                return (0.0 if missed < _EDGE else missed, abs(way - near))

            out[joint] = min(ways, key=cost)
        return out
