# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""FANUC LS: positions P[n] of group 1 in the section /POS, used by the moves of /MN.

X, Y, Z in mm; W, P, R in deg, R = Rz(R) Ry(P) Rx(W); or J1 ... in deg (mm for a sliding one). CONFIG is three letters
and the turns of axes 1, 4 and 6: N or F, q5 negative or at least 0; U or D, elbow up or down; T or B, the wrist centre
before or behind axis 1; a turn k means 360 k - 180 <= q < 360 k + 180.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.ik.posture import SphericalWristArm
from fastcal.programs import orientation
from fastcal.programs.program import Document, Move, Number, Program, Target, Word, decimal
from fastcal.programs.scanning import Piece, number

FloatArray = NDArray[np.float64]

_POSITION = re.compile(r"^[ \t]*P\[\s*(\d+)[^\]\n]*\]\s*\{([^{}]*)\}\s*;", re.M)
_GROUP = re.compile(r"GP(\d+)\s*:")
_VALUE = re.compile(r"\b(X|Y|Z|W|P|R|J\d)\s*=[ \t]*([^\s,]*)[ \t]*(mm|deg)?")
_CONFIGURATION = re.compile(r"CONFIG\s*:\s*'([^'\n]*)'")
_MOVE = re.compile(r"^[ \t]*\d+:[ \t]*([JLCA])[ \t]+([^;\n]*);", re.M)
_CONTINUED = re.compile(r"\n[ \t]*:")
_POSE = ("X", "Y", "Z", "W", "P", "R")
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
        return orientation.nearest_euler(orientation.to_xyz(T_frame_tool), old)

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

    def asked_turns(self, target: Target) -> dict[int, tuple[float, float]]:
        """The turns of axes 1, 4 and 6."""
        if "CONFIG" not in target.words:
            return {}
        turns = [int(turn) for turn in re.findall(r"-?\d+", target.words["CONFIG"].text)]
        return {
            joint: ((2 * turn - 1) * math.pi, (2 * turn + 1) * math.pi)
            for joint, turn in zip(_TURNED, turns, strict=False)
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


@dataclass
class _Reader:
    """Collects the content of an LS file."""

    document: Document
    place: int
    plain: str
    targets: list[Target] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=dict)
    increments: set[int] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)

    def position(self, name: str, start: int, end: int, at: int) -> None:
        """P[n]{...}: group 1 is the arm's; other groups are left as they are."""
        groups = [*_GROUP.finditer(self.document.text, start, end)]
        if not groups:
            raise self.document.error(at, f"{name}: expected a group GP1: of positions")
        for group, after in zip(groups, [*groups[1:], None], strict=True):
            if group[1] == "1":
                self._arm(name, group.end(), after.start() if after else end, at)

    def _arm(self, name: str, start: int, end: int, at: int) -> None:
        text = self.document.text
        found = {m[1]: m for m in _VALUE.finditer(self.plain, start, end)}
        if any(set(m[2]) == {"*"} for m in found.values()):
            self.notes.append(f"{self.document.name}:{self.document.line(at)}: {name} was never taught and is left so")
            return
        joints = sorted(key for key in found if key.startswith("J"))
        keys = tuple(joints) if joints else _POSE
        missing = [key for key in keys if key not in found]
        if missing:
            message = f"{name}: expected {', '.join(keys)}, but {', '.join(missing)} is not given"
            raise self.document.error(at, message)
        numbers = []
        for key in keys:
            match = found[key]
            unit = match[3] or ("mm" if key in "XYZ" else "deg")
            piece = Piece(match[2], match.start(2), match.end(2))
            numbers.append(number(self.document, self.place, piece, unit, f"{name}, {key}"))
        words = {}
        if not joints and (configuration := _CONFIGURATION.search(text, start, end)):
            words["CONFIG"] = Word(self.place, configuration.start(1), configuration.end(1), configuration[1])
        tool, frame = (re.search(rf"\b{key}\s*:\s*(\w+)", text[start:end]) for key in ("UT", "UF"))
        self.names[name] = len(self.targets)
        self.targets.append(
            Target(
                name,
                self.document.line(at),
                "joints" if joints else "pose",
                tuple(numbers),
                words,
                tool[1] if tool else None,
                frame[1] if frame else None,
            )
        )

    def move(self, instruction: str, text: str, at: int) -> None:
        """J, L, C or A with its positions; a warning names what a register or an offset adds at run time."""
        line = self.document.line(at)
        where = f"{self.document.name}:{line}: {instruction}"
        positions = re.findall(r"(?<!\w)(P|PR)\[\s*(\w+)[^\]]*\]", text.partition("Offset")[0])
        incremental = re.search(r"\bINC\b", text)
        if incremental:
            self.notes.append(f"{where} moves by an increment, which is left as it is")
        for kind, count in positions:
            if kind == "PR" or f"P[{count}]" not in self.names:
                self.notes.append(f"{where} goes to {kind}[{count}], which is not in this file, and is left as it is")
            elif incremental:
                self.increments.add(self.names[f"P[{count}]"])
            else:
                shifted = re.search(r"Offset|VOFFSET", text, re.I)
                offset = (math.nan, math.nan, math.nan) if shifted else None
                self.moves.append(Move(self.names[f"P[{count}]"], self.place, line, offset=offset))


def _without_strings(text: str) -> str:
    """The text with what is in single quotes made spaces: CONFIG holds letters that are names of values too."""
    return re.sub(r"'[^'\n]*'", lambda match: " " * len(match[0]), text)


def read(documents: tuple[Document, ...]) -> Program:
    """The positions of LS files.

    Raises:
        ParseError: A position is not made of the numbers that it needs; names the line.
    """
    targets: list[Target] = []
    moves: list[Move] = []
    notes: list[str] = []
    increments: set[int] = set()
    for place, document in enumerate(documents):
        reader = _read_one(document, place)
        before = len(targets)
        moves += [replace(move, target=move.target + before) for move in reader.moves]
        increments |= {target + before for target in reader.increments}
        targets += reader.targets
        notes += reader.notes
    zero = {"0": np.eye(4)}
    program = Program(Fanuc(), documents, tuple(targets), tuple(moves), zero, zero, notes=tuple(notes))
    return program.without(increments)


def _read_one(document: Document, place: int) -> _Reader:
    reader = _Reader(document, place, _without_strings(document.text))
    head = re.search(r"^/POS", document.text, re.M)
    if head is None:
        raise document.error(0, "expected a section /POS, as every LS file has")
    for match in _POSITION.finditer(document.text, head.end()):
        reader.position(f"P[{match[1]}]", match.start(2), match.end(2), match.start())
    _check_all_read(document, head.end())
    moves = _CONTINUED.sub(lambda match: " " * len(match[0]), document.text[: head.start()])
    for match in _MOVE.finditer(moves):
        reader.move(match[1], match[2], match.start(1))
    for move in reader.moves:
        if move.target in reader.increments:
            name = reader.targets[move.target].name
            raise document.error(
                head.start(), f"{name} is used as a position and as an increment; expected one of them"
            )
    return reader


def _check_all_read(document: Document, start: int) -> None:
    """Refuses a position whose braces don't close, which would otherwise be passed over."""
    ends = {match.start() for match in _POSITION.finditer(document.text, start)}
    for head in re.compile(r"^[ \t]*P\[[^\]\n]*\]\s*\{", re.M).finditer(document.text, start):
        if head.start() not in ends:
            raise document.error(head.start(), "expected a position P[n]{ ... }; with its end")
