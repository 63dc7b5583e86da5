# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""URScript: p[x, y, z, rx, ry, rz] in m and rad (a rotation vector), and joint lists [q1 ... q6] in rad, or d2r(deg).

In a move, or given to a name that a move takes. set_tcp(p[...]) sets the tool, pose_trans(p[...], p[...]) a frame.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.ik.posture import SphericalWristArm
from fastcal.programs import orientation
from fastcal.programs.program import Document, Move, Number, Program, Target
from fastcal.programs.scanning import Piece, blanked, closing, number, split, trimmed
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

_ASSIGNED = re.compile(r"^[ \t]*(?:global[ \t]+|local[ \t]+)?(\w+)[ \t]*=[ \t]*(?=p?\[)", re.M)
_MOVE = re.compile(r"\b(move[jlpc]|servo[jlc])\s*\(")
_TOOL = re.compile(r"\bset_tcp\s*\(")
_TRANSFORMED = re.compile(r"pose_trans\s*\(")
_SOLVED = re.compile(r"get_inverse_kin\s*\(")
_DEGREES = re.compile(r"d2r\s*\(\s*([^()]*?)\s*\)")
_DIGITS = 7  # of a metre and of a radian: 0.1 um


class UrScript:
    """How URScript writes poses; it has no words for configurations, which follow from the last posture."""

    name = "URScript"
    names_postures = False

    def pose(self, values: FloatArray) -> FloatArray:
        """T of x, y, z and a rotation vector."""
        return orientation.from_vector(values)

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """x, y, z and a rotation vector of T."""
        return orientation.nearest_vector(orientation.to_vector(T_frame_tool), old)

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


