# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The targets of RAPID modules and what moves go to them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.programs import orientation
from fastcal.programs.book import NOWHERE, SOMEWHERE, Book, Place, any_of, load_changes
from fastcal.programs.flow import State, Walker
from fastcal.programs.program import Document, Program
from fastcal.programs.rapid.language import Rapid
from fastcal.programs.rapid.moves import moves, roles
from fastcal.programs.rapid.statements import routines
from fastcal.programs.syntax import Node, Routine, Statement
from fastcal.said import said
from fastcal.units import to_si

_POSE_UNITS = ("mm", "mm", "mm", "1", "1", "1", "1")
_CONFIGURATION = ("cf1", "cf4", "cf6", "cfx")
_QUATERNION_TOLERANCE = 0.01
_CONTROLS = re.compile(r"[\x00-\x08\x0e-\x1f\x7f-\x9f]")
_DATA = {"TOOLDATA": ("tool", "load"), "WOBJDATA": ("frame",), "LOADDATA": ("load",)}  # what a type says
_DISPLACED = "displaced"
_DISPLACES = {"PDISPSET", "PDISPON", "EOFFSSET", "EOFFSON"}
_REPLACES = {"PDISPOFF"}
# Calls that read what they are given, and change nothing of where the robot goes.
_ONLY_READ = {"TPWRITE", "UIMSGBOX", "WRITE", "ERRWRITE", "STORE"}
_SETS = {"SET", "RESET", "SETDO", "SETGO", "SETAO", "WAITTIME", "WAITUNTIL", "VELSET", "ACCSET"}  # signals and speeds


def read(documents: tuple[Document, ...]) -> Program:
    """The targets of RAPID modules."""
    book = Book(documents, origins=frozenset({"wobj0"}))
    book.tools["tool0"], book.frames["wobj0"], book.loads["load0"] = np.eye(4), np.eye(4), 0.0
    found: list[Routine] = []
    for place, document in enumerate(documents):
        if len(_CONTROLS.findall(document.text)) > len(document.text) / 20:
            book.leave(place, 0, "the module", "it is encoded, not plain text; save it from the controller as text")
        else:
            found += routines(document.text, place)
    reader = _Reader(book, found, State())
    for routine in found:
        for statement in routine.statements:
            if statement.kind == "declare":
                reader.define(statement, routine.document)
    reader.run()
    return book.program(Rapid())


