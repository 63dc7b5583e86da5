# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Expressions of robot languages as trees, and the statements that a language's parser makes of them.

The grammar is common to RAPID, KRL and URScript; a `Notation` says in what they differ. Operators, loosest first:

    or, xor | and | not | = <> < > <= >= == != | + - | * / div mod % | : | sign | call, index, field
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from fastcal.programs.tokens import Token

DEEPEST = 50  # brackets within brackets

NodeKind = Literal[
    "number", "name", "text", "list", "pose", "record", "call", "index", "field", "named", "prefix", "infix"
]

_LOOSEST = 1
_LEVELS: Mapping[str, int] = {
    **dict.fromkeys(("OR", "XOR", "EXOR", "B_OR", "B_EXOR"), 1),
    **dict.fromkeys(("AND", "B_AND"), 2),
    **dict.fromkeys(("=", "<>", "<", ">", "<=", ">=", "==", "!="), 4),
    **dict.fromkeys(("+", "-"), 5),
    **dict.fromkeys(("*", "/", "DIV", "MOD", "%"), 6),
    ":": 7,
}
_PREFIXES = {"NOT": 3, "B_NOT": 3, "+": 7, "-": 7}


@dataclass(frozen=True)
class Node:
    """A piece of an expression.

    Attributes:
        kind: number, name, text; list: [a, b]; pose: p[a, b]; record: {X a, Y b}, its parts `named`; call: f(a, b);
            index: a[b] or a{b}; field: a.b; named: an argument or a component with a name, whose one part, its value,
            may be missing; prefix and infix: an operator.
        text: The word, the name of what is called or named, or the operator.
        parts: The pieces within; of index and field the first is what is indexed.
        start, end: Its place in the text.
    """

    kind: NodeKind
    text: str
    start: int
    end: int
    parts: tuple[Node, ...] = ()

    def names(self) -> Iterator[Node]:
        """All names in it that may stand for a value."""
        if self.kind == "name":
            yield self
        for part in self.parts:
            yield from part.names()

    def calls(self) -> Iterator[Node]:
        """All calls in it, the inner ones of a call left out."""
        if self.kind == "call":
            yield self
            return
        for part in self.parts:
            yield from part.calls()


class NotUnderstood(Exception):  # noqa: N818
    """The text does not go on as the grammar wants; holds the place."""

    def __init__(self, at: int) -> None:
        self.at = at


@dataclass(frozen=True)
class Notation:
    """In what the expressions of a language differ.

    Attributes:
        reserved: Names in upper case that end an expression.
        index: The bracket after a name that encloses its index; another one begins something else.
        geometric: Is `:` an operator, the product of frames?
        poses: Does p[ begin a pose?
        records: Does { begin a record?
        switches: Does a backslash begin an argument with a name?
        keywords: Does = within arguments give one its name?
        equals: Is = an operator that compares?
    """

    reserved: frozenset[str] = frozenset()
    index: str = "["
    geometric: bool = False
    poses: bool = False
    records: bool = False
    switches: bool = False
    keywords: bool = False
    equals: bool = True


