# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The words of a program's text, with the place of each; comments and space are passed over."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import Literal

Kind = Literal["number", "name", "text", "line", "sign", "end"]


@dataclass(frozen=True, slots=True)
class Token:
    """A word: text[start:end] of the program; a line's end where lines matter, and the end of all."""

    kind: Kind
    text: str
    start: int
    end: int

    def is_any(self, *words: str) -> bool:
        """Is it one of these names (in upper case) or signs?"""
        return self.kind in ("name", "sign") and self.text.upper() in words


@dataclass(frozen=True)
class Lexicon:
    """What the words of a language look like.

    Attributes:
        comment: Pattern of what begins a comment, up to the end of the line.
        first: Characters that a name may begin with beside letters and _.
        number: Pattern of numbers beside plain ones.
        by_lines: Does the end of a line end a statement?
    """

    comment: str
    first: str = ""
    number: str = ""
    by_lines: bool = False


def tokens(text: str, lexicon: Lexicon) -> list[Token]:
    """All words of a text, and a last one of the kind `end`; a character that begins none is a sign.

    A mark of UTF-8 at the beginning is passed over.
    """
    found = []
    for match in _pattern(lexicon).finditer(text):
        kind = match.lastgroup
        if kind != "space":
            found.append(Token(kind, match[0], match.start(), match.end()))  # type: ignore[arg-type]
    return [*found, Token("end", "", len(text), len(text))]


@cache
def _pattern(lexicon: Lexicon) -> re.Pattern[str]:
    letter = rf"A-Za-z_\x80-\xff{lexicon.first}"
    space = r"[ \t\f\v\r\x00]+" if lexicon.by_lines else r"\s+"
    special = rf"{lexicon.number}|" if lexicon.number else ""
    return re.compile(
        rf"(?P<space>\A\xef\xbb\xbf|{space}|(?:{lexicon.comment})[^\n]*)"
        rf"|(?P<number>{special}(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
        rf"|(?P<name>[{letter}][\w$\x80-\xff]*)"
        r'|(?P<text>"[^"\n]*"?)'
        r"|(?P<line>\n)"
        r"|(?P<sign>:=|<=|>=|<>|==|!=|\S|.)",
        re.ASCII,
    )
