# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The positions of the section /POS of an LS file, P[n:"comment"]{ GP1: ... };."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from fastcal.programs.book import LARGEST
from fastcal.programs.program import Document, Number, Target, Word

POSE = ("X", "Y", "Z", "W", "P", "R")

_POSITION = re.compile(r"^[ \t]*P\[\s*(\d+)[^\]\n]*\]\s*\{([^{}]*)\}\s*;", re.M)
_HEAD = re.compile(r"^[ \t]*P\[[^\]\n]*\]\s*\{", re.M)
_GROUP = re.compile(r"GP(\d+)\s*:")
_VALUE = re.compile(r"\b(X|Y|Z|W|P|R|[JE]\d)\s*=[ \t]*([^\s,]*)[ \t]*(mm|deg)?")
_CONFIGURATION = re.compile(r"CONFIG\s*:\s*'([^'\n]*)'")
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"


@dataclass(frozen=True)
class Taught:
    """A position of group 1.

    Attributes:
        index: n of P[n].
        target: None where it holds no pose of the tool and no joints.
        why: The reason for that.
        at: Where it is in the document.
        external: The external axes of the same group, as text, with their units.
    """

    index: int
    target: Target | None
    at: int
    external: tuple[str, ...] = ()
    why: str = ""


def positions(document: Document, place: int, start: int) -> Iterator[Taught]:
    """The positions behind `start`.

    Raises:
        ParseError: One is not made of the numbers that it needs, or its braces don't close; names the line.
    """
    ends = set()
    plain = re.sub(r"'[^'\n]*'", lambda match: " " * len(match[0]), document.text)  # CONFIG holds letters of values too
    for match in _POSITION.finditer(document.text, start):
        ends.add(match.start())
        groups = [*_GROUP.finditer(document.text, match.start(2), match.end(2))]
        if not groups:
            raise document.error(match.start(), f"P[{match[1]}]: expected a group GP1: of positions")
        for group, after in zip(groups, [*groups[1:], None], strict=True):
            if group[1] == "1":
                stop = after.start() if after else match.end(2)
                yield _taught(document, place, plain, int(match[1]), (group.end(), stop), match.start())
    for head in _HEAD.finditer(document.text, start):
        if head.start() not in ends:
            raise document.error(head.start(), "expected a position P[n]{ ... }; with its end")


def _taught(document: Document, place: int, plain: str, index: int, span: tuple[int, int], at: int) -> Taught:
    name = f"P[{index}]"
    found = {m[1]: m for m in _VALUE.finditer(plain, *span)}
    external = tuple(f"{key} = {m[2]} {m[3] or ''}".rstrip() for key, m in found.items() if key.startswith("E"))
    if any(set(m[2]) == {"*"} for m in found.values()):
        return Taught(index, None, at, why="it was never taught")
    if re.search(r"\bRX\s*=", plain[slice(*span)]):
        return Taught(index, None, at, why="it is the pose of a part for a tool that stands outside")
    joints = sorted(key for key in found if key.startswith("J"))
    keys = tuple(joints) if joints else POSE
    if missing := [key for key in keys if key not in found]:
        raise document.error(at, f"{name}: expected {', '.join(keys)}, but {', '.join(missing)} is not given")
    numbers: list[Number] = []
    for key in keys:
        match = found[key]
        unit = match[3] or ("mm" if key in "XYZ" else "deg")
        numbers.append(_number(document, place, match, unit, f"{name}, {key}"))
    words = {}
    if not joints and (configuration := _CONFIGURATION.search(document.text, *span)):
        words["CONFIG"] = Word(place, configuration.start(1), configuration.end(1), configuration[1])
    text = document.text[slice(*span)]
    tool, frame = (re.search(rf"\b{key}\s*:\s*(\w+)", text) for key in ("UT", "UF"))
    target = Target(
        name,
        document.line(at),
        "joints" if joints else "pose",
        tuple(numbers),
        words,
        *(None if given is None or given[1].upper() == "F" else given[1] for given in (tool, frame)),
    )
    return Taught(index, target, at, external)


def _number(document: Document, place: int, value: re.Match[str], unit: str, what: str) -> Number:
    """The value of a match as a number; ParseError with its line where it is none."""
    text, start, end = value[2], value.start(2), value.end(2)
    if not re.fullmatch(_NUMBER, text) or not abs(float(text)) <= LARGEST:
        expected = f"a number of at most {LARGEST:g}" if re.fullmatch(_NUMBER, text) else "a number"
        raise document.error(start, f"{what}: expected {expected}, got '{text:.40}'")
    return Number(place, start, end, text, float(text), unit)
