# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The statements of a KRL file, a line each; what stands behind THEN is one of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from fastcal.programs.syntax import Node, Notation, NotUnderstood, Routine, StatementReader
from fastcal.programs.tokens import Lexicon, Token, tokens

MOTIONS = frozenset(
    {"PTP", "LIN", "CIRC", "SPTP", "SLIN", "SCIRC", "SPL"}
    | {"PTP_REL", "LIN_REL", "CIRC_REL", "SPTP_REL", "SLIN_REL", "SCIRC_REL", "SPL_REL"}
)
_LEXICON = Lexicon(comment=";", first="$#", number=r"'[BbHh][0-9A-Fa-f]+'", by_lines=True)
_BRANCHES = {"ELSE", "CASE", "DEFAULT"}
_CLOSES = {"ENDIF", "ENDFOR", "ENDWHILE", "ENDLOOP", "UNTIL", "ENDSWITCH"}
_ENDS = {"END", "ENDFCT", "ENDDAT"}
_REST_IS_READ = {
    *("WAIT", "HALT", "EXIT", "CONTINUE", "GOTO", "RESUME", "BRAKE", "INTERRUPT", "TRIGGER", "SIGNAL", "INI"),
    *("EXT", "EXTFCT", "IMPORT", "ENUM", "STRUC", "TIME_BLOCK", "STIME_BLOCK", "CONST_VEL", "ANIN", "ANOUT", "DEFDAT"),
}
_STARTS = {"IF", "FOR", "WHILE", "LOOP", "REPEAT", "SWITCH", "DEF", "DEFFCT", "DECL", "GLOBAL", "SPLINE", "ENDSPLINE"}
_RESERVED = frozenset({"THEN", "TO", "STEP", "WITH", "DO", "CA"} | _BRANCHES | _CLOSES | _STARTS)
_NOTATION = Notation(reserved=_RESERVED, geometric=True, records=True, equals=False)


def routines(text: str, document: int) -> list[Routine]:
    """The routines of a file; what stands outside comes first, under a name that is none of KRL."""
    return _File(text, document).read()


