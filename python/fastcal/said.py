# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sentences of rooms that know no language: English texts that remember their parts, so that a page can translate them.

A room writes `said("{joint} is off by {size:.2f} mm", joint=joint, size=size)`; files and the console have the English
text as it is, and the pages' `_` (fastcal.report.language) says it again in another language.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import reduce
from string import Formatter
from typing import Any


class Said(str):
    """An English text, with the message that it was made of and the values {name} in it."""

    __slots__ = ("message", "values")
    message: str
    values: dict[str, Any]

    def __new__(cls, message: str, /, **values: Any) -> Said:
        """The message with its values in their places; a brace itself is written twice."""
        text = super().__new__(cls, message.format(**values))
        text.message, text.values = message, values
        return text

    def __getnewargs_ex__(self) -> tuple[tuple[str], dict[str, Any]]:
        """What a copy is made of."""
        return (self.message,), self.values

    def again(self, translate: Callable[[str], str], decimal_sign: str) -> str:
        """The text in another language: its message translated, and so its values, numbers with that decimal sign."""
        return filled(translate(self.message), self.values, translate, decimal_sign)


class Capital(Said):
    """A text that begins with a large letter in every language."""

    __slots__ = ()

    def __new__(cls, message: str, /, **values: Any) -> Capital:
        """As said, the first letter large."""
        plain = message.format(**values)
        text = str.__new__(cls, plain[:1].upper() + plain[1:])
        text.message, text.values = message, values
        return text

    def again(self, translate: Callable[[str], str], decimal_sign: str) -> str:
        """In another language, the first letter large."""
        text = super().again(translate, decimal_sign)
        return text[:1].upper() + text[1:]


def capital(text: str) -> Said:
    """The text, its first letter large."""
    return Capital("{text}", text=text)


def said(message: str, /, **values: Any) -> Said:
    """A text that a page can say in its language."""
    return Said(message, **values)


def failure(why: str, act: str) -> Said:
    """Why something has no result, and the one thing to do about it."""
    return Said("{why}; {act}", why=why, act=act)


def parts_of_failure(told: str) -> tuple[str, str]:
    """Why, and what to do about it; "" for what a text that was not said by `failure` leaves open."""
    if isinstance(told, Said) and "act" in told.values:
        return told.values["why"], told.values["act"]
    return told, ""


def sentence_of(error: Exception) -> str:
    """The sentence of an error, with its parts where it has any, so that a page can translate it."""
    told = error.args[0] if error.args else None
    if not isinstance(told, Said):
        return str(error)
    where = str(error).removesuffix(told)  # a file and a line before it
    return joined("", [where, told]) if where else told


def joined(between: str, parts: Iterable[str]) -> Said:
    """Parts, each in the page's language, with something between them that all languages share."""
    parts = list(parts)
    return Said(between.join(f"{{part{k}}}" for k in range(len(parts))), **{f"part{k}": p for k, p in enumerate(parts)})


def chained(message: str, parts: Iterable[str]) -> str:
    """Parts from the first to the last by a message of {first} and {second}, as "{first} or {second}"; "" for none."""
    parts = list(parts)
    return reduce(lambda first, second: said(message, first=first, second=second), parts) if parts else ""


def first_few(parts: Sequence[object], most: int = 5) -> Said:
    """The first parts of a list and how many more there are: 3, 8, 12, 15, 21 and 16 more."""
    shown = joined(", ", [part if isinstance(part, str) else str(part) for part in parts[:most]])
    return said("{shown} and {count} more", shown=shown, count=len(parts) - most) if len(parts) > most else shown


def filled(message: str, values: dict[str, Any], translate: Callable[[str], str], decimal_sign: str) -> str:
    """A translated message with its values, each in that language where it is a text of a room."""
    out = []
    for literal, name, spec, _conversion in Formatter().parse(message):
        out.append(literal)
        if name is None:
            continue
        value = values[name]
        if isinstance(value, Said):
            out.append(value.again(translate, decimal_sign))
        elif isinstance(value, float):
            text = format(value, spec or "").replace(".", decimal_sign)
            stands_apart = text.endswith("%") and decimal_sign == ","  # as where decimals follow a comma
            out.append(f"{text[:-1]}\N{NARROW NO-BREAK SPACE}%" if stands_apart else text)
        else:
            out.append(format(value, spec or ""))
    return "".join(out)
