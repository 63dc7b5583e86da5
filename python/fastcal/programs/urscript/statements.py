# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The statements of a script, a line each; a line goes on while a bracket is open."""

from __future__ import annotations

from fastcal.programs.syntax import Notation, NotUnderstood, Routine, Statement, StatementReader
from fastcal.programs.tokens import Lexicon, Token, tokens

_LEXICON = Lexicon(comment=r"#|\$", by_lines=True)  # $ 2 "MoveJ" names a node of the program on the pendant
_WORDS = "DEF THREAD SEC END WHILE IF ELIF ELSE RETURN BREAK CONTINUE LOCAL GLOBAL HALT"
_RESERVED = frozenset(_WORDS.split())
_NOTATION = Notation(reserved=_RESERVED, poses=True, keywords=True, equals=False)
_ROUTINES = {"def", "thread", "sec"}
_OF_THREADS = {"run", "join", "kill"}


def routines(text: str, document: int) -> list[Routine]:
    """The routines of a script; what stands outside comes first, under a name that is none of URScript."""
    return _Script(_joined(tokens(text, _LEXICON)), document).read()


def _joined(words: list[Token]) -> list[Token]:
    """Without the ends of lines within brackets, and without the words that start and stop threads."""
    found, depth = [], 0
    for place, word in enumerate(words):
        if word.kind == "sign":
            depth = max(depth + (word.text in "([{") - (word.text in ")]}"), 0)
        if word.kind == "line" and depth:
            continue
        if word.text in _OF_THREADS and words[min(place + 1, len(words) - 1)].kind == "name":
            continue
        found.append(word)
    return found


class _Script(StatementReader):
    def __init__(self, words: list[Token], document: int) -> None:
        super().__init__(words, _NOTATION, document)
        # What an `end` closes: a block (None), or a routine with the body around it.
        self.open: list[tuple[str, tuple[str, ...], list[Statement]] | None] = []

    def read(self) -> list[Routine]:
        parser = self.parser
        while parser.word.kind != "end":
            start = parser.at
            if parser.word.kind == "line" or parser.word.text == ";":
                parser.next()
                continue
            try:
                self._statement()
            except NotUnderstood:
                parser.reset(start)
                first = parser.word
                self.add("unknown", "", first, *self.names_until(lambda word: word.kind == "line"))
        while self.open:
            self._close()
        return self.routines()

    def _statement(self) -> None:
        parser, first = self.parser, self.parser.word
        word = first.text
        if first.kind != "name":
            raise NotUnderstood(first.start)
        if word in _ROUTINES and parser.words[parser.at + 1].kind == "name":
            self._routine()
        elif word in ("while", "if"):
            parser.next()
            self.add("open", word, first, parser.expression())
            parser.take(":")
            self.open.append(None)
        elif word in ("elif", "else"):
            parser.next()
            self.add("branch", word.upper(), first, *((parser.expression(),) if word == "elif" else ()))
            parser.take(":")
        elif word == "end":
            parser.next()
            self._close(first)
        else:
            self._plain(first)

    def _routine(self) -> None:
        """The head of a routine: def name(parameters):, thread name():."""
        parser = self.parser
        parser.next()
        name = parser.name().text
        parameters: tuple[str, ...] = ()
        if parser.take("("):
            nodes = parser.arguments(")")
            parser.expect(")")
            parameters = tuple(node.text for node in nodes if node.kind in ("name", "named"))
        parser.take(":")
        self.open.append((name, parameters, self.body))
        self.body = []

    def _plain(self, first: Token) -> None:
        """An assignment, a call, or a jump."""
        parser = self.parser
        if parser.take("RETURN", "BREAK", "CONTINUE", "HALT"):
            value = () if parser.word.kind in ("line", "end") else (parser.expression(),)
            self.add("call" if value else "other", first.text, first, *value)
            return
        while parser.take("GLOBAL", "LOCAL"):
            pass
        to = parser.expression()
        if parser.take("="):
            self.add("assign", "", first, to, parser.expression())
        elif to.kind == "call":
            self.add("call", to.text, first, *to.parts)
        else:
            self.add("other", "", first, to)
        if parser.word.kind not in ("line", "end") and not parser.word.is_any(";", "END"):
            raise NotUnderstood(parser.word.start)

    def _close(self, first: Token | None = None) -> None:
        if not self.open:
            return
        opened = self.open.pop()
        if opened is None:
            self.add("close", "end", first or self.parser.word)
        else:
            name, parameters, around = opened
            self.found.append(Routine(name, parameters, tuple(self.body), self.document))
            self.body = around