class _File(StatementReader):
    def __init__(self, text: str, document: int) -> None:
        super().__init__(tokens(text, _LEXICON), _NOTATION, document)

    def read(self) -> list[Routine]:
        parser = self.parser
        while parser.word.kind != "end":
            start = parser.at
            try:
                if parser.word.kind == "line":
                    parser.next()
                elif (head := self._head()) is not None:
                    self.begin(*head)
                elif parser.word.is_any(*_ENDS):
                    self._rest()
                    self.finish()
                else:
                    self._statement()
            except NotUnderstood:
                parser.reset(start)
                first = parser.word
                self.add("unknown", first.text.upper(), first, *self._rest())
        return self.routines()

    def _head(self) -> tuple[str, tuple[str, ...]] | None:
        """DEF name(parameters) or DEFFCT type name(...); None where there is none."""
        parser, start = self.parser, self.parser.at
        parser.take("GLOBAL")
        if not parser.word.is_any("DEF", "DEFFCT"):
            parser.reset(start)
            return None
        words = []
        while parser.word.kind not in ("line", "end"):
            words.append(parser.next())
        opened = next((k for k, word in enumerate(words) if word.text == "("), len(words))
        if words[opened - 1].kind != "name" or opened < 2:
            return "?", ()
        inner = [words[k] for k in range(opened + 1, len(words)) if words[k - 1].text in ("(", ",")]
        return words[opened - 1].text, tuple(word.text for word in inner if word.kind == "name")

    def _statement(self) -> None:
        parser, first = self.parser, self.parser.word
        word, after = first.text.upper(), parser.words[min(parser.at + 1, len(parser.words) - 1)]
        if first.text == "&":
            self._rest()
            return
        if first.kind != "name":
            raise NotUnderstood(first.start)
        read = next((read for words, read in self._kinds.items() if word in words), None)
        if read is not None:
            read(first)
        elif after.text == ":" and parser.words[parser.at + 2].kind in ("line", "end"):
            parser.at += 2  # a label
        elif after.kind == "name":
            self._declaration(first)
        else:
            self._call_or_assignment(first)

    @cached_property
    def _kinds(self) -> dict[frozenset[str], Callable[[Token], None]]:
        """Words that begin statements, and who reads them."""
        return {
            MOTIONS: self._motion,
            frozenset({"SPLINE", "PTP_SPLINE", "ENDSPLINE"}): self._spline,
            frozenset({"IF", "WHILE", "SWITCH", "LOOP", "REPEAT"}): self._open,
            frozenset({"FOR"}): self._for,
            frozenset(_BRANCHES): self._branch,
            frozenset(_CLOSES): self._close,
            frozenset({"RETURN"}): self._return,
            frozenset(_REST_IS_READ): self._read,
            frozenset({"DECL", "GLOBAL", "CONST"}): self._declaration,
        }

    def _open(self, first: Token) -> None:
        """IF condition THEN, WHILE condition, LOOP ..."""
        parser = self.parser
        word = parser.next().text.upper()
        self.add("open", word, first, *(() if word in ("LOOP", "REPEAT") else (parser.expression(),)))
        parser.take("THEN")

    def _branch(self, first: Token) -> None:
        word = self.parser.next().text.upper()
        self.add("branch", word, first, *(self._list() if word == "CASE" else ()))
        self.parser.take(":")

    def _close(self, first: Token) -> None:
        word = self.parser.next().text.upper()
        self.add("close", word, first, *((self.parser.expression(),) if word == "UNTIL" else ()))
        self._end()

    def _return(self, first: Token) -> None:
        parser = self.parser
        parser.next()
        self.add("call", "RETURN", first, *(() if parser.word.kind in ("line", "end") else (parser.expression(),)))
        self._end()

    def _read(self, first: Token) -> None:
        self.add("other", first.text.upper(), first, *self._rest())

    def _spline(self, first: Token) -> None:
        word = self.parser.next().text.upper()
        self.add("call", word, first, *self._flags())
        self._end()

    def _motion(self, first: Token) -> None:
        """The places of a motion, then what is said of it: C_DIS, CA 180, WITH $TOOL = ..."""
        parser = self.parser
        word = parser.next().text.upper()
        places = [parser.expression()]
        while parser.take(","):
            if parser.take("CA"):
                parser.expression()
                break
            places.append(parser.expression())
        self.add("call", word, first, *places, *self._flags())
        self._end()

    def _flags(self) -> tuple[Node, ...]:
        parser = self.parser
        found = []
        while parser.word.kind == "name" and not parser.word.is_any("WITH", *_CLOSES):
            word = parser.next()
            found.append(Node("named", word.text.upper(), word.start, word.end))
        if parser.take("WITH"):
            while True:
                to = parser.expression()
                parser.expect("=")
                value = parser.expression()
                root = to
                while root.parts and root.kind in ("index", "field"):
                    root = root.parts[0]
                found.append(Node("named", root.text.upper(), to.start, value.end, (value,)))
                if not parser.take(","):
                    break
            while parser.word.kind == "name" and not parser.word.is_any(*_CLOSES):
                parser.next()
        return tuple(found)

    def _list(self) -> tuple[Node, ...]:
        found = [self.parser.expression()]
        while self.parser.take(","):
            found.append(self.parser.expression())
        return tuple(found)

    def _for(self, first: Token) -> None:
        parser = self.parser
        parser.next()
        counter = parser.expression()
        parser.expect("=")
        parts = [parser.expression()]
        parser.expect("TO")
        parts.append(parser.expression())
        if parser.take("STEP"):
            parts.append(parser.expression())
        self.add("open", "FOR", first, *parts, counter=counter.text)

    def _declaration(self, first: Token) -> None:
        parser = self.parser
        while parser.take("DECL", "GLOBAL", "CONST"):
            pass
        if parser.word.is_any(*_REST_IS_READ):
            self._read(first)
            return
        kind = parser.name().text.upper()
        while True:
            to = parser.expression()
            value = (parser.expression(),) if parser.take("=") else ()
            self.add("declare", kind, first, to, *value)
            if not parser.take(","):
                break
        self._end()

    def _call_or_assignment(self, first: Token) -> None:
        parser = self.parser
        to = parser.expression()
        if parser.take("="):
            self.add("assign", "", first, to, parser.expression())
        elif to.kind == "call":
            self.add("call", to.text, first, *to.parts)
        else:
            raise NotUnderstood(first.start)
        self._end()

    def _end(self) -> None:
        """The end of a line, or a word behind THEN or ELSE that closes."""
        if self.parser.word.kind not in ("line", "end") and not self.parser.word.is_any(*_CLOSES, *_BRANCHES):
            raise NotUnderstood(self.parser.word.start)

    def _rest(self) -> tuple[Node, ...]:
        """The rest of the line, and the names in it."""
        return self.names_until(lambda word: word.kind == "line")
