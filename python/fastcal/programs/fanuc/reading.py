# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The targets of LS files and what moves go to them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from fastcal.programs.book import SOMEWHERE, Book
from fastcal.programs.fanuc.instructions import Instruction, instructions
from fastcal.programs.fanuc.language import Fanuc
from fastcal.programs.fanuc.positions import Taught, positions
from fastcal.programs.program import Document, Move, Program

_ACTIVE = re.compile(r"^(UFRAME_NUM|UTOOL_NUM)(?:\[GP1\])?\s*=\s*(.*)$", re.I)
_MOVED = re.compile(r"^(UFRAME|UTOOL)\[\s*(?:GP1\s*:\s*)?(\w+)[^\]]*\]\s*=", re.I)
_PAYLOAD = re.compile(r"^PAYLOAD\[\s*(?:GP1\s*:\s*)?(?!GP)(R\[[^\]]*\]|[^:\[\]]*)", re.I)
_TRACKING = re.compile(r"^\s*LINE_TRACK_SCHEDULE_NUMBER\s*:\s*[1-9]", re.M)


def is_program(text: str) -> bool:
    """Is an LS file a program, and not a report of the controller such as LOGBOOK.LS or ERRALL.LS?"""
    return re.search(r"^/(PROG|POS)\b", text, re.M) is not None


def read(documents: tuple[Document, ...]) -> Program:
    """The positions of LS files.

    Raises:
        ParseError: A position is not made of the numbers that it needs; names the line.
    """
    book = Book(documents)
    book.tools["0"], book.frames["0"] = np.eye(4), np.eye(4)
    for place in range(len(documents)):
        _Reader(book, place).read()
    return book.program(Fanuc())


class _Reader:
    """Enters one file into a book."""

    def __init__(self, book: Book, place: int) -> None:
        self.book, self.place, self.document = book, place, book.documents[place]
        self.numbers: dict[int, int] = {}  # of P[n], by its place in the book
        self.no_target: dict[int, str] = {}  # why P[n] is none
        self.active: dict[str, set[str]] = {}  # the numbers of frame and tool that the program chooses
        self.afresh = False

    def read(self) -> None:
        text = self.document.text
        head = re.search(r"^/POS\b", text, re.M)
        if head is None:
            report = "" if is_program(text) else "; a file without /PROG is a controller's report"
            raise self.document.error(0, f"expected a section /POS, as every LS program has{report}")
        self._enter(list(positions(self.document, self.place, head.end())))
        begin = re.search(r"^/MN\b", text[: head.start()], re.M)
        found = list(instructions(text, begin.end() if begin else 0, head.start()))
        for instruction in found:
            self._frames(instruction)
        for instruction in found:
            self._take(instruction)
        if _TRACKING.search(text[: begin.start() if begin else 0]):
            self.book.spoil(list(self.numbers.values()), "the program follows a conveyor")

    def _enter(self, taught: Sequence[Taught]) -> None:
        """The positions; poses on a rail that stands in several places are meant from another base each."""
        rails = {position.external for position in taught if position.target and position.target.kind == "pose"}
        for position in taught:
            if position.target is None:
                self.no_target[position.index] = position.why
                self.book.leave(self.place, position.at, f"P[{position.index}]", position.why)
                continue
            self.numbers[position.index] = len(self.book.targets)
            self.book.kept.add(len(self.book.targets))
            self.book.targets.append(position.target)
            if position.target.kind == "pose" and len(rails) > 1:
                self.book.spoil(
                    [self.numbers[position.index]],
                    f"the external axes ({', '.join(position.external) or 'none'}) move the arm's base from target to "
                    "target, or don't: the program does not say",
                )
        if len(rails) == 1 and (external := next(iter(rails))):
            self.book.notes.append(
                f"{self.document.name}: {', '.join(external)} in all poses: where these axes carry the arm, "
                "the base of the cell file is that of the arm there"
            )
        turned = [p.target.name for p in taught if p.target and next(iter(Fanuc().turns(p.target)), 0)]
        if turned:
            self.book.notes.append(
                f"{self.document.name}: {', '.join(turned[:6])}: the first turn number is taken as that of axis 1, as "
                "$SCR_GRP[1].$TURN_AXIS of public controllers has it; no published pose shows it"
            )

    def _take(self, instruction: Instruction) -> None:
        """A move, or another use of positions."""
        line = self.book.line(self.place, instruction.at)
        for position in instruction.positions:
            known = position.kind == "P" and position.index is not None
            target = self.numbers.get(position.index) if known and position.index is not None else None
            if not instruction.motion:
                if target is not None:
                    self.book.spoil([target], f"'{instruction.text:.60}' uses it otherwise than to go there")
            elif target is None:
                self.afresh = True
                why = self.no_target.get(position.index or 0, "it is not in this file")
                if position.kind == "PR" or position.index is None:
                    why = "a register has it at run time"
                self.book.leave(self.place, instruction.at, f"{instruction.motion} {position.text}", why)
            elif instruction.meant or instruction.unknown:
                self.afresh = True
                unknown = f"'{instruction.unknown}' is not understood"
                self.book.spoil([target], f"{instruction.meant or unknown} in '{instruction.text:.60}'")
            else:
                self._go(target, line, instruction)

    def _go(self, target: int, line: int, instruction: Instruction) -> None:
        taught = self.book.targets[target]
        move = Move(
            target,
            self.place,
            line,
            self._chosen("UTOOL_NUM") if taught.tool is None else None,
            self._chosen("UFRAME_NUM") if taught.frame is None else None,
            SOMEWHERE if instruction.added else None,
            wordless=instruction.wordless,
            afresh=self.afresh,
            loads=tuple(sorted(self.active.get("PAYLOAD", ()))) or (None,),
        )
        self.book.moves.append(move)
        self.afresh = False

    def _chosen(self, what: str) -> str | None:
        """The one frame or tool that the program chooses: with several, jumps decide which of them holds."""
        numbers = self.active.get(what, set())
        only = next(iter(numbers)) if len(numbers) == 1 else ""
        return only if only.isdecimal() else None

    def _frames(self, instruction: Instruction) -> None:
        """UFRAME_NUM=1, PAYLOAD[1], and UFRAME[1]=PR[5], which moves a frame at run time."""
        if chosen := _ACTIVE.match(instruction.text):
            self.active.setdefault(chosen[1].upper(), set()).add(chosen[2].strip())
        elif carried := _PAYLOAD.match(instruction.text):
            self.active.setdefault("PAYLOAD", set()).add(carried[1].strip())
        elif moved := _MOVED.match(instruction.text):
            what = "frame" if moved[1].upper() == "UFRAME" else "tool"
            where = f"line {self.book.line(self.place, instruction.at)} gives {what} {moved[2]} a value at run time"
            if moved[2].isdecimal():
                self.book.doubt(what, moved[2], where)
            else:
                self.book.notes.append(f"{self.document.name}: {where}")
