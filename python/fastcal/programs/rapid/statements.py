# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The statements of a RAPID module."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cached_property

from fastcal.programs.syntax import Node, Notation, NotUnderstood, Routine, StatementReader
from fastcal.programs.tokens import Lexicon, Token, tokens

_LEXICON = Lexicon(comment="!")
_WORDS = (
    "MODULE ENDMODULE PROC ENDPROC FUNC ENDFUNC TRAP ENDTRAP RECORD ENDRECORD LOCAL TASK GLOBAL CONST PERS VAR ALIAS "
    "IF THEN ELSEIF ELSE ENDIF FOR FROM TO STEP DO ENDFOR WHILE ENDWHILE TEST CASE DEFAULT ENDTEST GOTO RETURN EXIT "
    "ERROR UNDO BACKWARD RAISE RETRY TRYNEXT CONNECT WITH INOUT SWITCH"
)
_RESERVED = frozenset(_WORDS.split())
_NOTATION = Notation(reserved=_RESERVED, index="{", switches=True)
_HEADER = re.compile(r"(?:\xef\xbb\xbf)?\s*%%%.*?%%%", re.S)
_ENDS = {"ENDPROC", "ENDFUNC", "ENDTRAP"}
_BRANCHES = {"ELSEIF", "ELSE", "CASE", "DEFAULT"}
_CLOSES = {"ENDIF", "ENDFOR", "ENDWHILE", "ENDTEST"}


def routines(text: str, document: int) -> list[Routine]:
    """The routines of a module; its declarations stand in a first one, whose name is no name of RAPID."""
    return _Module(text, document).read()


