# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""ABB RAPID: robtargets and jointtargets, declared, assigned or written into a move.

robtarget: [[x, y, z], [q1, q2, q3, q4], [cf1, cf4, cf6, cfx], [external axes]], mm and a quaternion w, x, y, z.
jointtarget: [[six joints], [external axes]], deg.
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
from fastcal.programs.scanning import NUMBER, Piece, blanked, closing, number, split, trimmed

FloatArray = NDArray[np.float64]

_TYPED = re.compile(r"\b(robtarget|jointtarget|tooldata|wobjdata)\s+(\w+)", re.I)
_VALUE = re.compile(r"\s*(?:\{[\w\s,]*\})?\s*:=\s*(?=\[)")
_ASSIGNED = re.compile(r"\b(\w+)\s*:=\s*(?=\[)")
_MOVE = re.compile(r"(?:^|;)[ \t]*((?:Move|Trigg|Arc|Search|Spot|Paint)\w*)\b[ \t]*(?=[\\\w\[])", re.I | re.M)
_SHIFTED = re.compile(r"(Offs|RelTool)\s*\(", re.I)
_CHANGED = re.compile(
    r"\b(PDispSet|PDispOn|EOffsSet|EOffsOn)\b|\b\w+\.(trans|rot|uframe|oframe|tframe)[.\w]*\s*:=", re.I
)
_POSE_UNITS = ["mm", "mm", "mm", "1", "1", "1", "1"]
_QUARTER = math.pi / 2
_QUATERNION_TOLERANCE = 0.01
_CONFIGURATION = ("cf1", "cf4", "cf6", "cfx")


class Rapid:
    """How RAPID writes poses and configurations."""

    name = "RAPID"
    names_postures = True

    def pose(self, values: FloatArray) -> FloatArray:
        """T of x, y, z and a quaternion."""
        return orientation.from_quaternion(values)

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """x, y, z and a quaternion of T."""
        return orientation.nearest_quaternion(orientation.to_quaternion(T_frame_tool), old)

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