class Parser:
    """Reads expressions from the words of a text, one after the other; `at` is the next word."""

    def __init__(self, words: list[Token], notation: Notation) -> None:
        self.words, self.notation, self.at, self._depth = words, notation, 0, 0

    @property
    def word(self) -> Token:
        """The next word."""
        return self.words[self.at]

    def next(self) -> Token:
        """Takes the next word; the end is never passed."""
        word = self.words[self.at]
        self.at += word.kind != "end"
        return word

    def reset(self, at: int) -> None:
        """Goes back, or on, to another word, as after what was not understood."""
        self.at, self._depth = at, 0

    def take(self, *words: str) -> bool:
        """Takes the next word if it is one of these."""
        if self.word.is_any(*words):
            self.at += 1
            return True
        return False

    def expect(self, *words: str) -> Token:
        """Takes the next word, which must be one of these."""
        if not self.word.is_any(*words):
            raise NotUnderstood(self.word.start)
        return self.next()

    def name(self) -> Token:
        """Takes the next word, which must be a name."""
        if self.word.kind != "name":
            raise NotUnderstood(self.word.start)
        return self.next()

    def expression(self, loosest: int = _LOOSEST) -> Node:
        """The longest expression from here on whose operators bind at least so tightly."""
        self._depth += 1
        if self._depth > DEEPEST:
            raise NotUnderstood(self.word.start)
        left = self._prefixed()
        while (level := self._level()) >= loosest:
            operator = self.next()
            right = self.expression(level + 1)
            left = Node("infix", operator.text.upper(), left.start, right.end, (left, right))
        self._depth -= 1
        return left

    def _level(self) -> int:
        word = self.word
        if word.kind not in ("name", "sign") or word.text.upper() in self.notation.reserved:
            return 0
        if (word.text == ":" and not self.notation.geometric) or (word.text == "=" and not self.notation.equals):
            return 0
        return _LEVELS.get(word.text.upper(), 0)

    def _prefixed(self) -> Node:
        word = self.word
        if word.kind in ("name", "sign") and (level := _PREFIXES.get(word.text.upper())):
            self.next()
            inner = self.expression(level)
            return Node("prefix", word.text.upper(), word.start, inner.end, (inner,))
        return self._with_tail(self._primary())

    def _with_tail(self, node: Node) -> Node:
        """Indices, fields and arguments that follow."""
        while True:
            word = self.word
            if word.text == "(" and node.kind in ("name", "field"):
                self.next()
                arguments = self.arguments(")")
                node = Node("call", node.text, node.start, self.expect(")").end, arguments)
            elif word.text == self.notation.index and node.kind in ("name", "index", "field", "call"):
                self.next()
                close = {"[": "]", "{": "}"}[word.text]
                inner = self.arguments(close)
                node = Node("index", node.text, node.start, self.expect(close).end, (node, *inner))
            elif word.text == "." and self.words[self.at + 1].kind == "name":
                self.next()
                field = self.next()
                node = Node("field", field.text, node.start, field.end, (node,))
            else:
                return node

    def arguments(self, *ends: str) -> tuple[Node, ...]:
        """Expressions with commas between them, up to a word that is one of `ends`, which is not taken."""
        found: list[Node] = []
        while not self.word.is_any(*ends):
            if self.word.kind in ("end", "line"):
                raise NotUnderstood(self.word.start)
            if self.take(","):
                continue
            found.append(self._argument())
            if not self.word.is_any(*ends, ",", *(("\\",) if self.notation.switches else ())):
                raise NotUnderstood(self.word.start)
        return tuple(found)

    def _argument(self) -> Node:
        word, after = self.word, self.words[min(self.at + 1, len(self.words) - 1)]
        if self.notation.switches and word.text == "\\":
            self.next()
            name = self.name()
            value = (self.expression(),) if self.take(":=") else ()
            return Node("named", name.text, word.start, value[0].end if value else name.end, value)
        if self.notation.keywords and word.kind == "name" and after.text == "=":
            self.at += 2
            inner = self.expression()
            return Node("named", word.text, word.start, inner.end, (inner,))
        if self.notation.switches and word.kind == "name" and after.text == ":=":
            self.at += 2  # a required argument may stand with its name, in its own place all the same
        return self.expression()

    def _primary(self) -> Node:
        word = self.next()
        if word.kind in ("number", "text"):
            return Node("number" if word.kind == "number" else "text", word.text, word.start, word.end)
        if word.text == "(":
            inner = self.expression()
            self.expect(")")
            return inner
        if word.text == "[":
            parts = self.arguments("]")
            return Node("list", "", word.start, self.expect("]").end, parts)
        if word.text == "{" and self.notation.records:
            return self._record(word)
        if word.kind == "name" and word.text.upper() not in self.notation.reserved:
            if self.notation.poses and word.text == "p" and self.word.text == "[":
                self.next()
                parts = self.arguments("]")
                return Node("pose", "", word.start, self.expect("]").end, parts)
            return Node("name", word.text, word.start, word.end)
        raise NotUnderstood(word.start)

    def _record(self, head: Token) -> Node:
        """{X 1, Y 2} or {E6POS: X 1, Y 2}; an index after the name of a component is passed over."""
        parts = []
        kind = ""
        if self.word.kind == "name" and self.words[self.at + 1].text == ":":
            kind = self.next().text
            self.next()
        while not self.word.is_any("}"):
            if self.take(","):
                continue
            name = self.name()
            if self.word.text == "[":
                self.next()
                self.arguments("]")
                self.expect("]")
            value = self.expression()
            parts.append(Node("named", name.text.upper(), name.start, value.end, (value,)))
        return Node("record", kind.upper(), head.start, self.expect("}").end, tuple(parts))


