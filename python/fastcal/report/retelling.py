# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A finished English sentence in another language: found among the catalogue's messages by its fixed words.

Errors and notes of lower rooms are plain sentences, f"{path}: holds no rows; expected at least one". The catalogue has
each as one message with placeholders; the message with the most fixed letters that the whole sentence fits is taken,
and the values that stand between its words are retold in turn: sentences by themselves, numbers with the other decimal
sign. What stands before ": " or beside "; " may be a sentence of its own. What no message fits stays as it is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cached_property
from string import Formatter
from typing import NamedTuple

_FEWEST = 8  # letters that a whole sentence must share with a message: fewer would fit by chance
# Placeholders of what users name, which no language changes, whatever number follows them.
_NAMES = re.compile(r"^(?:path|source|folder|file|files|name|names|own|title|titles|owner|output|text)\d*$")
_COUNT = re.compile(r"^(\d+) (\D+)$")
# A value that would still hold one of these was not understood, and stays as it is.
_ENGLISH = re.compile(r"\b(the|of|is|are|was|were|not|did|does|has|have|with|from|to|as|on|for|by|which|that|and|or)\b")
_NUMBER = re.compile(r"^([-+\N{MINUS SIGN}]?\d+)\.(\d+(?:e[-+]?\d+)?(?: [^\s.]+)?)$")


class Template(NamedTuple):
    """A message with placeholders: its fixed words, and the message in the other language."""

    words: tuple[str, ...]
    letters: int
    names: tuple[str, ...]
    pattern: str
    other: str

    def values_in(self, sentence: str) -> list[str] | None:
        """What stands in the places of the placeholders; None where the sentence is another."""
        if any(word not in sentence for word in self.words):
            return None
        found = re.fullmatch(self.pattern, sentence, re.DOTALL)
        return None if found is None else list(found.groups())


class Retelling:
    """The sentences of a language.

    Args:
        known: The other language's message by the English one.
        decimal_sign: Of its numbers.
    """

    def __init__(self, known: Mapping[str, str], decimal_sign: str) -> None:
        self.known = known
        self.decimal_sign = decimal_sign

    @cached_property
    def templates(self) -> list[Template]:
        """Of the messages with placeholders, that with the most fixed letters first."""
        found = [template for english, other in self.known.items() if (template := _template(english, other))]
        return sorted(found, key=lambda template: -template.letters)

    def again(self, sentence: str) -> str:
        """The sentence in the other language."""
        return self._best(sentence, {})[1]

    def _best(self, sentence: str, done: dict[str, tuple[int, str]]) -> tuple[int, str]:
        """How many letters of messages a sentence has at best, alone or in parts, and how it is said with these."""
        if sentence in done:
            return done[sentence]
        best = (0, sentence)
        if sentence in self.known:
            best = (len(sentence), self.known[sentence])
        elif (found := self._template_of(sentence, _FEWEST)) is not None:
            best = (found[0].letters, self._filled(*found))
        for between in (": ", "; "):
            for at in (place.start() for place in re.finditer(between, sentence)):
                parts = [self._best(part, done) for part in (sentence[:at], sentence[at + len(between) :])]
                if (letters := sum(count for count, _text in parts)) > best[0]:
                    best = (letters, between.join(text for _count, text in parts))
        done[sentence] = best
        return best

    def _template_of(self, sentence: str, fewest: int) -> tuple[Template, list[str]] | None:
        for template in self.templates:
            if template.letters >= fewest and (values := template.values_in(sentence)) is not None:
                return template, values
        return None

    def _value(self, text: str) -> str:
        """What stands in a sentence in place of a placeholder: words of a message, a count of things, a number."""
        if text in self.known:
            return self.known[text]
        if number := _NUMBER.match(text):
            return self.decimal_sign.join(number.groups())
        if (count := _COUNT.match(text)) and count[2] in self.known:
            return f"{count[1]} {self.known[count[2]]}"
        told = self.again(text)
        if told == text and (found := self._template_of(text, 2)) is not None:
            told = self._filled(*found)
        return text if _ENGLISH.search(told) else told

    def _filled(self, template: Template, values: list[str]) -> str:
        told = {
            name: value if _NAMES.match(name) else self._value(value)
            for name, value in zip(template.names, values, strict=True)
        }
        return "".join(
            literal + (told[name] if name is not None else "")
            for literal, name, _spec, _conversion in Formatter().parse(template.other)
        )


def _template(english: str, other: str) -> Template | None:
    """Of a message with placeholders, none twice; None for another, and for what is no sentence but a page's code."""
    parts = list(Formatter().parse(english))
    names = tuple(name for _literal, name, _spec, _conversion in parts if name is not None)
    if not names or len(set(names)) < len(names) or "<" in english:
        return None
    pattern = "".join(re.escape(literal) + ("(.*?)" if name is not None else "") for literal, name, *_ in parts)
    words = tuple(literal for literal, *_more in parts if literal)
    return Template(words, sum(map(str.isalpha, "".join(words))), names, pattern, other)
