# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Reading of program text: comments blanked out in place, lists with the place of every piece."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fastcal.programs.program import Document, Number

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
LARGEST = 1e12  # mm or deg; 9E9 stands for an axis that is not there
DEEPEST = 50  # brackets within brackets


def blanked(text: str, comment: str) -> str:
    """The text with comments (from `comment` to the end of the line) and quoted texts made spaces, in place."""
    pattern = rf'"[^"\n]*"?|{comment}[^\r\n]*'
    return re.sub(pattern, lambda match: " " * len(match[0]), text)


@dataclass(frozen=True)
class Piece:
    """A stretch of text without the space around it."""

    text: str
    start: int
    end: int


def trimmed(text: str, start: int, end: int) -> Piece:
    """The piece text[start:end], less the space at its ends."""
    inner = text[start:end]
    left = start + len(inner) - len(inner.lstrip())
    return Piece(inner.strip(), left, left + len(inner.strip()))


def split(text: str, start: int, end: int, separator: str = ",") -> list[Piece]:
    """The pieces of text[start:end] between separators outside brackets."""
    pieces, depth, at = [], 0, start
    for place in range(start, end):
        character = text[place]
        if character in "([{":
            depth += 1
        elif character in ")]}":
            depth -= 1
        elif character == separator and depth == 0:
            pieces.append(trimmed(text, at, place))
            at = place + 1
    pieces.append(trimmed(text, at, end))
    return pieces


def closing(text: str, start: int) -> int:
    """The place after the bracket that closes the one at `start`; -1 where none does, or it holds too many levels."""
    depth = 0
    for match in re.compile(r"[\[\](){}]").finditer(text, start):
        depth += 1 if match[0] in "([{" else -1
        if depth == 0:
            return match.end()
        if depth > DEEPEST:  # or many open brackets would each be followed to the end of the text
            return -1
    return -1


def number(document: Document, place: int, piece: Piece, unit: str, what: str) -> Number:
    """A piece as a number; ParseError with its line where it is none."""
    if not re.fullmatch(NUMBER, piece.text) or not abs(float(piece.text)) <= LARGEST:
        expected = f"a number of at most {LARGEST:g}" if re.fullmatch(NUMBER, piece.text) else "a number"
        raise document.error(piece.start, f"{what}: expected {expected}, got '{piece.text:.40}'")
    return Number(place, piece.start, piece.end, piece.text, float(piece.text), unit)
