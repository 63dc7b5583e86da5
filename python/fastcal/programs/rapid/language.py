# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How RAPID writes poses, configurations and numbers."""

from __future__ import annotations

import math

from fastcal.arrays import FloatArray
from fastcal.ik.posture import SphericalWristArm
from fastcal.programs import orientation
from fastcal.programs.program import Number, Target, decimal

_QUARTER = math.pi / 2


class Rapid:
    """How RAPID writes poses and configurations."""

    name = "RAPID"
    names_postures = True

    def pose(self, values: FloatArray) -> FloatArray:
        """T of x, y, z and a quaternion."""
        return orientation.from_quaternion(values)

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """x, y, z and a quaternion of T."""
        return orientation.to_quaternion(T_frame_tool, old)

    def number(self, old: Number, value: float) -> str:
        """Four decimals of a millimetre, five of a degree, nine of a quaternion."""
        return decimal(old, value, {"mm": 4, "deg": 5}.get(old.unit, 9))

    def branch(self, q: FloatArray, arm: SphericalWristArm) -> tuple[bool | None, ...]:
        """The three bits of cfx: behind axis 1, behind the lower arm, axis 5 negative."""
        posture = arm.posture(q)
        return posture.behind, None if posture.elbow_up is None else not posture.elbow_up, posture.wrist_negative

    def asked_branch(self, target: Target) -> tuple[bool | None, ...]:
        """The bits of cfx."""
        if "cfx" not in target.words:
            return ()
        cfx = round(float(target.words["cfx"].text))
        return tuple(bool(cfx >> bit & 1) for bit in (2, 1, 0))

    def asked_turns(self, target: Target) -> dict[int, tuple[float, float]]:
        """The quarter turns of axes 1, 4 and 6."""
        quarters = {joint: round(float(target.words[f"cf{joint + 1}"].text)) for joint in (0, 3, 5) if target.words}
        return {joint: (quarter * _QUARTER, (quarter + 1) * _QUARTER) for joint, quarter in quarters.items()}

    def words(self, target: Target, q: FloatArray, arm: SphericalWristArm) -> dict[str, str]:
        """The confdata of q."""
        if not target.words:
            return {}
        shown = arm.robot.pendant.shown(q)
        out = {f"cf{joint + 1}": str(math.floor(shown[joint] / _QUARTER)) for joint in (0, 3, 5)}
        bits = self.branch(q, arm)
        if None not in bits:
            out["cfx"] = str(sum(bool(bit) << place for bit, place in zip(bits, (2, 1, 0), strict=True)))
        return out
