# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Goes through a program's statements in the order in which they run, as far as the text tells, and keeps its state.

A routine that another one calls is gone through where it is called, with its arguments; the others from the state in
which a program begins. After the branches of a condition what all of them agree in holds; a loop that changes the state
is gone through twice. A name is what was given to it before, on the way there; where conditions decide, or other
routines give it values too, it is any of these.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from fastcal.programs.book import LARGEST, NOWHERE, Book, Place, any_of
from fastcal.programs.syntax import Node, Routine, Statement

DEEPEST = 20  # calls within calls
MOST = 100_000  # statements that are gone through

_OPERATORS: Mapping[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}


@dataclass(frozen=True)
class State:
    """What holds at a place of a program.

    Attributes:
        tool, frame: The names of those that are active; None: not known.
        afresh: Did the arm go to joints of which nothing is known?
        switches: What else is on, in the language's words.
        loads: What the arm may carry, by name; None: nothing was said of it.
    """

    tool: str | None = None
    frame: str | None = None
    afresh: bool = False
    switches: frozenset[str] = frozenset()
    loads: tuple[str | None, ...] = (None,)


@dataclass
class _Block:
    """A condition or a loop that is open."""

    index: int
    entry: State
    name: str
    ends: list[State] = field(default_factory=list)
    is_total: bool = False
    has_branch: bool = False
    again: bool = False


@dataclass(frozen=True)
class _Given:
    """A value that a name is given: in which routine and document, the expression, and the name as written there."""

    home: str
    document: int
    node: Node
    name: str


