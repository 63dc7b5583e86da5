# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The targets of KRL files and what moves go to them; tool and base are those that hold there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fastcal.programs import orientation
from fastcal.programs.book import NOWHERE, Book, Place, product
from fastcal.programs.flow import State, Walker
from fastcal.programs.krl.language import Krl
from fastcal.programs.krl.statements import MOTIONS, routines
from fastcal.programs.program import Document, Program
from fastcal.programs.syntax import Node, Routine, Statement
from fastcal.units import to_si

_POSE, _JOINTS = ("X", "Y", "Z", "A", "B", "C"), ("A1", "A2", "A3", "A4", "A5", "A6")
_TARGETS = {"E6POS", "POS", "E6AXIS", "AXIS"}
_ORIGINS = {"$NULLFRAME", "$WORLD"}
_HERE = {"$AXIS_ACT", "$POS_ACT", "$AXIS_INT", "$POS_INT", "$AXIS_RET", "$POS_RET"}
_DATA = {"TOOL_DATA": "tool", "BASE_DATA": "frame"}
_ACTIVE = {"$TOOL": "tool", "$BASE": "frame"}
_LOADS = {"$LOAD", "LOAD_DATA"}
_NUMBERS = {"TOOL_NO", "BASE_NO"}  # components that are the number of a tool or a base


def read(documents: tuple[Document, ...]) -> Program:
    """The targets of KRL files; lists (.dat) are read before what moves (.src)."""
    book = Book(documents, origins=frozenset({"0"}))
    book.tools["0"], book.frames["0"] = np.eye(4), np.eye(4)
    order = sorted(range(len(documents)), key=lambda place: not documents[place].name.lower().endswith(".dat"))
    _Reader(book, [routine for place in order for routine in routines(documents[place].text, place)], State()).run()
    return book.program(Krl())


