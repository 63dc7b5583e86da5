# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The targets of a robot program, and where they are in its text."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import InvalidInput, ParseError
from fastcal.ik.posture import SphericalWristArm
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]
Frame = FloatArray | tuple[str | FloatArray, ...]  # a pose (4, 4), or a product of poses and of names of such
Load = float | tuple[str, ...]  # kg, or names of such
Kind = Literal["pose", "joints"]

ACTIVE = "active"  # the tool or the frame that holds where a program begins


@dataclass(frozen=True)
class Document:
    """One file of a program; text is its bytes in latin-1, which gives every byte back.

    Attributes:
        name: The file, for messages.
        text: Its content.
    """

    name: str
    text: str

    def line(self, at: int) -> int:
        """The line, from 1, of the character `at`."""
        return bisect_left(self._line_ends, at) + 1

    @cached_property
    def _line_ends(self) -> list[int]:
        return [match.start() for match in re.finditer("\n", self.text)]

    def error(self, at: int, message: str) -> ParseError:
        """The error of a place in the text; what it quotes of the text is brought to one line."""
        return ParseError(" ".join(message.split()), self.name, self.line(at))


@dataclass(frozen=True)
class Word:
    """A piece of a program's text: document.text[start:end] is `text`."""

    document: int
    start: int
    end: int
    text: str


@dataclass(frozen=True)
class Number(Word):
    """A word that is a number.

    Attributes:
        value: As written there.
        unit: mm, m, deg, rad, or 1 for a plain number.
    """

    value: float
    unit: str

    @property
    def si(self) -> float:
        """Its value in SI."""
        return to_si(self.value, self.unit)


@dataclass(frozen=True)
class Target:
    """A place that a program sends the robot to.

    Attributes:
        name: As the program calls it, or "line 12".
        line: Where its numbers are.
        kind: `pose`: numbers are x, y, z and the language's orientation, of the tool in a frame; `joints`: J1 ... Jn
            of the controller.
        numbers: What a compensation replaces.
        words: What names the configuration, in the language's own words (cf1, S, CONFIG ...).
        tool, frame: Their names where the target itself gives them (FANUC); else its moves do.
    """

    name: str
    line: int
    kind: Kind
    numbers: tuple[Number, ...]
    words: Mapping[str, Word] = field(default_factory=dict)
    tool: str | None = None
    frame: str | None = None

    @property
    def values(self) -> FloatArray:
        """(k,) its numbers in SI."""
        return np.array([number.si for number in self.numbers])


@dataclass(frozen=True)
class Move:
    """A use of a target.

    Attributes:
        target: Its place in `Program.targets`.
        document, line: Where it is.
        tool, frame: What it is meant in; None: the program does not define it.
        offset: Metres along the frame's axes that are added at run time (RAPID's Offs), where they are plain numbers.
        wordless: Does the controller pass over the words of the configuration here, as RAPID does with ConfL off?
        afresh: Is it unknown where the arm comes from, as after a move to joints computed at run time?
        near: Joints [rad] whose nearest solution is meant, where the program states them (URScript's qnear).
        loads: Names of what the arm carries; several where the run decides, None where the program says nothing.
    """

    target: int
    document: int
    line: int
    tool: str | None = None
    frame: str | None = None
    offset: tuple[float, float, float] | None = None
    wordless: bool = False
    afresh: bool = False
    near: tuple[float, ...] | None = None
    loads: tuple[str | None, ...] = (None,)


@dataclass(frozen=True)
class Left:
    """A target, or a place that a program goes to, which is left as it is because it was not understood.

    Attributes:
        document, line: Where it is.
        what: What is left, as the program has it.
        why: The reason, as the end of a sentence.
    """

    document: int
    line: int
    what: str
    why: str


