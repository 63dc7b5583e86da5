# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The language of a page: English sentences in code and templates, their translations in catalogues (messages/).

A catalogue is a YAML mapping of the English message to the other; placeholders {name} appear in both. What a catalogue
does not have stays English; a test holds that nothing is missing.
"""

from __future__ import annotations

import functools
import importlib.resources
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import yaml

from fastcal.report.retelling import Retelling
from fastcal.said import Said, filled

LANGUAGES = ("en", "de")
LANGUAGE = "FASTCAL_LANGUAGE"  # the variable that names it where an option does not
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # in C it takes a twentieth of the time
_homes: ContextVar[tuple[str, ...]] = ContextVar("homes", default=("fastcal.report",))  # packages with catalogues
_retellings: dict[int, Retelling] = {}  # by the catalogue, which each keeps
language: ContextVar[str] = ContextVar("language", default="en")


@contextmanager
def in_language(name: str) -> Iterator[None]:
    """Texts and numbers made inside are in that language."""
    token = language.set(name)
    try:
        yield
    finally:
        language.reset(token)


def _(message: str, /, **values: Any) -> str:
    """The message in the language of the page, its placeholders {name} filled; a brace itself is written twice.

    A text of another room (fastcal.said) is said again in that language, alone or as a value.
    """
    known = catalogue(language.get())
    if isinstance(message, Said):
        return message.again(lambda text: known.get(text, text), decimal_sign())
    return filled(known.get(message, message), values, lambda text: known.get(text, text), decimal_sign())


def retold(note: str) -> str:
    """A note or an error of a lower room in the language of the page, whether the room said it in parts or as it is."""
    if isinstance(note, Said):
        return _(note)
    if language.get() == "en":
        return note
    known = catalogue(language.get())
    return _retellings.setdefault(id(known), Retelling(known, decimal_sign())).again(note)


def mid_sentence(name: str) -> str:
    """A heading's noun as written within a sentence: small in English, as it is in German."""
    return name.lower() if language.get() == "en" else name


def decimal_sign() -> str:
    """The decimal sign of the language of the page."""
    return "," if language.get() == "de" else "."


@contextmanager
def messages_of(package: str) -> Iterator[None]:
    """Inside, the catalogues are also those in the folder messages/ of another package."""
    token = _homes.set((*_homes.get(), package))
    try:
        yield
    finally:
        _homes.reset(token)


def catalogue(name: str) -> Mapping[str, str]:
    """The translations into a language, by the English message; empty for English."""
    return {} if name == "en" else _read(name, _homes.get())


@functools.cache
def _read(name: str, homes: tuple[str, ...]) -> Mapping[str, str]:
    found: dict[str, str] = {}
    for file in (file for home in homes for file in (importlib.resources.files(home) / "messages").iterdir()):
        if file.name.partition(".")[0].partition("_")[0] == name:  # de.yaml, and what is not of pages: de_studio.yaml
            found |= yaml.load(file.read_text(encoding="utf-8"), _Loader)  # noqa: S506  a safe one
    return found