class _Reader(Walker):
    """Goes through files; names in KRL are the same in upper and lower case."""

    loops = frozenset({"FOR", "WHILE", "LOOP", "REPEAT"})
    cases = frozenset({"SWITCH"})
    only_read = frozenset({"BAS"})

    def __init__(self, book: Book, found: Sequence[Routine], start: State) -> None:
        super().__init__(book, found, start)
        self._outside: list[State] = []

    def key(self, name: str) -> str:
        return name.upper()

    def statement(self, statement: Statement) -> None:
        if statement.kind == "declare":
            self._declare(statement)
        elif statement.kind == "assign":
            self._assign(statement)
        elif statement.kind == "call" and statement.name in MOTIONS:
            self._move(statement)
        elif statement.kind == "call" and statement.name.endswith("SPLINE"):
            self._block(statement)
        elif statement.kind == "call" and statement.name.upper() == "BAS":
            self._bas(statement)
        elif statement.kind == "call":
            if not self.call(statement.name, [self.place(part) for part in statement.parts]):
                self.spoil(statement)
        elif statement.kind == "unknown":
            self.not_followed(statement)
        elif statement.name in ("INTERRUPT", "TRIGGER"):  # what they call is called at a time that is not known
            self.spoil(statement)
        else:
            self.read(statement)

    # What expressions mean.

    def place(self, node: Node, name: str = "") -> Place:
        if node.kind == "infix" and node.text == ":":
            return product(self.place(node.parts[0]), self.place(node.parts[1]))
        if node.kind == "name" and node.text.upper() in _ORIGINS:
            return Place(name="0", T=np.eye(4))
        if node.kind == "name" and node.text.upper() in _ACTIVE:
            what = _ACTIVE[node.text.upper()]
            return Place(name=self.state.tool if what == "tool" else self.state.frame)
        if node.kind == "index" and node.text.upper() in _DATA:
            number = self.number(node.parts[1]) if len(node.parts) == 2 else None
            return NOWHERE if number is None else Place(name=f"{number:g}")
        if node.kind == "field":
            return self._field(node)
        return super().place(node, name)

    def literal(self, node: Node, name: str) -> Place | None:
        if node.kind != "record":
            return None
        parts = {part.text: part.parts[0] for part in node.parts}
        if parts.keys() >= set(_JOINTS):
            target = self.book.target(self.document, node, "joints", [(parts[key], "deg") for key in _JOINTS], name)
            return NOWHERE if target is None else Place((target,))
        if not parts.keys() >= set(_POSE) or "A1" in parts:
            return NOWHERE
        words: dict[str, Node] = {key: parts[key] for key in ("S", "T") if key in parts}
        for key, word in words.items():
            if word.kind != "number" or not _is_whole(word.text):
                shown = self.book.shown(self.document, word.start, word.end)
                self.book.unread[self.document, node.start] = f"expected a number as {key}, got {shown}"
                return NOWHERE
        values = [self.number(parts[key]) for key in _POSE]
        T = None
        if None not in values:
            units = ("mm", "mm", "mm", "deg", "deg", "deg")
            T = orientation.from_zyx(np.array([to_si(v or 0.0, unit) for v, unit in zip(values, units, strict=True)]))
        numbers = [(parts[key], "mm" if key in "XYZ" else "deg") for key in _POSE]
        target = self.book.target(self.document, node, "pose", numbers, name, words)
        return Place(() if target is None else (target,), T=T)

    def function(self, node: Node) -> Place:
        """STOOL2(FP1) and SBASE(FP1.BASE_NO) are the tool and the base of FP1; others give nothing that is known."""
        called = node.text.upper()
        if called in ("STOOL2", "STOOL", "SBASE") and len(node.parts) == 1:
            inner = node.parts[0]
            if inner.kind == "name":
                return self._of(inner, "BASE_NO" if called == "SBASE" else "TOOL_NO")
            place = self.place(inner)
            return place if place.number is None else Place(name=f"{place.number:g}")
        self.call(node.text, [self.place(part) for part in node.parts])
        return NOWHERE

    def _field(self, node: Node) -> Place:
        """FP1.BASE_NO, of a record that is written out."""
        return self._of(node.parts[0], node.text.upper())

    def _of(self, name: Node, component: str) -> Place:
        record = self._record(name) if component in _NUMBERS else {}
        number = self.number(record[component]) if component in record else None
        return NOWHERE if number is None else Place(name=f"{number:g}")

    def _record(self, name: Node) -> dict[str, Node]:
        """The components that a name is given, where it is given them once."""
        given = self.assigned.get(self.variable(name) or "", [])
        if len(given) != 1 or given[0].node.kind != "record":
            return {}
        return {part.text: part.parts[0] for part in given[0].node.parts}

    # What statements do.

    def _declare(self, statement: Statement) -> None:
        name, *value = statement.parts
        if not value:
            if statement.name not in _TARGETS:  # an instruction that is not known, KLIN XA, reads like INT I
                self.spoil(statement, name)
            return
        place = self.place(value[0], self.book.shown(self.document, name.start, name.end))
        if statement.name not in _TARGETS:
            return
        if not place.targets:
            shown = self.book.shown(self.document, name.start, name.end)
            self.book.leave(self.document, name.start, shown, self._why(value[0]))
        self.book.kept.update(place.targets)
        tool, frame = self._taught(f"F{name.text[1:]}")
        for target in place.targets:
            self.book.targets[target] = replace(self.book.targets[target], tool=tool, frame=frame)

    def _taught(self, fdat: str) -> tuple[str | None, str | None]:
        """Tool and base of an FDAT, where it stands in the program."""
        node = Node("name", fdat, 0, 0)
        record = self._record(node)
        if "TOOL_NO" not in record or "BASE_NO" not in record:
            return None, None
        tool, frame = self._of(node, "TOOL_NO").name, self._of(node, "BASE_NO").name
        if record.get("IPO_FRAME", node).text.upper() == "#TCP":
            self.book.doubt("tool", f"{tool} of {fdat}", "the tool stands still and the robot holds the part")
            tool = f"{tool} of {fdat}"
        return tool, frame

    def _assign(self, statement: Statement) -> None:
        to, value = statement.parts
        root = to
        while root.kind in ("field", "index") and root.parts:
            root = root.parts[0]
        word = root.text.upper()
        line = self.book.line(self.document, statement.start)
        if word in _LOADS:
            self._load(to, value, line)
            return
        if word in _DATA or (word in _ACTIVE and to.kind != "name"):
            self.takes_as_frame(statement.start, value)
        if word in _ACTIVE and to.kind == "name":
            self._activate(_ACTIVE[word], value, statement)
        elif word in _ACTIVE:
            self._set(_ACTIVE[word], self._doubtful(_ACTIVE[word], f"{word} of line {line}", f"line {line} changes it"))
        elif word in _DATA:
            self._define(_DATA[word], to, value, line)
        elif word == "FDAT_ACT":
            tool, frame = self._taught(value.text)
            self.state = replace(self.state, tool=tool or f"of {value.text}", frame=frame or f"of {value.text}")
            self._mount(self._of(value, "TOOL_NO").name or f"of {value.text}")
        elif word == "$IPO_MODE":
            on = value.text.upper() == "#TCP"
            self.state = replace(self.state, switches=frozenset({"#TCP"} if on else ()))
        else:
            self.assign(statement)

    def _define(self, what: str, to: Node, value: Node, line: int) -> None:
        """TOOL_DATA[1] = {...}: where a tool or a base is, in the whole program."""
        known = self.book.tools if what == "tool" else self.book.frames
        whole = to
        while whole.kind == "field":
            whole = whole.parts[0]
        label = self.place(whole).name
        if label is None:
            return
        T = None if whole is not to else self.place(value).T
        before = known.get(label)
        if T is None or (isinstance(before, np.ndarray) and not np.array_equal(before, T)):
            self.book.doubt(what, label, f"{what} {label} is changed at run time, in line {line}")
        else:
            known[label] = T

    def _load(self, to: Node, value: Node, line: int) -> None:
        """$LOAD = LOAD_DATA[1], $LOAD = {M 5.0, ...}, $LOAD.M = 5.0: what hangs on the flange; so LOAD_DATA[1]."""
        if to.kind == "field" and to.text.upper() != "M":
            return  # where its centre is
        masses = {part.text: part.parts[0] for part in value.parts} if value.kind == "record" else {"M": value}
        mass = self.number(masses["M"]) if "M" in masses else None
        name = self._load_number(to.parts[0] if to.kind == "field" else to)
        if name is None:  # $LOAD
            name = self._load_number(value)
            if name is None:
                name = f"$LOAD of line {line}"
                self.book.weigh(name, mass, line)
            self._mount(name)
        else:
            self.book.weigh(name, mass, line)

    def _load_number(self, node: Node) -> str | None:
        """1 of LOAD_DATA[1], what its number is computed from where that is not known; None for what is none."""
        if node.kind != "index" or node.parts[0].text.upper() != "LOAD_DATA":
            return None
        number = self.number(node.parts[1])
        return self.book.shown(self.document, node.start, node.end) if number is None else f"{number:g}"

    def _mount(self, load: str) -> None:
        """What the arm carries from here on; with tool 0 the program says nothing of it."""
        self.state = replace(self.state, loads=(None if load == "0" else load,))

    def _activate(self, what: str, value: Node, statement: Statement) -> None:
        self._set(what, self._label(what, value, statement))

    def _set(self, what: str, label: str) -> None:
        self.state = replace(self.state, tool=label) if what == "tool" else replace(self.state, frame=label)

    def _label(self, what: str, value: Node, statement: Statement) -> str:
        """The name under which a tool or a base stands that an expression gives."""
        self.takes_as_frame(statement.start, value)
        place = self.place(value)
        word = "$TOOL" if what == "tool" else "$BASE"
        label = f"{word} of line {self.book.line(self.document, statement.start)}"
        if place.name is not None and not place.chain:
            return place.name
        if place.factors:
            return self.book.chain(label, place.factors, tool=what == "tool")
        shown = self.book.shown(self.document, value.start, value.end)
        return self._doubtful(what, label, f"{word} is {shown} there, which is computed at run time")

    def _doubtful(self, what: str, label: str, why: str) -> str:
        self.book.doubt(what, label, why)
        return label

    def _bas(self, statement: Statement) -> None:
        """BAS(#TOOL, 1), BAS(#BASE, 2); the other commands set speeds."""
        command, *rest = (part for part in statement.parts)
        word = command.text.upper()
        if word in ("#TOOL", "#BASE", "#EX_BASE") and rest:
            what = "tool" if word == "#TOOL" else "frame"
            number = self.number(rest[0])
            shown = self.book.shown(self.document, statement.start, statement.end)
            if number is None or word == "#EX_BASE":
                self._set(what, self._doubtful(what, shown, f"{shown} is not followed"))
            else:
                self._set(what, f"{number:g}")
            if what == "tool":
                self._mount(shown if number is None else f"{number:g}")

    def _block(self, statement: Statement) -> None:
        """SPLINE WITH $TOOL = ... holds up to ENDSPLINE."""
        if statement.name == "ENDSPLINE":
            self.state = self._outside.pop() if self._outside else self.state
            return
        self._outside.append(self.state)
        self._with(statement)

    def _with(self, statement: Statement) -> None:
        for part in statement.parts:
            if part.kind == "named" and part.text in _ACTIVE and part.parts:
                self._activate(_ACTIVE[part.text], part.parts[0], statement)
            elif part.kind == "named" and part.text == "$LOAD" and part.parts:
                line = self.book.line(self.document, statement.start)
                self._load(Node("name", part.text, part.start, part.end), part.parts[0], line)

    def _move(self, statement: Statement) -> None:
        outer = self.state
        self._with(statement)
        is_linear = "PTP" not in statement.name
        places = [part for part in statement.parts if part.kind != "named"]
        for part in places[: 2 if "CIRC" in statement.name else 1]:
            self._go(statement, part, is_linear=is_linear)
        self.state = replace(outer, afresh=self.state.afresh)

    def _go(self, statement: Statement, part: Node, *, is_linear: bool) -> None:
        relative = statement.name.endswith("_REL")
        place = NOWHERE if relative else self.place(part)
        if not place.targets:
            self.spoil(statement, part)
            self.state = replace(self.state, afresh=self.state.afresh or not is_linear)
            if part.text.upper() in _HERE:
                return
            shown = self.book.shown(self.document, part.start, part.end)
            why = "it moves on from where the arm is" if relative else self._why(part)
            self.book.leave(self.document, statement.start, f"{statement.name} {shown}", why)
            return
        tool = self.state.tool
        if "#TCP" in self.state.switches:
            tool = self._doubtful("tool", f"{tool} at #TCP", "the tool stands still and the robot holds the part")
        holds = {"tool": tool, "afresh": self.state.afresh, "loads": self.state.loads}
        self.book.go(place, self.document, statement.start, self.state.frame, **holds)
        self.state = replace(self.state, afresh=False)

    def _why(self, node: Node) -> str:
        """Why a place is no target."""
        given = [piece.text for piece in node.parts]
        wanted = _JOINTS if set(given) & set(_JOINTS) else _POSE
        if node.kind == "record" and not set(given) >= set(wanted):
            return f"it names only {', '.join(given)}, and the rest stays as it was"
        return self.book.reason(self.document, node)


def _is_whole(text: str) -> bool:
    return text.startswith("'") or (len(text) < 10 and float(text).is_integer())
