# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Plain data as YAML that a person likes to read and that loads back bit for bit, under YAML 1.1 and 1.2.

What fits is written on one line; longer mappings of short values are wrapped, the rest is a block.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

WIDTH = 120
_DASH = 3  # "- " before a row and the brace
_PLAIN_TEXT = re.compile(r"[A-Za-z][A-Za-z0-9_./@<-]*( [A-Za-z0-9_./@<-]+)*\Z")
# What YAML can hold as it is, in lines of their own; other line ends than \n would be read as \n.
_LITERAL = re.compile(
    r"[^\n ][\t\n\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]*\Z"
)
# Of numbers as Python writes them: 150.0, and 1e-07.
_NOT_SHORT = re.compile(r"\.0[,\]]|[\[ -]\de")
# Words that some YAML reader takes for something else than text.
_RESERVED = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}


class _Node(NamedTuple):
    """A value with its text on one line, which is made once however often a length is asked for."""

    value: Any
    line: str
    parts: Sequence[str] = ()  # of a collection, each on one line; none of a list of plain numbers
    entries: Sequence[_Node] = ()  # of a mapping, and of a list that holds collections


def yaml_text(data: dict[str, Any]) -> str:
    """The block text of a mapping, ending in a line end."""
    return "".join(f"{line}\n" for line in _block(_node(data), WIDTH))


def _node(value: Any) -> _Node:
    entries: list[_Node] = []
    if isinstance(value, dict):
        entries = [_node(entry) for entry in value.values()]
        parts = [f"{_scalar(key)}: {entry.line}" for key, entry in zip(value, entries, strict=True)]
        return _Node(value, "{" + ", ".join(parts) + "}", parts, entries)
    if isinstance(value, list):
        kinds = set(map(type, value))
        if kinds == {float}:  # the rows of a covariance: most of a model file
            return _Node(value, _numbers(value))
        if any(issubclass(kind, (dict, list)) for kind in kinds):
            entries = [_node(entry) for entry in value]
        parts = [entry.line for entry in entries] or [_scalar(entry) for entry in value]
        return _Node(value, "[" + ", ".join(parts) + "]", parts, entries)
    return _Node(value, _scalar(value))


def _block(node: _Node, width: int) -> list[str]:
    """Lines of a mapping or list, one entry or more lines each, of at most `width` where they allow it."""
    lines: list[str] = []
    if isinstance(node.value, dict):
        for key, entry in zip(node.value, node.entries, strict=True):
            head = f"{_scalar(key)}:"
            if isinstance(entry.value, str) and "\n" in entry.value and _LITERAL.match(entry.value):
                lines += _literal(head, entry.value)
                continue
            # A list of mappings (joints, effects) has a line each, even where all would fit on one.
            is_table = isinstance(entry.value, list) and any(isinstance(e.value, dict) for e in entry.entries)
            if not is_table and len(head) + 1 + len(entry.line) <= width:
                lines.append(f"{head} {entry.line}")
            else:
                lines += [head, *(f"  {line}" for line in _nested(entry, width - 2))]
        return lines
    for entry in node.entries:
        if isinstance(entry.value, (dict, list)) and len(entry.line) + _DASH > width:
            first, *rest = _wrapped(entry, width - _DASH)
            lines += [f"- {first}", *(f"   {line}" for line in rest)]
        else:
            lines.append(f"- {entry.line}")
    return lines


def _literal(head: str, text: str) -> list[str]:
    """Text of several lines as it is: |2 says how far it is indented; -, nothing or + keep no, one or all line ends."""
    lines = text.split("\n")
    ends = len(text) - len(text.rstrip("\n"))
    return [
        f"{head} |2{'-' if ends == 0 else '' if ends == 1 else '+'}",
        *(f"  {x}" if x else "" for x in lines[: -1 if ends else None]),
    ]


def _nested(node: _Node, width: int) -> list[str]:
    return _block(node, width) if node.entries else _wrapped(node, width)


def _wrapped(node: _Node, width: int) -> list[str]:
    """A flow collection or a scalar broken between its parts into lines of at most `width` where they allow it."""
    if not isinstance(node.value, (dict, list)):
        return [node.line]
    if not node.parts:
        return _wrapped_numbers(node.line, width)
    *others, last = node.parts
    pieces = [*(f"{part}," for part in others), last + node.line[-1]]
    pieces[0] = node.line[0] + pieces[0]
    lines, begin, length = [], 0, len(pieces[0])
    for i, piece in enumerate(pieces[1:], start=1):
        if length + 1 + len(piece) > width:
            lines.append(" ".join(pieces[begin:i]))
            begin, length = i, len(piece)
        else:
            length += 1 + len(piece)
    return [*lines, " ".join(pieces[begin:])]


def _wrapped_numbers(line: str, width: int) -> list[str]:
    """The same of numbers on one line, which hold no comma."""
    lines, begin = [], 0
    while len(line) - begin > width:
        end = line.rfind(", ", begin, begin + width + 1)
        end = end if end >= 0 else line.find(", ", begin)
        if end < 0:
            break
        lines.append(line[begin : end + 1])
        begin = end + 2
    return [*lines, line[begin:]]


def _scalar(value: Any) -> str:
    if isinstance(value, float):
        return _short(repr(value))
    if isinstance(value, str):
        return value if _PLAIN_TEXT.match(value) and value.lower() not in _RESERVED else _quoted(value)
    return json.dumps(value)


def _numbers(values: list[float]) -> str:
    """A list of plain floats on one line."""
    line = repr(values)
    return f"[{', '.join(map(_short, line[1:-1].split(', ')))}]" if _NOT_SHORT.search(line) else line


def _short(text: str) -> str:
    """What Python writes of a double, as YAML wants it: 150 for 150.0, and 1.0e-07, as YAML 1.1 wants the point."""
    if text[-2:] == ".0" and text != "-0.0":
        return text[:-2]
    return text if "." in text or "e" not in text else text.replace("e", ".0e")


def _quoted(text: str) -> str:
    """JSON's quotes; what can't be printed is escaped as one character, which JSON would make two."""
    quoted = json.dumps(text, ensure_ascii=False)
    if quoted.isprintable():
        return quoted
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in quoted)
