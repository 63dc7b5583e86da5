# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How LS files write poses, configurations and numbers."""

from __future__ import annotations

import math
import re

from fastcal.arrays import FloatArray
from fastcal.ik.posture import SphericalWristArm
from fastcal.programs import orientation
from fastcal.programs.program import Number, Target, decimal

_LETTERS = ("NF", "DU", "BT")  # true, false
_TURNED = (0, 3, 5)  # joints, from 0, whose turns CONFIG counts: $SCR_GRP[1].$TURN_AXIS of the controller


class Fanuc:
    """How an LS file writes poses and configurations."""

    name = "FANUC LS"
    names_postures = True

    def pose(self, values: FloatArray) -> FloatArray:
        """T of X, Y, Z, W, P, R."""
        return orientation.from_xyz(values)

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """X, Y, Z, W, P, R of T."""
        return orientation.to_xyz(T_frame_tool, old)

    def number(self, old: Number, value: float) -> str:
        """Three decimals, or as many as there were."""
        text = decimal(old, value, 3)
        if old.text.lstrip("-").startswith("."):
            text = re.sub(r"^(-?)0\.", r"\1.", text)
        return text

    def branch(self, q: FloatArray, arm: SphericalWristArm) -> tuple[bool | None, ...]:
        """No flip, down, behind."""
        posture = arm.posture(q)
        return posture.wrist_negative, None if posture.elbow_up is None else not posture.elbow_up, posture.behind

    def asked_branch(self, target: Target) -> tuple[bool | None, ...]:
        """The letters of CONFIG; a left or right arm (L, R) is passed over."""
        if "CONFIG" not in target.words:
            return ()
        given = re.findall(r"[A-Z]", target.words["CONFIG"].text.upper())
        found = [next((letter == pair[0] for letter in given if letter in pair), None) for pair in _LETTERS]
        return tuple(found)

    def turns(self, target: Target) -> list[int]:
        """The turn numbers of CONFIG."""
        given = target.words.get("CONFIG")
        return [] if given is None else [int(turn) for turn in re.findall(r"-?\d+", given.text)]

    def asked_turns(self, target: Target) -> dict[int, tuple[float, float]]:
        """The turns of axes 1, 4 and 6."""
        return {
            joint: ((2 * turn - 1) * math.pi, (2 * turn + 1) * math.pi)
            for joint, turn in zip(_TURNED, self.turns(target), strict=False)
        }

    def words(self, target: Target, q: FloatArray, arm: SphericalWristArm) -> dict[str, str]:
        """CONFIG of q."""
        if "CONFIG" not in target.words:
            return {}
        text = target.words["CONFIG"].text
        for pair, bit in zip(_LETTERS, self.branch(q, arm), strict=True):
            if bit is not None:
                text = re.sub(rf"\b[{pair}]\b", pair[not bit], text, count=1)
        shown = arm.robot.pendant.shown(q)
        turns = iter([math.floor(shown[joint] / (2 * math.pi) + 0.5) for joint in _TURNED])
        return {"CONFIG": re.sub(r"-?\d+", lambda match: str(next(turns, match[0])), text)}