class _Reader(Walker):
    """Goes through modules; names in RAPID are the same in upper and lower case."""

    loops = frozenset({"FOR", "WHILE"})
    cases = frozenset({"TEST"})
    only_read = frozenset(_ONLY_READ | _SETS | _DISPLACES | {"CONFL", "CONFJ", "GRIPLOAD"})

    def __init__(self, book: Book, found: Sequence[Routine], start: State) -> None:
        super().__init__(book, found, start)
        self._types: dict[str, str] = {}

    def define(self, statement: Statement, document: int) -> None:
        """A declaration: the type of a name, and where a tool or a work object is."""
        name, *value = statement.parts
        if not value and self.key(name.text) in self._types:
            return
        self._types[self.key(name.text)] = statement.name
        parts = value[0].parts if value and value[0].kind == "list" else ()
        self.document = document
        words = ["" if part.kind != "name" else part.text.upper() for part in parts]
        if statement.name == "TOOLDATA" and len(parts) == 3 and (T := self._pose(parts[1])) is not None:
            self.book.tools[name.text.lower()] = T
            if parts[2].parts:
                self._weigh(name, parts[2].parts[0])
            if words[0] == "FALSE":
                self.book.doubt("tool", name.text, f"{name.text} is a stationary tool, which fastcal does not follow")
        elif statement.name == "LOADDATA" and parts:
            self._weigh(name, parts[0])
        elif statement.name == "WOBJDATA" and len(parts) == 5:
            user, inner = self._pose(parts[3]), self._pose(parts[4])
            if user is not None and inner is not None:
                self.book.frames[name.text.lower()] = user @ inner
            if words[0] == "TRUE" or words[1] == "FALSE":
                why = f"{name.text} is a work object that a robot or an axis moves, which fastcal does not follow"
                self.book.doubt("frame", name.text, why)

    def _weigh(self, name: Node, mass: Node) -> None:
        """The mass of a tool, or of a load in it."""
        self.book.weigh(name.text, self.number(mass), self.book.line(self.document, mass.start))

    def _pose(self, node: Node) -> FloatArray | None:
        """[[x, y, z], [q1, q2, q3, q4]] as a pose; None where it is none."""
        if [len(part.parts) for part in node.parts] != [3, 4]:
            return None
        numbers = [self.number(piece) for part in node.parts for piece in part.parts]
        if any(number is None for number in numbers):
            return None
        values = np.array([to_si(number or 0.0, unit) for number, unit in zip(numbers, _POSE_UNITS, strict=True)])
        if abs(np.linalg.norm(values[3:]) - 1) > _QUATERNION_TOLERANCE:
            return None
        return orientation.from_quaternion(values)

    def key(self, name: str) -> str:
        return name.upper()

    def statement(self, statement: Statement) -> None:
        if statement.kind == "declare":
            self._declare(statement)
        elif statement.kind == "assign":
            self._assign(statement)
        elif statement.kind == "call":
            self._instruction(statement)
        elif statement.kind == "unknown":
            self.not_followed(statement)
        else:
            self.read(statement)

    def place(self, node: Node, name: str = "") -> Place:
        if node.kind == "name" and self._types.get(self.key(node.text)) in ("TOOLDATA", "WOBJDATA", "LOADDATA"):
            return Place(name=node.text)
        return super().place(node, name)

    def literal(self, node: Node, name: str) -> Place | None:
        if node.kind != "list":
            return None
        shape = [len(part.parts) if part.kind == "list" else 0 for part in node.parts]
        numbers = [piece for part in node.parts for piece in part.parts]
        form = (self.document, node.start)
        if node.parts and node.parts[0].kind == "list" and all(part.kind != "list" for part in node.parts[0].parts):
            expected = "[[6 joints],[6 axes]]"
            if len(shape) > 2:
                expected = "[[x,y,z],[q1,q2,q3,q4],[cf1,cf4,cf6,cfx],[6 axes]]"
            self.book.unread[form] = f"expected {expected}, got {' + '.join(map(str, shape))} numbers"
        if shape == [3, 4, 4, 6]:
            words = dict(zip(_CONFIGURATION, numbers[7:11], strict=True))
            if any(self.book.number(self.document, word, "1") is None for word in words.values()):
                return NOWHERE
            posed = list(zip(numbers[:7], _POSE_UNITS, strict=True))
            target = self.book.target(self.document, node, "pose", posed, name, words)
            return NOWHERE if target is None else self._checked(node, target)
        if shape == [6, 6]:
            target = self.book.target(self.document, node, "joints", [(n, "deg") for n in numbers[:6]], name)
            return NOWHERE if target is None else Place((target,))
        if node.parts and all(part.kind == "list" for part in node.parts) and min(shape) > 0:
            elements = tuple(self.place(part, f"{name}{{{k}}}") for k, part in enumerate(node.parts, start=1))
            if any(element.targets for element in elements):
                return Place(any_of(elements).targets, elements=elements)
        return NOWHERE

    def _checked(self, node: Node, target: int) -> Place:
        """A robtarget whose quaternion has the length 1."""
        length = math.hypot(*(number.value for number in self.book.targets[target].numbers[3:]))
        if abs(length - 1) <= _QUATERNION_TOLERANCE:
            return Place((target,))
        self.book.unread[self.document, node.start] = f"expected a quaternion of length 1, got {length:.4g}"
        return NOWHERE

    def function(self, node: Node) -> Place:
        arguments = [part for part in node.parts if part.kind != "named"]
        if node.text.upper() in ("OFFS", "RELTOOL") and arguments:
            return self._shifted(self.place(arguments[0]), node, arguments[1:])
        self.call(node.text, [self.place(part) for part in arguments])
        return NOWHERE

    def _shifted(self, place: Place, node: Node, by: list[Node]) -> Place:
        offsets = [self.number(part) for part in by]
        known = node.text.upper() == "OFFS" and len(by) == 3 and place.offset is None and None not in offsets
        x, y, z = (float(to_si(value or 0.0, "mm")) for value in offsets) if known else SOMEWHERE
        return replace(place, offset=(x, y, z), elements=()) if place.targets else NOWHERE

    def _declare(self, statement: Statement) -> None:
        name, *value = statement.parts
        if not value or statement.name not in ("ROBTARGET", "JOINTTARGET"):
            return
        place = self.place(value[0], name.text)
        if not place.targets and value[0].kind == "list":
            self.book.leave(self.document, name.start, name.text, self.book.reason(self.document, value[0]))
        self.book.kept.update(place.targets)

    def _assign(self, statement: Statement) -> None:
        root = statement.parts[0]
        while root.kind in ("field", "index"):
            root = root.parts[0]
        what = _DATA.get(self._types.get(self.key(root.text), ""), ())
        if not what:
            self.assign(statement)
            return
        where = said("line {line}", line=self.book.line(self.document, statement.start))
        for each in what:
            why = f"{each} {root.text} is changed at run time, in {where}"
            self.book.doubt(each, root.text, load_changes(root.text, where) if each == "load" else why)
        self.takes_as_frame(statement.start, *statement.parts[1:])

    def _instruction(self, statement: Statement) -> None:
        """A move, what switches how moves are meant, or a call."""
        name = statement.name.upper()
        plain = [part for part in statement.parts if part.kind != "named"]
        if moves(name) and self.key(name) not in self.routines:
            self._move(statement, plain)
        elif name in ("CONFL", "CONFJ"):
            switch = next((part.text.upper() for part in statement.parts), "ON")
            self._switch(name, on=switch == "OFF")
        elif name == "GRIPLOAD" and plain:
            self.state = replace(self.state, loads=(self._name(plain[0]),))
        elif name in _DISPLACES | _REPLACES:
            self._switch(_DISPLACED, on=name in _DISPLACES)
            self.spoil(statement)
        elif not self.call(name, [self.place(part) for part in plain]) and name not in _ONLY_READ:
            self.spoil(statement)

    def _switch(self, name: str, *, on: bool) -> None:
        switches = self.state.switches | {name} if on else self.state.switches - {name}
        self.state = replace(self.state, switches=switches)

    def _move(self, statement: Statement, plain: list[Node]) -> None:
        asked = roles(statement.name, len(plain))
        if asked is None:
            self.spoil(statement)
            self._leave(statement, "its arguments are not those that this instruction has")
            return
        given = {part.text.upper(): part.parts[0] for part in statement.parts if part.kind == "named" and part.parts}
        wobj, whole = given.get("WOBJ"), given.get("TLOAD")
        tool = plain[asked.index("tool")] if "tool" in asked else None
        names = [None if tool is None else self._name(tool), "wobj0" if wobj is None else self._name(wobj)]
        loads = self._carried(names[0], None if whole is None else self._name(whole))
        linear = "J" not in statement.name.upper()
        for role, argument in zip(asked, plain, strict=True):
            if role in ("found", "external"):
                self.spoil(statement, argument)
                if role == "external":
                    self._leave(statement, f"{statement.name} moves external axes alone")
            elif role in ("via", "point", "joints"):
                self._go(statement, argument, names, loads, is_linear=linear)

    def _carried(self, tool: str | None, whole: str | None) -> tuple[str | None, ...]:
        """The tool with what GripLoad put into it, or TLoad instead of both; tool0 says nothing of what it carries."""
        if whole is not None and whole.lower() != "load0":
            return (whole,)
        own = [] if tool is None or tool.lower() == "tool0" else [tool]
        found: list[str | None] = []
        for load in self.state.loads:
            parts = own if load is None or load.lower() == "load0" else [*own, load]
            if len(parts) > 1:
                self.book.loads[" with ".join(parts).lower()] = tuple(parts)
            found.append(" with ".join(parts) if parts else load)
        return tuple(found)

    def _go(
        self,
        statement: Statement,
        argument: Node,
        names: list[str | None],
        loads: tuple[str | None, ...],
        *,
        is_linear: bool,
    ) -> None:
        place = self.place(argument)
        if not place.targets:
            self.spoil(statement, argument)
            self._leave(statement, self.book.reason(self.document, argument))
            self.state = replace(self.state, afresh=self.state.afresh or not is_linear)
            return
        if _DISPLACED in self.state.switches:
            place = replace(place, offset=SOMEWHERE)
        switch = "CONFL" if is_linear else "CONFJ"
        self.book.go(
            *(place, self.document, statement.start, names[1]),
            tool=names[0],
            wordless=switch in self.state.switches,
            afresh=self.state.afresh,
            loads=loads,
        )
        self.state = replace(self.state, afresh=False)

    def _name(self, node: Node) -> str:
        """The name of a tool or a work object, or the text that stands for it."""
        return self.place(node).name or self.book.shown(self.document, node.start, node.end)

    def _leave(self, statement: Statement, why: str) -> None:
        self.book.leave(self.document, statement.start, statement.name, why)