class Walker:
    """The walk; a language says what its statements do.

    Args:
        book: Where what is found is entered.
        routines: Of the program.
        start: In what state it begins.
    """

    by_reference = True  # can a call change the variables that it is given?
    only_read: frozenset[str] = frozenset()  # calls that change none of them
    loops: frozenset[str] = frozenset()  # the words that open a loop
    cases: frozenset[str] = frozenset()  # the words that open a choice, which has no branch before its first one
    first_index = 1  # of a list
    totals: frozenset[str] = frozenset({"ELSE", "DEFAULT"})  # the words of a last branch

    def __init__(self, book: Book, routines: Sequence[Routine], start: State) -> None:
        self.book, self.start, self.state = book, start, start
        self.routines = {self.key(routine.name): routine for routine in routines}
        self.assigned: dict[str, list[_Given]] = {}
        self.document = 0
        self._here = ""
        self._now: dict[str, Place] = {}
        self._arguments: dict[str, Place] = {}
        self._open: list[_Block] = []
        self._calls: list[str] = []
        self._left = MOST
        self._called: set[str] = set()
        self._seen: set[str] = set()
        self._asked: set[str] = set()
        self._changed: set[str] = set()  # names of numbers that calls or loops change
        for routine in routines:
            self._look_at(routine)

    def _look_at(self, routine: Routine) -> None:
        """Notes what names are given and which routines are called, before the walk."""
        home = self.key(routine.name)
        for statement in routine.statements:
            if statement.kind in ("assign", "declare") and len(statement.parts) > 1:
                to, value = statement.parts[:2]
                name = self.variable(to)
                if name is not None:
                    shown = self.book.shown(routine.document, to.start, to.end)
                    self.assigned.setdefault(name, []).append(_Given(home, routine.document, value, shown))
            if statement.kind == "call":
                self._called.add(self.key(statement.name))
                if self.by_reference and self.key(statement.name) not in self.only_read:
                    self._changed.update(self.key(part.text) for part in statement.parts if part.kind == "name")
            if statement.counter:
                self._changed.add(self.key(statement.counter))
            self._called.update(self.key(call.text) for part in statement.parts for call in part.calls())

    # What a language says.

    def key(self, name: str) -> str:
        """A name as the language compares it."""
        return name

    def statement(self, statement: Statement) -> None:
        """A statement that opens and closes nothing."""
        raise NotImplementedError

    def literal(self, node: Node, name: str) -> Place | None:
        """A pose, joints or a list that is written out, under a name or none; None where it is none of them."""
        raise NotImplementedError

    def function(self, node: Node) -> Place:
        """What a function of the language gives; `NOWHERE` where that is not known."""
        raise NotImplementedError

    # The walk.

    def run(self) -> None:
        """Goes through the whole program."""
        for key, routine in self.routines.items():
            if key not in self._called:
                self.state, self._now = self.start, {}
                self.walk(routine)
        for key, routine in self.routines.items():
            if key not in self._seen:  # those that only call each other
                self.state, self._now = self.start, {}
                self.walk(routine)

    def walk(self, routine: Routine) -> None:
        """Goes through a routine."""
        outer = self.document, self._here, self._open
        self.document, self._here, self._open = routine.document, self.key(routine.name), []
        self._seen.add(self._here)
        at = 0
        while at < len(routine.statements) and self._left > 0:
            self._left -= 1
            statement = routine.statements[at]
            at = self._step(statement, at)
        self.document, self._here, self._open = outer

    def call(self, name: str, arguments: Sequence[Place]) -> bool:
        """Goes through a routine of the program with its arguments; False where it is none."""
        routine = self.routines.get(self.key(name))
        if routine is None or self.key(name) in self._calls or len(self._calls) >= DEEPEST:
            return False
        outer = self._arguments
        self._arguments = dict(zip(map(self.key, routine.parameters), arguments, strict=False))
        self._calls.append(self.key(name))
        self.walk(routine)
        self._calls.pop()
        self._arguments = outer
        return True

    def read(self, statement: Statement) -> None:
        """A statement that only reads its expressions: routines that they call are gone through."""
        for part in statement.parts:
            for call in part.calls():
                self.place(call)

    def spoil(self, statement: Statement, *nodes: Node) -> None:
        """Targets that a statement uses in a way that is not followed."""
        line = self.book.line(self.document, statement.start)
        why = f"line {line} uses it in a way that is not followed: {self.shown(statement)}"
        self._spoil(why, nodes or statement.parts)

    def takes_as_frame(self, at: int, *nodes: Node) -> None:
        """Targets that a statement, which begins `at`, makes a tool or a frame of: their numbers have to stay."""
        self._spoil(f"line {self.book.line(self.document, at)} takes it as a tool or a frame", nodes)

    def _spoil(self, why: str, nodes: Sequence[Node]) -> None:
        for node in nodes:
            for name in node.names():
                self.book.spoil(self.place(name).targets, why)
            for call in node.calls():
                if self.key(call.text) in self.routines:
                    self.place(call)

    def not_followed(self, statement: Statement) -> None:
        """A statement that does not follow the grammar: what it names is left, and said where it may be a target."""
        self.spoil(statement)
        text = self.book.documents[self.document].text[statement.start : statement.end]
        if any(bracket in text for bracket in "[{("):
            self.book.leave(self.document, statement.start, self.shown(statement), "it is not understood")

    def shown(self, statement: Statement) -> str:
        """A statement in one line, cut short."""
        return self.book.shown(self.document, statement.start, statement.end)

    def _step(self, statement: Statement, at: int) -> int:
        """One statement; returns the place of the next."""
        if statement.kind == "open":
            self.read(statement)
            self._open.append(_Block(at, self.state, statement.name))
        elif statement.kind == "branch" and self._open:
            block = self._open[-1]
            if block.has_branch or block.name not in self.cases:
                block.ends.append(self.state)
            block.has_branch = True
            block.is_total |= statement.name in self.totals
            self.state = block.entry
            self.read(statement)
        elif statement.kind == "close" and self._open:
            block = self._open.pop()
            self.read(statement)
            end = self.state
            is_loop = block.name in self.loops
            ends = [*block.ends, end] if block.is_total and not is_loop else [*block.ends, end, block.entry]
            self.state = self._merged(ends)
            if is_loop and not block.again and end != block.entry:
                self._open.append(replace(block, entry=self.state, again=True, ends=[]))
                return block.index + 1
        else:
            self.statement(statement)
        return at + 1

    def _merged(self, states: Sequence[State]) -> State:
        """What holds after branches: what they agree in, and any load; a tool or frame that they decide is doubtful."""
        names: dict[str, str | None] = {}
        for what in ("tool", "frame"):
            found = list(dict.fromkeys(getattr(state, what) for state in states))
            names[what] = found[0]
            if len(found) > 1:
                label = " or ".join("another" if name is None else name for name in found)
                self.book.doubt(what, label, f"whether {what} {label} holds is decided at run time")
                names[what] = label
        switches = frozenset().union(*(state.switches for state in states))
        loads = tuple(dict.fromkeys(load for state in states for load in state.loads))
        return State(names["tool"], names["frame"], any(state.afresh for state in states), switches, loads)

    # Names and what they stand for.

    def variable(self, node: Node) -> str | None:
        """The variable that a node is, with its index where that is a plain number."""
        if node.kind == "name":
            return self.key(node.text)
        if node.kind == "index" and node.parts[0].kind == "name":
            indices = [part.text for part in node.parts[1:] if part.kind == "number"]
            if len(indices) == len(node.parts) - 1:
                return f"{self.key(node.text)}[{','.join(indices)}]"
        return None

    def assign(self, statement: Statement) -> None:
        """A name gets a value; where it is a part of one that changes, the whole is changed at run time."""
        to, value = statement.parts[:2]
        name = self.variable(to)
        if name is None:
            self.spoil(statement)
            return
        place = self.place(value, self.book.shown(self.document, to.start, to.end))
        if not self._open and {given.home for given in self.assigned[name]} <= {self._here}:
            self._now[name] = place
        if place is NOWHERE:
            self.spoil(statement, value)

    def place(self, node: Node, name: str = "") -> Place:
        """Where an expression leads."""
        literal = self.literal(node, name)
        if literal is not None:
            return literal
        number = self.number(node)
        if number is not None:
            return Place(number=number)
        if node.kind in ("name", "index"):
            return self._named(node)
        if node.kind == "call":
            return self.function(node)
        return NOWHERE

    def number(self, node: Node) -> float | None:
        """The value of an expression of plain numbers and of names that are given one number only; else None."""
        value = self._value(node)
        return value if value is not None and abs(value) <= LARGEST else None

    def _value(self, node: Node) -> float | None:
        if node.kind == "number":
            try:
                return float(node.text)
            except ValueError:
                return None
        if node.kind == "prefix" and node.text in "+-":
            inner = self.number(node.parts[0])
            return None if inner is None else (-inner if node.text == "-" else inner)
        if node.kind == "infix" and node.text in _OPERATORS:
            a, b = (self.number(part) for part in node.parts)
            try:
                return None if a is None or b is None else _OPERATORS[node.text](a, b)
            except (ZeroDivisionError, OverflowError):
                return None
        if node.kind == "name":
            name = self.key(node.text)
            if name in self._arguments:
                return self._arguments[name].number
            if name in self._changed:
                return None
            given = self.assigned.get(name, [])
            if len(given) == 1 and name not in self._asked and given[0].node.kind in ("number", "prefix", "infix"):
                self._asked.add(name)
                found = self.number(given[0].node)
                self._asked.discard(name)
                return found
        return None

    def _named(self, node: Node) -> Place:
        """What a name or an element of a list stands for."""
        name = self.variable(node)
        if name is not None and node.kind == "name" and name in self._arguments:
            return self._arguments[name]
        if name is not None and name in self._now:
            return self._now[name]
        if name is not None and name in self.assigned:
            return self._any(name)
        if node.kind == "index" and node.parts[0].kind == "name":
            whole = self._named(node.parts[0])
            for index in node.parts[1:]:
                whole = self._element(whole, index)
            if whole is not NOWHERE:
                return whole
            start = f"{self.key(node.text)}["
            if name is None:
                return any_of([self._any(other) for other in self.assigned if other.startswith(start)])
        return NOWHERE

    def _any(self, name: str) -> Place:
        """All that a name is given anywhere."""
        if name in self._asked:
            return NOWHERE
        self._asked.add(name)
        outer, found = self.document, []
        for given in self.assigned[name]:
            self.document = given.document
            found.append(self.place(given.node, given.name))
        self.document = outer
        self._asked.discard(name)
        return any_of(found)

    def _element(self, whole: Place, index: Node) -> Place:
        """An element of a list, or any of them where the index is computed."""
        if not whole.elements:
            return NOWHERE
        number = self.number(index)
        at = None if number is None else round(number) - self.first_index
        if at is not None:
            return whole.elements[at] if 0 <= at < len(whole.elements) else NOWHERE
        return any_of(whole.elements)