class _Module(StatementReader):
    def __init__(self, text: str, document: int) -> None:
        header = _HEADER.match(text)
        if header:
            text = " " * header.end() + text[header.end() :]
        super().__init__(tokens(text, _LEXICON), _NOTATION, document)

    def read(self) -> list[Routine]:
        parser = self.parser
        while parser.word.kind != "end":
            start = parser.at
            try:
                head = self._head()
                if head is not None:
                    self.begin(*head)
                elif self.body is not self.outside and parser.take(*_ENDS):
                    self.finish()
                else:
                    self._statement()
            except NotUnderstood:
                self._skip(start)
        return self.routines()

    def _head(self) -> tuple[str, tuple[str, ...]] | None:
        """PROC name(parameters), FUNC type name(...), TRAP name; None where there is none."""
        parser, start = self.parser, self.parser.at
        parser.take("LOCAL")
        if not parser.word.is_any("PROC", "FUNC", "TRAP"):
            parser.reset(start)
            return None
        if parser.next().text.upper() == "FUNC":
            parser.name()
        name = parser.name().text
        parameters: list[str] = []
        if parser.take("("):
            last = ""
            while not parser.take(")"):
                word = parser.next()
                if word.kind == "end":
                    raise NotUnderstood(word.start)
                if word.text in ",|\\" and last:
                    parameters.append(last)
                    last = ""
                elif word.kind == "name":
                    last = word.text
                elif word.text == "{":
                    while not parser.take("}") and parser.word.kind != "end":
                        parser.next()
            parameters += [last] if last else []
        return name, tuple(parameters)

    def _statement(self) -> None:
        first = self.parser.word
        if first.text == "%":
            self._late_call(first)
            return
        if first.kind != "name":
            raise NotUnderstood(first.start)
        word = first.text.upper()
        read = next((read for words, read in self._kinds.items() if word in words), self._call_or_assignment)
        read(first)

    @cached_property
    def _kinds(self) -> dict[frozenset[str], Callable[[Token], None]]:
        """Words that begin statements, and who reads them."""
        kinds: dict[str, Callable[[Token], None]] = {
            "MODULE ENDMODULE": self._module,
            "LOCAL TASK GLOBAL CONST PERS VAR ALIAS": self._declaration,
            "RECORD": self._record,
            "IF": self._if,
            "FOR WHILE TEST": self._loop,
            "ELSEIF ELSE CASE DEFAULT": self._branch,
            "ENDIF ENDFOR ENDWHILE ENDTEST": self._close,
            "ERROR UNDO BACKWARD": self._handler,
            "GOTO RETURN EXIT RAISE RETRY TRYNEXT CONNECT": self._jump,
        }
        return {frozenset(words.split()): read for words, read in kinds.items()}

    def _module(self, first: Token) -> None:
        """MODULE name(attributes), ENDMODULE."""
        parser = self.parser
        if parser.next().text.upper() == "MODULE":
            parser.name()
            self._handler(None)

    def _handler(self, first: Token | None) -> None:
        """ERROR (numbers), and what else may have something in brackets."""
        parser = self.parser
        if first is not None:
            parser.next()
        if parser.take("("):
            parser.arguments(")")
            parser.expect(")")

    def _record(self, first: Token) -> None:
        parser = self.parser
        while not parser.take("ENDRECORD") and parser.word.kind != "end":
            parser.next()

    def _if(self, first: Token) -> None:
        """IF condition THEN, or IF condition and one statement."""
        parser = self.parser
        parser.next()
        self.add("open", "IF", first, parser.expression())
        if not parser.take("THEN"):
            self._statement()
            self.add("close", "ENDIF", first)

    def _branch(self, first: Token) -> None:
        parser = self.parser
        word = parser.next().text.upper()
        parts: tuple[Node, ...] = ()
        if word == "CASE":
            parts = parser.arguments(":")
        elif word == "ELSEIF":
            parts = (parser.expression(),)
        if word in ("CASE", "DEFAULT"):
            parser.expect(":")
        else:
            parser.take("THEN")
        self.add("branch", word, first, *parts)

    def _close(self, first: Token) -> None:
        self.add("close", self.parser.next().text.upper(), first)

    def _jump(self, first: Token) -> None:
        """GOTO label, RETURN value, CONNECT interrupt WITH trap ..."""
        parser = self.parser
        word = parser.next().text.upper()
        parts: tuple[Node, ...] = ()
        if word == "CONNECT":
            parser.expression()
            parser.expect("WITH")
        if not parser.word.is_any(";"):
            parts = (parser.expression(),)
        self._end()
        self.add("call" if word == "RETURN" else "other", word, first, *parts)

    def _declaration(self, first: Token) -> None:
        """CONST type name := value."""
        parser = self.parser
        while parser.take("LOCAL", "TASK", "GLOBAL", "CONST", "PERS", "VAR", "ALIAS"):
            pass
        kind = parser.name().text.upper()
        while True:
            name = parser.name()
            node: Node = Node("name", name.text, name.start, name.end)
            if parser.take("{"):
                parser.arguments("}")
                parser.expect("}")
            value = (parser.expression(),) if parser.take(":=") else ()
            self.add("declare", kind, first, node, *value)
            if not parser.take(","):
                break
        self._end()

    def _loop(self, first: Token) -> None:
        """FOR i FROM a TO b DO, WHILE a DO, TEST a."""
        parser = self.parser
        word, counter = parser.next().text.upper(), ""
        if word == "FOR":
            counter = parser.name().text
            parser.expect("FROM")
            parts = [parser.expression()]
            parser.expect("TO")
            parts.append(parser.expression())
            if parser.take("STEP"):
                parts.append(parser.expression())
        else:
            parts = [parser.expression()]
        if word != "TEST":
            parser.expect("DO")
        self.add("open", word, first, *parts, counter=counter)

    def _call_or_assignment(self, first: Token) -> None:
        parser = self.parser
        at = parser.at
        if parser.words[at + 1].text == ":":
            parser.at += 2  # a label
            return
        to = parser.expression()
        if parser.take(":="):
            value = parser.expression()
            self._end()
            self.add("assign", "", first, to, value)
            return
        parser.reset(at + 1)
        arguments = parser.arguments(";", *_CLOSES, *_BRANCHES, *_ENDS)
        self._end()
        self.add("call", first.text, first, *arguments)

    def _late_call(self, first: Token) -> None:
        """%"name"% arguments: a call of what only the run knows."""
        names = self.names_until(lambda word: word.is_any(";", *_CLOSES, *_BRANCHES, *_ENDS))
        self._end()
        self.add("call", "%", first, *names)

    def _end(self) -> None:
        """The ; at the end, which may be missing before a word that closes."""
        if not self.parser.word.is_any(*_CLOSES, *_BRANCHES, *_ENDS):
            self.parser.expect(";")

    def _skip(self, start: int) -> None:
        """Passes over a statement that does not follow the grammar, up to its ; or a word that begins another."""
        parser = self.parser
        parser.reset(start)
        first = parser.next()
        names = [Node("name", first.text, first.start, first.end)] if first.kind == "name" else []
        if first.text != ";":
            names += self.names_until(lambda word: word.is_any(";", *_ENDS, "ENDMODULE", "PROC", "FUNC", "TRAP"))
            parser.take(";")
        self.add("unknown", "", first, *names)
