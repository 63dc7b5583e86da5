# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""KUKA KRL: {X 1, Y 2, Z 3, A 4, B 5, C 6, S 2, T 35} and {A1 1, ... A6 6} in moves (.src) and lists (.dat).

Units mm and deg, R = Rz(A) Ry(B) Rx(C). S, the status: bit 0, the wrist centre is behind axis 1; bit 1, the elbow is up
(A3 beyond the angle at which the arm is stretched); bit 2, A5 < 0. T, the turn: bit i - 1, Ai < 0.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fastcal.ik.posture import SphericalWristArm
from fastcal.programs import orientation
from fastcal.programs.program import Document, Move, Number, Program, Target, Word, decimal
from fastcal.programs.scanning import Piece, blanked, closing, number, split

FloatArray = NDArray[np.float64]

_NAME = r"[$A-Za-z_][\w$]*(?:\[\s*\d+\s*\])?"
_ASSIGNED = re.compile(rf"(?:\b(E6POS|POS|E6AXIS|AXIS|FRAME)\s+)?({_NAME})\s*=\s*(?=\{{)", re.I)
_MOVE = re.compile(r"^[ \t]*(S?(?:PTP|LIN|CIRC)(?:_REL)?|SPL)\b[ \t]*(?=[{\w$])", re.I | re.M)
_ACTIVE = re.compile(
    rf"\$(BASE|TOOL)\s*=\s*({_NAME})"
    r"|\bBAS\s*\(\s*#(BASE|TOOL)\s*,\s*(\d+)"
    rf"|\bFDAT_ACT\s*=\s*({_NAME})",
    re.I,
)
_FDAT = re.compile(rf"\bFDAT\s+({_NAME})\s*=\s*\{{([^{{}}\n]*)\}}", re.I)
_POSE, _JOINTS = ("X", "Y", "Z", "A", "B", "C"), ("A1", "A2", "A3", "A4", "A5", "A6")


class Krl:
    """How KRL writes poses and configurations."""

    name = "KRL"
    names_postures = True

    def pose(self, values: FloatArray) -> FloatArray:
        """T of X, Y, Z, A, B, C."""
        return orientation.from_zyx(values)

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """X, Y, Z, A, B, C of T."""
        return orientation.nearest_euler(orientation.to_zyx(T_frame_tool), old)

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


