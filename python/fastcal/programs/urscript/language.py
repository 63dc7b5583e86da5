# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How URScript writes poses and numbers."""

from __future__ import annotations

from fastcal.arrays import FloatArray
from fastcal.ik.posture import SphericalWristArm
from fastcal.programs import orientation
from fastcal.programs.program import Number, Target
from fastcal.robot import se3
from fastcal.units import from_si

_DIGITS = 7  # of a metre and of a radian: 0.1 um


class UrScript:
    """How URScript writes poses; it has no words for configurations, which follow from the last posture."""

    name = "URScript"
    names_postures = False

    def pose(self, values: FloatArray) -> FloatArray:
        """T of x, y, z and a rotation vector."""
        return se3.pose_of_six(values)

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """x, y, z and a rotation vector of T."""
        return orientation.to_vector(T_frame_tool, old)

    def number(self, old: Number, value: float) -> str:
        """Seven decimals of a metre or a radian, five of a degree."""
        digits = 5 if old.unit == "deg" else _DIGITS
        had = len(old.text.partition(".")[2])
        return f"{round(from_si(value, old.unit), max(digits, had)) + 0.0:.{max(digits, had)}f}"

    def branch(self, q: FloatArray, arm: SphericalWristArm) -> tuple[bool | None, ...]:
        """Nothing distinguishes them."""
        return ()

    def asked_branch(self, target: Target) -> tuple[bool | None, ...]:
        """Nothing is asked."""
        return ()

    def asked_turns(self, target: Target) -> dict[int, tuple[float, float]]:
        """Nothing is asked."""
        return {}

    def words(self, target: Target, q: FloatArray, arm: SphericalWristArm) -> dict[str, str]:
        """There are none."""
        return {}