@dataclass
class _Reader:
    """Collects the content of a program's modules; names in RAPID are case-insensitive."""

    documents: tuple[Document, ...]
    texts: list[str]
    types: dict[str, str] = field(default_factory=dict)
    targets: list[Target] = field(default_factory=list)
    moves: list[Move] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=dict)
    tools: dict[str, FloatArray] = field(default_factory=dict)
    frames: dict[str, FloatArray] = field(default_factory=dict)
    standing: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def assign(self, place: int, start: int, name: str) -> None:
        """What is given to a name whose type is known: a target, an array of them, a tool or a work object."""
        text, kind, key = self.texts[place], self.types.get(name.lower()), name.lower()
        if kind is None:
            return
        end = closing(text, start)
        if end < 0:
            raise self.documents[place].error(start, f"{name}: expected a ] that closes this [")
        parts = split(text, start + 1, end - 1)
        if len(parts) != {"tooldata": 3, "wobjdata": 5}.get(kind, len(parts)):
            raise self.documents[place].error(start, f"{name}: expected the parts of a {kind}, got {len(parts)}")
        if kind == "tooldata":
            self.tools[key] = self._frame(place, parts[1], name)
            if parts[0].text.upper() == "FALSE":
                self.standing[key] = "a stationary tool"
        elif kind == "wobjdata":
            self.frames[key] = self._frame(place, parts[3], name) @ self._frame(place, parts[4], name)
            if parts[0].text.upper() == "TRUE" or parts[1].text.upper() == "FALSE":
                self.standing[key] = "a work object that a robot or an axis moves"
        elif parts[0].text.startswith("[["):
            for count, part in enumerate(parts, start=1):
                self.names[f"{key}{{{count}}}"] = self.target(place, part, f"{name}{{{count}}}", kind)
        else:
            self.names[key] = self.target(place, trimmed(text, start, end), name, kind)

    def target(self, place: int, piece: Piece, name: str, kind: str) -> int:
        """Adds a target and gives its place."""
        document = self.documents[place]
        posed = kind == "robtarget"
        groups = self._groups(place, piece)
        if [len(group) for group in groups] != ([3, 4, 4, 6] if posed else [6, 6]):
            form = "[[x,y,z],[q1,q2,q3,q4],[cf1,cf4,cf6,cfx],[6 external axes]]" if posed else "[[6 joints],[6 axes]]"
            shape = " + ".join(str(len(group)) for group in groups)
            raise document.error(piece.start, f"{name}: expected a {kind} {form} of plain numbers, got {shape} of them")
        words: dict[str, Word] = {}
        own = 2 if posed else 1
        for part in (part for group in groups[own:] for part in group):
            number(document, place, part, "1", name)
        units = _POSE_UNITS if posed else ["deg"] * 6
        numbers = self._numbers(place, groups[:own], units, name)
        if posed:
            self._check_quaternion(document, numbers, name)
            words = {key: Word(place, p.start, p.end, p.text) for key, p in zip(_CONFIGURATION, groups[2], strict=True)}
        self.targets.append(Target(name, document.line(piece.start), "pose" if posed else "joints", numbers, words))
        return len(self.targets) - 1

    def move(self, place: int, start: int, instruction: str) -> None:
        """A motion instruction: its targets, the tool as its last argument, the work object as an option."""
        document, text = self.documents[place], self.texts[place]
        end = text.find(";", start)
        end = len(text) if end < 0 else end
        wobj = re.search(r"\\\s*WObj\s*:=\s*(\w+)", text[start:end], re.I)
        plain = [part for part in split(text, start, end) if part.text and not part.text.startswith("\\")]
        tool = re.match(r"\w+", plain[-1].text) if len(plain) > 1 else None
        names = (tool[0] if tool else None, wobj[1] if wobj else "wobj0")
        for name in names:
            if name and name.lower() in self.standing:
                raise document.error(start, f"{name} is {self.standing[name.lower()]}, which fastcal does not follow")
        kind = "jointtarget" if instruction.lower().startswith(("moveabsj", "moveextj")) else "robtarget"
        for part in plain[: 2 if re.search(r"C$|^MoveC", instruction, re.I) else 1]:
            found, offset = self._used(place, part, kind)
            if found is None:
                shown = re.sub(r"\s*\\.*", "", part.text)
                self.notes.append(
                    f"{document.name}:{document.line(start)}: {instruction} goes to {shown:.40}, which is no target of "
                    "plain numbers here, and is left as it is"
                )
            else:
                self.moves.append(Move(found, place, document.line(start), *names, offset))

    def _used(self, place: int, part: Piece, kind: str) -> tuple[int | None, tuple[float, float, float] | None]:
        """The target that an argument means, and what is added to it."""
        text = self.texts[place]
        if part.text.startswith("["):
            piece = trimmed(text, part.start, closing(text, part.start))
            return self.target(place, piece, f"the target of line {self.documents[place].line(part.start)}", kind), None
        if shifted := _SHIFTED.match(part.text):
            end = closing(text, part.start + shifted.end() - 1)
            if end < 0:
                raise self.documents[place].error(part.start, f"{shifted[1]}: expected a ) that closes this (")
            inner = split(text, part.start + shifted.end(), end - 1)
            found, before = self._used(place, inner[0], kind)
            plain = [p for p in inner[1:] if re.fullmatch(NUMBER, p.text)]
            if before is not None or shifted[1].lower() != "offs" or len(plain) != 3:
                return found, (math.nan, math.nan, math.nan)
            x, y, z = (number(self.documents[place], place, p, "mm", "Offs").si for p in plain)
            return found, (x, y, z)
        name = re.match(r"\w+(?:\{\d+\})?", part.text)
        rest = part.text[name.end() :].strip() if name else "?"
        return self.names.get(name[0].lower()) if name and rest[:1] in ("", "\\") else None, None

    def _frame(self, place: int, piece: Piece, name: str) -> FloatArray:
        """[[x, y, z], [q1, q2, q3, q4]] as a pose."""
        groups = self._groups(place, piece)
        if [len(group) for group in groups] != [3, 4]:
            raise self.documents[place].error(piece.start, f"{name}: expected a pose [[x,y,z],[q1,q2,q3,q4]]")
        numbers = self._numbers(place, groups, _POSE_UNITS, name)
        self._check_quaternion(self.documents[place], numbers, name)
        return orientation.from_quaternion(np.array([part.si for part in numbers]))

    def _groups(self, place: int, piece: Piece) -> list[list[Piece]]:
        """[[...], [...]] as lists of pieces; a value without brackets is a list of one."""
        text = self.texts[place]
        return [
            split(text, part.start + 1, part.end - 1) if part.text.startswith("[") else [part]
            for part in split(text, piece.start + 1, piece.end - 1)
        ]

    def _numbers(self, place: int, groups: list[list[Piece]], units: list[str], name: str) -> tuple[Number, ...]:
        pieces = [piece for group in groups for piece in group]
        return tuple(number(self.documents[place], place, p, u, name) for p, u in zip(pieces, units, strict=True))

    @staticmethod
    def _check_quaternion(document: Document, numbers: tuple[Number, ...], name: str) -> None:
        length = math.hypot(*(part.value for part in numbers[3:]))
        if abs(length - 1) > _QUATERNION_TOLERANCE:
            raise document.error(numbers[3].start, f"{name}: expected a quaternion of length 1, got {length:.4g}")


def read(documents: tuple[Document, ...]) -> Program:
    """The targets of RAPID modules.

    Raises:
        ParseError: A target is not made of the numbers that it needs; names the line.
    """
    reader = _Reader(documents, [blanked(document.text, "!") for document in documents])
    declared: set[tuple[int, int]] = set()
    for place, text in enumerate(reader.texts):
        reader.types |= {m[2].lower(): m[1].lower() for m in _TYPED.finditer(text)}
        for match in _CHANGED.finditer(text):
            line = documents[place].line(match.start())
            reader.notes.append(f"{documents[place].name}:{line}: {match[0].strip()} is not followed")
    for place, text in enumerate(reader.texts):
        # Declarations hold in the whole module, before or after their use.
        for match in _TYPED.finditer(text):
            if value := _VALUE.match(text, match.end()):
                reader.assign(place, value.end(), match[2])
                declared.add((place, value.end()))
    for place, text in enumerate(reader.texts):
        for match in sorted([*_MOVE.finditer(text), *_ASSIGNED.finditer(text)], key=re.Match.start):
            if match.re is _MOVE:
                reader.move(place, match.end(1), match[1])
            elif (place, match.end()) not in declared:
                reader.assign(place, match.end(), match[1])
    return Program(
        Rapid(),
        documents,
        tuple(reader.targets),
        tuple(reader.moves),
        {"tool0": np.eye(4), **reader.tools},
        {"wobj0": np.eye(4), **reader.frames},
        notes=tuple(reader.notes),
    )
