# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a program's tools and frames are: as given by the user, else by the program; without them a target is left."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.programs.program import ACTIVE, Frame, Move, Program, Target
from fastcal.robot import se3


def _identity() -> FloatArray:
    return np.eye(4)


@dataclass(frozen=True, eq=False)
class Cell:
    """What a program does not define about its robot; poses (4, 4) in SI.

    Attributes:
        T_controller_base: The robot file's base in the base frame of the controller.
        T_last_flange: The controller's flange in the robot file's last frame; None: where the robot file has it.
        tools: T_flange_tool by the program's name or number.
        frames: T_base_frame, in the controller's base, by name or number.
        start: Joints of the controller [rad] where the arm stands when a program begins; None: not known.
        loads: Masses [kg] of the loads that a program names, by name or number.
    """

    T_controller_base: FloatArray = field(default_factory=_identity)
    T_last_flange: FloatArray | None = None
    tools: Mapping[str, FloatArray] = field(default_factory=dict)
    frames: Mapping[str, FloatArray] = field(default_factory=dict)
    start: FloatArray | None = None
    loads: Mapping[str, float] = field(default_factory=dict)


class Frames:
    """Resolves the tool and the frame of each target.

    Args:
        program: Whose targets they are.
        cell: Given by the user.
        T_last_tool: The robot file's tool, in its last frame: where the miss of a joint target of no tool is told.

    Attributes:
        left: Why a target, by its place, has no tool or frame: it is to be left as it is.
    """

    def __init__(self, program: Program, cell: Cell, T_last_tool: FloatArray) -> None:
        self.program, self.cell = program, cell
        self._T_last_flange = np.eye(4) if cell.T_last_flange is None else cell.T_last_flange
        self.left: dict[int, str] = {}
        self._tools = _known("tool", program, program.tools, cell.tools)
        self._frames = _known("frame", program, program.frames, cell.frames)
        self._assumed_tool = se3.inverse(self._T_last_flange) @ T_last_tool
        uses: dict[int, list[Move]] = {}
        for move in program.moves:
            uses.setdefault(move.target, []).append(move)
        self._pairs = [self._pair(i, target, uses.get(i, [])) for i, target in enumerate(program.targets)]

    def to_base(self, place: int, T_frame_tool: FloatArray) -> FloatArray:
        """T_base_last of the robot file for a target, by its place, whose numbers give T_frame_tool."""
        T_frame, T_tool = self._pairs[place]
        cell = self.cell
        T_controller_flange = T_frame @ T_frame_tool @ se3.inverse(T_tool)
        return se3.inverse(cell.T_controller_base) @ T_controller_flange @ se3.inverse(self._T_last_flange)

    def from_base(self, place: int, T_base_last: FloatArray) -> FloatArray:
        """T_frame_tool, as the target's numbers give it; the inverse of `to_base`."""
        T_frame, T_tool = self._pairs[place]
        cell = self.cell
        return se3.inverse(T_frame) @ cell.T_controller_base @ T_base_last @ self._T_last_flange @ T_tool

    def tool(self, place: int) -> FloatArray:
        """T_last_tool: the target's tool in the robot file's last frame."""
        return self._T_last_flange @ self._pairs[place][1]

    def _pair(self, place: int, target: Target, uses: list[Move]) -> tuple[FloatArray, FloatArray]:
        """T_controller_frame and T_flange_tool of a target and its uses."""
        tools = {move.tool or target.tool: move.line for move in reversed(uses)} or {target.tool: target.line}
        frames = {move.frame or target.frame: move.line for move in reversed(uses)} or {target.frame: target.line}
        if target.kind == "joints":
            # Joints determine the flange, whatever the tool.
            T = self._tools.get((next(iter(tools)) or "").lower())
            return np.eye(4), T if isinstance(T, np.ndarray) else self._assumed_tool
        found = []
        for what, names, known in (("tool", tools, self._tools), ("frame", frames, self._frames)):
            name = next(iter(names))
            T = known.get((name or ACTIVE).lower())
            if len(names) > 1:
                where = ", ".join(f"{name} in line {line}" for name, line in sorted(names.items(), key=str))
                self.left[place] = (
                    f"it is used with more than one {what} ({where}), and its numbers can be right for one only"
                )
            elif isinstance(T, str):
                self.left[place] = T
            elif not uses and name is None and (T is None or self.program.moves):
                self.left[place] = "no move goes to it here, so its tool and frame are not known"
            elif T is None:
                self.left[place] = (
                    f"the program does not say which {what} applies; a cell file can, as '{ACTIVE}' of its {what}s"
                    if name is None
                    else f"{what} {name} is not in the program; a cell file can say where it is"
                )
            found.append(T if isinstance(T, np.ndarray) else np.eye(4))
        return found[1], found[0]


def _known(
    what: str, program: Program, given: Mapping[str, Frame], cell: Mapping[str, FloatArray]
) -> dict[str, FloatArray | str]:
    """Poses by names in lower case, products worked out; in place of a pose why it is not known."""
    of_cell = {name.lower(): T for name, T in cell.items()}
    known: dict[str, FloatArray | str] = {name.lower(): T for name, T in given.items() if isinstance(T, np.ndarray)}
    known |= {name: why for (kind, name), why in program.doubts.items() if kind == what}
    known |= of_cell
    for label, parts in given.items():
        if isinstance(parts, tuple) and label.lower() not in of_cell:
            known[label.lower()] = _multiplied(what, parts, known)
    return known


def _multiplied(
    what: str, parts: tuple[str | FloatArray, ...], known: Mapping[str, FloatArray | str]
) -> FloatArray | str:
    """The product of named and plain poses, or what is missing for it."""
    T = np.eye(4)
    for part in parts:
        factor = known.get(part.lower()) if isinstance(part, str) else part
        if factor is None:
            return f"{what} {part} is not in the program; a cell file can say where it is"
        if isinstance(factor, str):
            return factor
        T = T @ factor
    return T
