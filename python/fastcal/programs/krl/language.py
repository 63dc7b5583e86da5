# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How KRL writes poses, configurations and numbers."""

from __future__ import annotations

import math

from fastcal.arrays import FloatArray
from fastcal.ik.posture import SphericalWristArm
from fastcal.programs import orientation
from fastcal.programs.program import Number, Target, Word, decimal


class Krl:
    """How KRL writes poses and configurations."""

    name = "KRL"
    names_postures = True

    def pose(self, values: FloatArray) -> FloatArray:
        """T of X, Y, Z, A, B, C."""
        return orientation.from_zyx(values)

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """X, Y, Z, A, B, C of T."""
        return orientation.to_zyx(T_frame_tool, old)

    def number(self, old: Number, value: float) -> str:
        """Four decimals of a millimetre, five of a degree."""
        return decimal(old, value, 4 if old.unit == "mm" else 5)

    def branch(self, q: FloatArray, arm: SphericalWristArm) -> tuple[bool | None, ...]:
        """The three bits of S."""
        posture = arm.posture(q)
        return posture.behind, posture.elbow_up, posture.wrist_negative

    def asked_branch(self, target: Target) -> tuple[bool | None, ...]:
        """S as three bits."""
        return tuple(bool(_bits(target.words["S"]) >> bit & 1) for bit in range(3)) if "S" in target.words else ()

    def asked_turns(self, target: Target) -> dict[int, tuple[float, float]]:
        """The signs of the axes."""
        if "T" not in target.words:
            return {}
        turn = _bits(target.words["T"])
        return {i: (-2 * math.pi, 0.0) if turn >> i & 1 else (0.0, 2 * math.pi) for i in range(6)}

    def words(self, target: Target, q: FloatArray, arm: SphericalWristArm) -> dict[str, str]:
        """S and T of q, in the form in which they stood."""
        out = {}
        branch = self.branch(q, arm)
        if "S" in target.words and None not in branch:
            high = _bits(target.words["S"]) & ~7
            out["S"] = _like(target.words["S"], high | sum(bool(bit) << i for i, bit in enumerate(branch)))
        if "T" in target.words:
            high, shown = _bits(target.words["T"]) & ~63, arm.robot.pendant.shown(q)
            out["T"] = _like(target.words["T"], high | sum(bool(shown[i] < 0) << i for i in range(6)))
        return out


def _bits(word: Word) -> int:
    """2, or 'B010', or 'H02'."""
    text = word.text.strip("'").upper()
    return int(text[1:], {"B": 2, "H": 16}[text[0]]) if text[:1] in ("B", "H") else int(float(text))


def _like(word: Word, value: int) -> str:
    text = word.text.strip("'").upper()
    if text.startswith("B"):
        return f"'B{value:0{len(text) - 1}b}'"
    return f"'H{value:0{len(text) - 1}X}'" if text.startswith("H") else str(value)
