# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The instructions of the section /MN of an LS file: moves by their signature, and what else names a position.

A move is J, L, C, A or S, one or two positions, a speed, a termination and options. An option is one that leaves the
position where it is, one that adds something to it at run time, or one that gives it another meaning; any other word is
not understood, and neither is the move. Source: FANUC R-30iB, HandlingTool, operator's manual (B-83284EN), 4.3 Motion
instructions, and the manuals of the options Arc, Spot, Line Tracking and Multi-arm.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

MOVES = frozenset("JLCAS")


@dataclass(frozen=True)
class Position:
    """A position that an instruction names: P[3], PR[1], P[R[5]].

    Attributes:
        kind: P or PR.
        index: Its number; None where a register holds it.
        text: As it stands there, without its comment.
    """

    kind: str
    index: int | None
    text: str


@dataclass(frozen=True)
class Instruction:
    """One instruction.

    Attributes:
        at: Where it begins in the document.
        text: Without its number, in one line.
        motion: J, L, C, A or S; "" where it moves nothing.
        positions: That it names, in their order.
        added: Does it add something to its positions at run time?
        meant: Why its positions are not poses of the tool in their frame; "" where they are.
        unknown: The first word of a move that is not understood, "" where all are.
        wordless: Does the controller pass over the configuration (Wjnt)?
    """

    at: int
    text: str
    motion: str = ""
    positions: tuple[Position, ...] = ()
    added: bool = False
    meant: str = ""
    unknown: str = ""
    wordless: bool = False


_NUMBERED = re.compile(r"^[ \t]*(\d*)[ \t]*:(?!:)", re.M)
_WORD = re.compile(
    r"(?P<comment>!.*|//.*|--eg:.*)"
    r"|(?P<text>'[^']*'|\"[^\"]*\")"
    r"|(?P<name>[A-Za-z_$][\w$]*(?:[.\-][A-Za-z]\w*)*)"
    r"|(?P<number>\d+\.?\d*|\.\d+)"
    r"|(?P<sign>[\[\]()]|\S)"
)

# Words of a move behind its positions. A register in brackets, a sign or a number after one is part of it.
_UNITS = "mm cm in inch sec msec min deg rad s % m"
_STAY = (
    "FINE CNT CR CD ACC PTH WJNT MROT MINROT BREAK EV IND.EV RT_LD AP_LD LD SKIP LBL TB TA DB POINT_LOGIC P-SPS "
    "SPOT PRESS_MOTN ARC START END WEAVE WELD_SPEED MAX_SPEED SEARCH TIMEBEFORE TIMEAFTER DISTANCE PROC CTV "
    "R AR DO RO GO AO F M ON OFF PULSE LPOS JPOS CORNER_REGION PSPI "
    "ZEIT VOR NACH SEK AUFRUF"  # of controllers that speak German
)
_ADD = "OFFSET TOOL_OFFSET WKZ_OFFSET VOFFSET VR"
_MEAN = {
    "INC": "the move goes on by it as an increment",
    "COORD": "the move is coordinated with another group, and meant in what that one carries",
    "RTCP": "the tool is outside, and the position that of the part",
    "TRACK": "the move follows a conveyor",
    "FPLIN": "the move follows a conveyor",
}
_KNOWN = frozenset(f"{_UNITS} {_STAY} {_ADD}".upper().split())
_ADDS = frozenset(_ADD.split())


def instructions(text: str, start: int, end: int) -> Iterator[Instruction]:
    """The instructions of text[start:end]; one goes on in lines that begin with a colon alone, up to its semicolon."""
    heads = [*_NUMBERED.finditer(text, start, end)]
    parts: list[tuple[int, int]] = []
    for head, stop in zip(heads, [*(after.start() for after in heads[1:]), end], strict=False):
        if head[1] or not parts:
            if parts:
                yield _instruction(text, parts)
            parts = []
        parts.append((head.end(), stop))
    if parts:
        yield _instruction(text, parts)


def _instruction(text: str, parts: list[tuple[int, int]]) -> Instruction:
    whole = " ".join(text[start:stop] for start, stop in parts)
    at = parts[0][0] + len(whole) - len(whole.lstrip())
    line = " ".join(whole.split()).removesuffix(";").strip()
    return _Words(line).instruction(at)


@dataclass
class _Words:
    """The words of an instruction, read one by one."""

    line: str
    words: list[tuple[str, str]] = field(init=False)
    at: int = 0

    def __post_init__(self) -> None:
        found = ((str(m.lastgroup), m[0]) for m in _WORD.finditer(self.line))
        self.words = [word for word in found if word[0] != "comment"] if not self._is_comment() else []

    def instruction(self, at: int) -> Instruction:
        kind, word = self._next()
        if kind != "name" or word.upper() not in MOVES:
            return Instruction(at, self.line, positions=self._all_positions())
        motion, positions = word.upper(), []
        self.at += 1
        while (position := self._position()) is not None:
            positions.append(position)
        if not positions:
            # PAL_1[A_1], or no move at all, such as the register A.
            self.at = 0
            named = self._all_positions()
            return Instruction(at, self.line, motion="", positions=named)
        added, meant, unknown = self._options()
        wordless = ("name", "WJNT") in [(kind, word.upper()) for kind, word in self.words]
        return Instruction(at, self.line, motion, tuple(positions), added, meant, unknown, wordless)

    def _is_comment(self) -> bool:
        return self.line.startswith(("!", "//", "--eg:"))

    def _next(self, ahead: int = 0) -> tuple[str, str]:
        place = self.at + ahead
        return self.words[place] if place < len(self.words) else ("end", "")

    def _position(self) -> Position | None:
        """P[3:comment] at this place, and the words behind it are next."""
        kind, word = self._next()
        if kind != "name" or word.upper() not in ("P", "PR") or self._next(1)[1] != "[":
            return None
        self.at += 1
        inside = self._brackets()
        index = inside.partition(":")[0].strip()
        text = f"{word.upper()}[{index}]"
        return Position(word.upper(), int(index) if index.isdecimal() else None, text)

    def _brackets(self) -> str:
        """What is in the brackets that open at this place; the words behind them are next."""
        depth, parts = 0, []
        while self._next()[0] != "end":
            word = self._next()[1]
            self.at += 1
            depth += {"[": 1, "]": -1}.get(word, 0)
            if depth == 0:
                break
            parts.append(word)
        return "".join(parts[1:])

    def _all_positions(self) -> tuple[Position, ...]:
        """All P[...] and PR[...] of the rest."""
        found = []
        while self._next()[0] != "end":
            position = self._position()
            if position is None:
                self.at += 1
            else:
                found.append(position)
        return tuple(found)

    def _options(self) -> tuple[bool, str, str]:
        """Whether something is added, why the positions mean something else, the first word that is not known."""
        added, meant, unknown = False, "", ""
        while self._next()[0] != "end":
            kind, word = self._next()
            if word == "[":
                self._brackets()
                continue
            self.at += 1
            name = re.sub(r"\d+$", "", word.upper()) if kind == "name" else ""
            if kind != "name":
                continue
            if name in ("CALL", "AUFRUF"):
                self._program()
            elif name in ("PR", "P"):
                continue  # the register of an option
            elif name in _MEAN:
                meant = meant or _MEAN[name]
            elif name in _ADDS:
                added = True
            elif name not in _KNOWN and not unknown:
                unknown = word
        return added, meant, unknown

    def _program(self) -> None:
        """A program's name and arguments behind CALL."""
        if self._next()[0] == "name":
            self.at += 1
        if self._next()[1] == "(":
            while self._next()[0] != "end" and self._next()[1] != ")":
                self.at += 1