class Language(Protocol):
    """How one language writes poses, configurations and numbers.

    Attributes:
        name: Of the language.
        names_postures: Does it have words for the configuration of a pose?
    """

    name: str
    names_postures: bool

    def pose(self, values: FloatArray) -> FloatArray:
        """T_frame_tool (4, 4) of a target's values in SI."""

    def values(self, T_frame_tool: FloatArray, old: FloatArray) -> FloatArray:
        """The values, in SI, of a pose; of several ways, the one nearest to the old values."""

    def number(self, old: Number, value: float) -> str:
        """The text of a value in the unit and the form of the number that stood there."""

    def branch(self, q: FloatArray, arm: SphericalWristArm) -> tuple[bool | None, ...]:
        """Which of the (up to eight) solutions of a pose q (n,) is, as the words distinguish them; None: unknown."""

    def asked_branch(self, target: Target) -> tuple[bool | None, ...]:
        """The solution that the target's words ask for; empty where they are silent."""

    def asked_turns(self, target: Target) -> dict[int, tuple[float, float]]:
        """Between which positions [rad] the words want a joint (from 0) of the controller: low <= J < high."""

    def words(self, target: Target, q: FloatArray, arm: SphericalWristArm) -> dict[str, str]:
        """The words that name the configuration of q, for those that the target has."""


@dataclass(frozen=True)
class Program:
    """The targets of a program, in the order in which the text uses them.

    Attributes:
        language: How it writes them.
        documents: Its files.
        targets: Those that are made of plain numbers.
        moves: Their uses, in the order of the text.
        tools, frames: Poses that the program itself gives, T_flange_tool and T_base_frame, by name.
        doubts: Why a tool, a frame or a load, by what it is and its name in lower case, cannot be relied upon.
        left: What is left as it is, and why.
        notes: What else a reader should know.
        loads: Masses [kg] that the program itself gives, by name in lower case; a tuple: the sum of those named.
    """

    language: Language
    documents: tuple[Document, ...]
    targets: tuple[Target, ...]
    moves: tuple[Move, ...]
    tools: Mapping[str, Frame] = field(default_factory=dict)
    frames: Mapping[str, Frame] = field(default_factory=dict)
    doubts: Mapping[tuple[str, str], str] = field(default_factory=dict)
    left: tuple[Left, ...] = ()
    notes: tuple[str, ...] = ()
    loads: Mapping[str, Load] = field(default_factory=dict)

    def place(self, target: Target) -> str:
        """File and line of a target, for messages."""
        return f"{self.documents[target.numbers[0].document].name}:{target.line}"

    def said(self, left: Left) -> str:
        """The sentence on what is left."""
        return f"{self.documents[left.document].name}:{left.line}: {left.what} is left as it is: {left.why}"

    def check_targets(self) -> None:
        """Nothing where the program has targets that may be changed.

        Raises:
            InvalidInput: It has none; says what is left, and why.
        """
        if self.targets:
            return
        if not self.left:
            raise InvalidInput(f"{self.documents[0].name}: holds no targets of plain numbers; nothing to compensate")
        first, *more = map(self.said, self.left)
        raise InvalidInput(f"no target can be compensated: {first}" + (f" ({len(more)} more are left)" if more else ""))

    def without(self, dropped: Set[int]) -> Program:
        """The program without some targets and their moves."""
        kept = [i for i in range(len(self.targets)) if i not in dropped]
        places = {old: new for new, old in enumerate(kept)}
        moves = tuple(replace(move, target=places[move.target]) for move in self.moves if move.target in places)
        return replace(self, targets=tuple(self.targets[i] for i in kept), moves=moves)

    def leaving(self, reasons: Mapping[int, str], dropped: Set[int] = frozenset()) -> Program:
        """The program with some targets, by their places, left as they are, each for a reason; some without one."""
        left = [
            Left(self.targets[i].numbers[0].document, self.targets[i].line, self.targets[i].name, reasons[i])
            for i in sorted(reasons)
        ]
        return replace(self.without(reasons.keys() | dropped), left=(*self.left, *left))

    def rewritten(self, changes: Sequence[tuple[Word, str]]) -> tuple[Document, ...]:
        """The documents with the text of some words replaced, and nothing else."""
        out = []
        for place, document in enumerate(self.documents):
            parts, at = [], 0
            for word, text in sorted((c for c in changes if c[0].document == place), key=lambda c: c[0].start):
                parts += [document.text[at : word.start], text]
                at = word.end
            out.append(Document(document.name, "".join([*parts, document.text[at:]])))
        return tuple(out)


def decimal(old: Number, value: float, digits: int) -> str:
    """A number with at least `digits` decimals, as many as there were if those were more, right-aligned as it was."""
    had = len(old.text.partition(".")[2]) if "e" not in old.text.lower() else 0
    text = f"{from_si(value, old.unit):.{max(digits, had)}f}"
    if not float(text):
        text = text.removeprefix("-")
    return text
