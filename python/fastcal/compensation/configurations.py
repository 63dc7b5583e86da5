# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joint positions of the nominal robot at the targets of a program, in the configurations that the program asks for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from fastcal.arrays import FloatArray
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.ik.posture import SphericalWristArm
from fastcal.programs.program import Language, Move, Target
from fastcal.robot.robot import Robot

_TURN = 2 * np.pi
_SEEDS = 256  # quasi-random postures, from which all (at most eight) solutions of a pose are found
_EDGE = 0.01  # rad by which a joint may miss the range that a word names: words are rounded too
_SAME = 1e-4  # rad: two solutions that are one
_CLOSE = 0.35  # rad: a solution so near needs no look at the others


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
        self.middle = finite.mean(axis=1)
        # A Kronecker sequence with the roots of x^(n + 1) = x + 1: even in n dimensions (M. Roberts, 2018).
        root = 2.0
        for _ in range(30):
            root = (1 + root) ** (1 / (nominal.joint_count + 1))
        steps = root ** -np.arange(1, nominal.joint_count + 1)
        self._seeds = low + (high - low) * np.mod(0.5 + np.outer(np.arange(_SEEDS), steps), 1.0)

    def solve(
        self, target: Target, T_world_tool: FloatArray, before: FloatArray | None, move: Move | None = None
    ) -> tuple[FloatArray | None, str]:
        """Joint positions (n,) of a pose; or None, and why its posture is not known.

        The words of the target decide, then the joints that the program states near it, then those before it, to
        which a controller stays nearest.

        Args:
            target: Whose words ask for a configuration.
            T_world_tool: Where the nominal robot's tool is to be.
            before: The joints where the arm comes from; None: unknown.
            move: How the program comes to it.
        """
        stated = None if move is None else move.near
        asked = _Asked(self, target, is_silent=stated is not None or (move is not None and move.wordless))
        count = self.nominal.pendant.axis_count
        if stated is not None and len(stated) != count:
            return None, f"it is to be near {len(stated)} joints, and {self.nominal.name} has {count}"
        near = before if stated is None else at_axes(self.nominal, stated)
        if near is not None:
            found = inverse_kinematics(self.nominal, T_world_tool, seed=near, restarts=0)
            q = asked.turned(found.q[0], near)
            if found.reached[0] and asked.fits(q) and (asked.is_whole or np.abs(q - near).max() < _CLOSE):
                return q, ""
        ways = self._ways(T_world_tool, near)
        if not len(ways):
            # Without a solution the nearest pose is as good as any: the caller refuses the target.
            return inverse_kinematics(self.nominal, T_world_tool, seed=near).q[0], ""
        turned = [asked.turned(q, near) for q in ways]
        fitting = [q for q in turned if asked.fits(q)]
        if not fitting:
            words = ", ".join(f"{name} {word.text}" for name, word in target.words.items())
            return None, (
                f"none of the arm's {len(ways)} solutions is in the configuration {words}; its tool, its frame or the "
                "flange may be elsewhere"
            )
        if len(fitting) == 1:
            return fitting[0], ""
        if near is None:
            return None, (
                f"the arm reaches it in {len(fitting)} postures, and nothing says in which: no words of its own, no "
                "joints before it, and no start_deg in a cell file"
            )
        off = np.abs(np.array(fitting) - near)
        best = int(np.argmin(off.max(axis=1)))
        if best != int(np.argmin((off**2).sum(axis=1))):
            return None, "two postures are about as near to where the arm comes from, and nothing says in which it goes"
        return fitting[best], ""

    def nearest(self, T_world_tool: FloatArray, near: FloatArray) -> tuple[FloatArray, int]:
        """The solution (n,) nearest to some joints, those themselves where there is none; the number of solutions."""
        ways = self._ways(T_world_tool, near)
        return min(ways, key=lambda q: float(np.abs(q - near).max()), default=near), len(ways)

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


def at_axes(robot: Robot, shown: ArrayLike) -> FloatArray:
    """The joints (n,) [rad or m] where the controller shows its axes (m,), those without a motor where loops close."""
    q = robot.pendant.chain(shown)
    return robot.follow(q[np.newaxis])[0] if robot.passive else q


class _Asked:
    """What a target says of its configuration."""

    def __init__(self, ways: Configurations, target: Target, *, is_silent: bool) -> None:
        self.nominal, self.language, self.arm = ways.nominal, ways.language, ways.arm
        self._branch = () if is_silent or not self.arm.has_configurations else self.language.asked_branch(target)
        self._ranges: Mapping[int, tuple[float, float]] = {} if is_silent else self.language.asked_turns(target)
        self.is_whole = bool(self._branch) and None not in self._branch

    def fits(self, q: FloatArray) -> bool:
        """Is q in the asked configuration, as far as it is told?"""
        if any(self._missed(axis, q) for axis in self._ranges if axis < self.nominal.pendant.axis_count):
            return False
        is_in = self.language.branch(q, self.arm) if self._branch else ()
        return all(a is None or b is None or a == b for a, b in zip(self._branch, is_in, strict=True))

    def turned(self, q: FloatArray, near: FloatArray | None) -> FloatArray:
        """The solution with whole turns added: into the ranges that the words name, else near other joints."""
        out = q.copy()
        for joint in self.nominal.pendant.order:
            if self.nominal.joint_types[joint] != "revolute" or joint in self.nominal.passive:
                continue
            low, high = self.nominal.limits[joint]
            ways = [q[joint] + k * _TURN for k in range(-3, 4) if low <= q[joint] + k * _TURN <= high] or [q[joint]]
            to = q[joint] if near is None else near[joint]
            costs = []
            for way in ways:
                out[joint] = way
                costs.append((self._missed(self.nominal.pendant.axis(joint), out), abs(way - to), way))
            out[joint] = min(costs)[2]
        return out

    def _missed(self, axis: int | None, q: FloatArray) -> float:
        """By how much [rad] an axis is shown out of the range that the words name; 0 within their rounding."""
        if axis is None or axis not in self._ranges:
            return 0.0
        (low, high), at = self._ranges[axis], self.nominal.pendant.shown(q)[axis]
        missed = max(low - at, at - high, 0.0)
        return 0.0 if missed < _EDGE else missed