@dataclass
class _Reader:
    """Collects the content of a script, from beginning to end."""

    document: Document
    place: int
    text: str
    targets: list[Target] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)
    names: dict[str, tuple[int, int]] = field(default_factory=dict)
    literals: dict[str, Piece] = field(default_factory=dict)
    tools: dict[str, FloatArray] = field(default_factory=dict)
    frames: dict[str, FloatArray] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    tool: str | None = None

    def assign(self, name: str, start: int) -> None:
        """A name gets a pose or a list; the moves decide whether that is a target."""
        end = closing(self.text, start)
        if end < 0:
            raise self.document.error(start, f"{name}: expected a ] that closes this [")
        self.literals[name] = trimmed(self.text, start, end)
        self.names.pop(name, None)

    def set_tool(self, start: int) -> None:
        """set_tcp(p[...]), or a name that was given one."""
        piece = split(self.text, start, closing(self.text, start - 1) - 1)[0]
        label = f"set_tcp of line {self.document.line(start)}"
        values = self._pose(piece, label)
        if values is None:
            self.notes.append(
                f"{self.document.name}:{self.document.line(start)}: the tool {piece.text:.40} is no plain pose"
            )
        else:
            self.tools[label] = orientation.from_vector(np.array([part.si for part in values]))
        self.tool = label

    def move(self, instruction: str, start: int) -> None:
        """movej, movel ... and its one or two targets."""
        end = closing(self.text, start - 1)
        if end < 0:
            raise self.document.error(start, f"{instruction}: expected a ) that closes this (")
        for piece in split(self.text, start, end - 1)[: 2 if instruction.endswith("c") else 1]:
            line = self.document.line(start)
            found, frame, near = self._used(piece)
            if found is None:
                self.notes.append(
                    f"{self.document.name}:{line}: {instruction} goes to {' '.join(piece.text.split()):.40}, which is "
                    "no target of plain numbers here, and is left as it is"
                )
            else:
                self.moves.append(Move(found, self.place, line, self.tool, frame, near=near))

    def _used(self, piece: Piece) -> tuple[int | None, str, tuple[float, ...] | None]:
        """The target that an argument means, its frame, and the joints that it is to be near."""
        if inner := _SOLVED.match(piece.text):
            first, *rest = split(self.text, piece.start + inner.end(), piece.end - 1)
            found, frame, near = self._used(first)
            for argument in rest[:1]:
                stated = re.sub(r"^qnear\s*=\s*", "", argument.text)
                literal = self.literals.get(stated, trimmed(self.text, argument.end - len(stated), argument.end))
                if not literal.text.startswith("["):
                    return None, frame, None
                near = tuple(part.si for part in self._numbers(literal, ["rad"] * 6, "qnear"))
            return found, frame, near
        if inner := _TRANSFORMED.match(piece.text):
            first, *rest = split(self.text, piece.start + inner.end(), piece.end - 1)
            label = f"pose_trans of line {self.document.line(piece.start)}"
            values = self._pose(first, label)
            if values is None or len(rest) != 1:
                return None, label, None
            self.frames[label] = orientation.from_vector(np.array([part.si for part in values]))
            return self._used(rest[0])[0], label, None
        name = piece.text
        if name in self.names:
            return self.names[name][0], "base", None
        literal = self.literals.get(name)
        if literal is None and re.match(r"p?\[", piece.text):
            literal, name = piece, f"the target of line {self.document.line(piece.start)}"
        if literal is None:
            return None, "base", None
        posed = literal.text.startswith("p")
        numbers = self._numbers(literal, ["m"] * 3 + ["rad"] * 3 if posed else ["rad"] * 6, name)
        self.targets.append(Target(name, self.document.line(literal.start), "pose" if posed else "joints", numbers))
        if literal is not piece:
            self.names[name] = (len(self.targets) - 1, literal.start)
        return len(self.targets) - 1, "base", None

    def _pose(self, piece: Piece, name: str) -> tuple[Number, ...] | None:
        """The numbers of p[...], or of the name of one."""
        literal = self.literals.get(piece.text, piece)
        return self._numbers(literal, ["m"] * 3 + ["rad"] * 3, name) if literal.text.startswith("p[") else None

    def _numbers(self, literal: Piece, units: list[str], name: str) -> tuple[Number, ...]:
        start = literal.start + literal.text.index("[") + 1
        pieces = split(self.text, start, literal.end - 1)
        if len(pieces) != len(units):
            got = f"{len(pieces)}"
            raise self.document.error(literal.start, f"{name}: expected {len(units)} numbers in brackets, got {got}")
        out = []
        for piece, unit in zip(pieces, units, strict=True):
            if turned := _DEGREES.fullmatch(piece.text):
                at = piece.start + turned.start(1)
                out.append(number(self.document, self.place, Piece(turned[1], at, at + len(turned[1])), "deg", name))
            else:
                out.append(number(self.document, self.place, piece, unit, name))
        return tuple(out)


def read(documents: tuple[Document, ...]) -> Program:
    """The targets of scripts.

    Raises:
        ParseError: A target is not made of the numbers that it needs; names the line.
    """
    targets: list[Target] = []
    moves: list[Move] = []
    tools: dict[str, FloatArray] = {}
    frames: dict[str, FloatArray] = {"base": np.eye(4)}
    notes: list[str] = []
    for place, document in enumerate(documents):
        reader = _Reader(document, place, blanked(document.text, "#"))
        patterns = (_ASSIGNED, _MOVE, _TOOL)
        for match in sorted((m for p in patterns for m in p.finditer(reader.text)), key=re.Match.start):
            if match.re is _ASSIGNED:
                reader.assign(match[1], match.end())
            elif match.re is _TOOL:
                reader.set_tool(match.end())
            else:
                reader.move(match[1], match.end())
        moves += [replace(move, target=move.target + len(targets)) for move in reader.moves]
        targets += reader.targets
        tools |= reader.tools
        frames |= reader.frames
        notes += reader.notes
    return Program(UrScript(), documents, tuple(targets), tuple(moves), tools, frames, notes=tuple(notes))