@dataclass
class _Reader:
    """Collects the content of a program's files."""

    documents: tuple[Document, ...]
    texts: list[str]
    targets: list[Target] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=dict)
    tools: dict[str, FloatArray] = field(default_factory=dict)
    frames: dict[str, FloatArray] = field(default_factory=dict)
    fdat: dict[str, tuple[str | None, str | None]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    undecided: set[int] = field(default_factory=set)
    tool: str | None = None
    frame: str | None = None

    def assign(self, place: int, start: int, name: str, kind: str | None) -> None:
        """An aggregate that a name gets: a target, or where tool or base is."""
        key = re.sub(r"\s", "", name.upper())
        parts = self._parts(place, start)
        if key in ("$TOOL", "$BASE") or key.startswith(("TOOL_DATA[", "BASE_DATA[")):
            T = orientation.from_zyx(np.array([n.si for n in self._numbers(place, start, parts, _POSE, name)]))
            line = self.documents[place].line(start)
            label = f"{key} of line {line}" if key.startswith("$") else key[10:-1]
            (self.tools if "TOOL" in key else self.frames)[label] = T
            if key == "$TOOL":
                self.tool = label
            elif key == "$BASE":
                self.frame = label
        elif parts.keys() & {"X", "A1"}:
            self.names[key] = self.target(place, start, name, *self.fdat.get(f"F{key[1:]}", (None, None)))
            if kind in (None, "FRAME") and "A1" not in parts:
                # It may be a base or a tool as well as a target; the moves decide which.
                self.undecided.add(self.names[key])
                T = orientation.from_zyx(self.targets[self.names[key]].values)
                self.tools[key] = self.frames[key] = T

    def target(self, place: int, start: int, name: str, tool: str | None = None, frame: str | None = None) -> int:
        """Adds the target of the aggregate at `start` and gives its place."""
        parts = self._parts(place, start)
        posed = "A1" not in parts
        numbers = self._numbers(place, start, parts, _POSE if posed else _JOINTS, name)
        words = {key: parts[key] for key in ("S", "T") if key in parts}
        for key, piece in words.items():
            if not re.fullmatch(r"\d+(\.0*)?|'[Bb][01]+'|'[Hh][0-9A-Fa-f]+'", piece.text):
                raise self.documents[place].error(
                    piece.start, f"{name}: expected a number as {key}, got '{piece.text:.40}'"
                )
        self.targets.append(
            Target(
                name,
                self.documents[place].line(start),
                "pose" if posed else "joints",
                numbers,
                {key: Word(place, piece.start, piece.end, piece.text) for key, piece in words.items()},
                tool,
                frame,
            )
        )
        return len(self.targets) - 1

    def move(self, place: int, start: int, instruction: str) -> None:
        """A motion instruction and its one or two targets."""
        document, text = self.documents[place], self.texts[place]
        end = text.find("\n", start)
        pieces = split(text, start, end if end >= 0 else len(text))
        line = document.line(start)
        for piece in pieces[: 2 if "CIRC" in instruction.upper() else 1]:
            name = re.match(_NAME, piece.text)
            found: int | None = None
            if instruction.upper().endswith("_REL"):
                pass
            elif piece.text.startswith("{"):
                found = self.target(place, piece.start, f"the target of line {line}")
            elif name and not re.match(r"\s*[:+(]", piece.text[name.end() :]):
                found = self.names.get(re.sub(r"\s", "", name[0].upper()))
            if found is None:
                self.notes.append(
                    f"{document.name}:{line}: {instruction} goes to {piece.text:.40}, which is no target of plain "
                    "numbers here, and is left as it is"
                )
            else:
                self.moves.append(Move(found, place, line, self.tool, self.frame))

    def activate(self, match: re.Match[str]) -> None:
        """$BASE = BASE_DATA[2], BAS(#TOOL, 1), FDAT_ACT = FP1: which tool and base hold from here on."""
        which, value, bas, count, fdat = match.groups()
        if fdat:
            self.tool, self.frame = self.fdat.get(fdat.upper(), (self.tool, self.frame))
            return
        label = count or re.sub(r"\s|^(BASE|TOOL)_DATA\[|\]$", "", value.upper())
        label = "0" if label == "$NULLFRAME" else label
        if (which or bas).upper() == "TOOL":
            self.tool = label
        else:
            self.frame = label

    def _parts(self, place: int, start: int) -> dict[str, Piece]:
        """{X 1, A 2} as pieces by their names; a type such as E6POS: in front is left out."""
        document, text = self.documents[place], self.texts[place]
        end = closing(text, start)
        if end < 0 or "\n" in text[start:end]:
            raise document.error(start, "expected a } that closes this { in the same line")
        out = {}
        for piece in split(text, start + 1, end - 1):
            match = re.match(r"(?:\w+\s*:\s*)?(\w+)\s*", piece.text)
            if match:
                value = piece.text[match.end() :]
                out[match[1].upper()] = Piece(value, piece.end - len(value), piece.end)
        return out

    def _numbers(
        self, place: int, start: int, parts: dict[str, Piece], keys: tuple[str, ...], name: str
    ) -> tuple[Number, ...]:
        document = self.documents[place]
        missing = [key for key in keys if key not in parts]
        if missing:
            raise document.error(start, f"{name}: expected {', '.join(keys)}, but {', '.join(missing)} is not given")
        units = ["mm" if key in "XYZ" else "deg" for key in keys]
        return tuple(number(document, place, parts[k], u, f"{name}, {k}") for k, u in zip(keys, units, strict=True))


def read(documents: tuple[Document, ...]) -> Program:
    """The targets of KRL files; lists (.dat) are read before what moves (.src).

    Raises:
        ParseError: A target is not made of the numbers that it needs; names the line.
    """
    reader = _Reader(documents, [blanked(document.text, ";") for document in documents])
    order = sorted(range(len(documents)), key=lambda place: not documents[place].name.lower().endswith(".dat"))
    for place in order:
        for match in _FDAT.finditer(reader.texts[place]):
            inner = dict(re.findall(r"(TOOL_NO|BASE_NO)\s+(\d+)", match[2].upper()))
            reader.fdat[match[1].upper()] = (inner.get("TOOL_NO"), inner.get("BASE_NO"))
    for place in order:
        text = reader.texts[place]
        patterns = (_ASSIGNED, _MOVE, _ACTIVE)
        for match in sorted((m for p in patterns for m in p.finditer(text)), key=re.Match.start):
            if match.re is _ASSIGNED:
                reader.assign(place, match.end(), match[2], match[1] and match[1].upper())
            elif match.re is _MOVE:
                reader.move(place, match.end(), match[1])
            elif not text.startswith("{", match.end()):
                reader.activate(match)
    tools, frames = {"0": np.eye(4), **reader.tools}, {"0": np.eye(4), **reader.frames}
    targets, moves = tuple(reader.targets), tuple(reader.moves)
    program = Program(Krl(), documents, targets, moves, tools, frames, notes=tuple(reader.notes))
    return program.without(reader.undecided - {move.target for move in reader.moves})