StatementKind = Literal["assign", "call", "declare", "open", "branch", "close", "other", "unknown"]


@dataclass(frozen=True)
class Statement:
    """A parsed statement.

    Attributes:
        kind: assign: the first part gets the second; call: `name` is called, or moves, with the parts as arguments;
            declare: a name (the first part) of the type `name`, with its value where there is one; open, branch and
            close: of IF, FOR, WHILE ..., whose conditions are the parts; other: without effect on where the arm goes,
            its parts are only read; unknown: it does not follow the grammar, its parts are the names in it.
        name: What is called or declared, or the word of the language that it begins with; in upper case where the
            language does not tell them apart.
        parts: Its expressions.
        start, end: Its place in the text.
        counter: The variable that a loop counts with; empty: none.
    """

    kind: StatementKind
    name: str
    start: int
    end: int
    parts: tuple[Node, ...] = ()
    counter: str = ""


@dataclass(frozen=True)
class Routine:
    """A routine of a program, or what stands outside of all, under a name of its own.

    Attributes:
        name: As it is called.
        parameters: The names of its parameters.
        statements: Its body.
        document: Where it is.
    """

    name: str
    parameters: tuple[str, ...]
    statements: tuple[Statement, ...]
    document: int


class StatementReader:
    """What reads the statements of one document: its words, and the body that they are added to.

    Attributes:
        outside: What stands outside of all routines.
        body: Of the routine that is open, or `outside`.
        found: The routines that have ended.
    """

    def __init__(self, words: list[Token], notation: Notation, document: int) -> None:
        self.parser, self.document = Parser(words, notation), document
        self.outside: list[Statement] = []
        self.body = self.outside
        self.found: list[Routine] = []
        self._begun: tuple[str, tuple[str, ...]] = ("", ())

    def begin(self, name: str, parameters: tuple[str, ...]) -> None:
        """A routine begins; one that is open ends."""
        self.finish()
        self._begun, self.body = (name, parameters), []

    def finish(self) -> None:
        """The routine that is open ends."""
        if self.body is not self.outside:
            self.found.append(Routine(*self._begun, tuple(self.body), self.document))
            self.body = self.outside

    def routines(self) -> list[Routine]:
        """What stands outside, under a name that no language has, then the routines in their order."""
        self.finish()
        return [Routine(f" {self.document}", (), tuple(self.outside), self.document), *self.found]

    def add(self, kind: StatementKind, name: str, first: Token, *parts: Node, counter: str = "") -> None:
        """A statement from `first` to the word that was taken last."""
        end = self.parser.words[max(self.parser.at - 1, 0)].end
        self.body.append(Statement(kind, name, first.start, max(end, first.end), parts, counter))

    def names_until(self, is_end: Callable[[Token], bool]) -> tuple[Node, ...]:
        """Passes over words up to one that ends, which is not taken; the names among them."""
        names = []
        while self.parser.word.kind != "end" and not is_end(self.parser.word):
            word = self.parser.next()
            if word.kind == "name":
                names.append(Node("name", word.text, word.start, word.end))
        return tuple(names)
