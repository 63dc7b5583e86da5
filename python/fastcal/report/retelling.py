# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A finished English sentence in another language: found among the catalogue's messages by its fixed words.

Errors and notes of lower rooms are plain sentences, f"{path}: holds no rows; expected at least one". The catalogue has
each as one message with placeholders; that message is taken which, with the values that stand between its words and are
retold in turn, accounts for the most letters. What stands before ": ", beside "; " or behind a full stop may be a
sentence of its own. Numbers get the other decimal sign; what no message fits stays as it is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cached_property
from itertools import chain, islice
from string import Formatter
from typing import NamedTuple

_FEWEST = 8  # letters that a whole sentence must share with a message: fewer would fit by chance
_MOST = 4  # messages that are tried on a sentence
_BETWEEN = (re.compile(r": |; |\. "), re.compile(r"(?<=[.!?]) "))  # sentences that stand in one
# Placeholders of what users name, which no language changes, whatever number follows them.
_NAMES = re.compile(r"^(?:path|source|folder|file|files|name|names|own|title|titles|owner|output|text)\d*$")
_COUNT = re.compile(r"^(\d+) (\D+)$")
# A value that would still hold one of these was not understood, and stays as it is.
_ENGLISH = re.compile(r"\b(the|of|is|are|was|were|not|did|does|has|have|with|from|to|as|on|for|by|which|that|and|or)\b")
_DECIMAL = r"[-+\N{MINUS SIGN}]?\d+\.\d+(?:e[-+]?\d+)?"
_NUMBERS = re.compile(rf"^{_DECIMAL}(?:, {_DECIMAL})*(?: [^\s.]+)?$")


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
        # Parts of sentences are put together with what stands between them: found apart, they stand alone.
        self.known = {english.strip(" ;,"): other.strip(" ;,") for english, other in known.items()} | dict(known)
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
        if sentence in self.known:
            return len(sentence), self.known[sentence]
        if sentence not in done:
            done[sentence] = (0, sentence)
            found = [self._filled(*each, done) for each in self._fitting(sentence, _FEWEST, _MOST)]
            for place in chain.from_iterable(between.finditer(sentence) for between in _BETWEEN):
                first, second = (self._best(p, done) for p in (sentence[: place.start()], sentence[place.end() :]))
                found.append((first[0] + second[0], f"{first[1]}{place[0]}{second[1]}"))
            done[sentence] = max([(0, sentence), *found], key=lambda each: each[0])
        return done[sentence]

    def _fitting(self, sentence: str, fewest: int, most: int) -> list[tuple[Template, list[str]]]:
        """Of the messages that a sentence fits, those with the most fixed letters, and what stands in their places."""
        fitting = (
            (template, values)
            for template in self.templates
            if template.letters >= fewest and (values := template.values_in(sentence)) is not None
        )
        return list(islice(fitting, most))

    def _value(self, text: str, done: dict[str, tuple[int, str]]) -> tuple[int, str]:
        """What stands in a sentence in place of a placeholder: words of a message, a count of things, a number."""
        if _NUMBERS.match(text):
            apart = text.replace(", ", "; ") if self.decimal_sign == "," else text
            return 0, re.sub(r"(?<=\d)\.(?=\d)", self.decimal_sign, apart)
        if (count := _COUNT.match(text)) and count[2] in self.known:
            return len(count[2]), f"{count[1]} {self.known[count[2]]}"
        letters, told = self._best(text, done)
        if not letters and (short := self._fitting(text, 2, 1)):
            letters, told = self._filled(*short[0], done)
        return (0, text) if _ENGLISH.search(told) else (letters, told)

    def _filled(self, template: Template, values: list[str], done: dict[str, tuple[int, str]]) -> tuple[int, str]:
        told = {
            name: (0, value) if _NAMES.match(name) else self._value(value, done)
            for name, value in zip(template.names, values, strict=True)
        }
        text = "".join(
            literal + (told[name][1] if name is not None else "")
            for literal, name, _spec, _conversion in Formatter().parse(template.other)
        )
        return template.letters + sum(letters for letters, _text in told.values()), text


def _template(english: str, other: str) -> Template | None:
    """Of a message with placeholders, none twice; None for another, and for what is no sentence but a page's code."""
    parts = list(Formatter().parse(english))
    names = tuple(name for _literal, name, _spec, _conversion in parts if name is not None)
    if not names or len(set(names)) < len(names) or "</" in english:
        return None
    pattern = "".join(re.escape(literal) + ("(.*?)" if name is not None else "") for literal, name, *_ in parts)
    words = tuple(literal for literal, *_more in parts if literal)
    return Template(words, sum(map(str.isalpha, "".join(words))), names, pattern, other)
