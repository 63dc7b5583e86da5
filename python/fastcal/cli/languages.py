# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The language in which a command speaks: that of its page, also where it writes none."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, get_type_hints

import typer

from fastcal.cli.console import spoken
from fastcal.cli.options import PageLanguage, language_named
from fastcal.cli.signatures import with_options

OPTION, VARIABLE = "--page-language", "FASTCAL_LANGUAGE"


def asked_for(arguments: Sequence[str]) -> str:
    """The language that a command line or the environment names, for what is said before the options are read."""
    given = [name for option, name in pairwise(arguments) if option == OPTION]
    given += [text.partition("=")[2] for text in arguments if text.startswith(f"{OPTION}=")]
    try:
        return language_named([*given, os.environ.get(VARIABLE) or "en"][0])
    except typer.BadParameter:  # which is said when the options are read
        return "en"


def with_language(command: Callable[..., None]) -> Callable[..., None]:
    """The command, which speaks the language of --page-language; with that option where it has it not itself."""
    has_own = "page_language" in get_type_hints(command)

    @functools.wraps(command)
    def speaking(**given: Any) -> None:
        chosen = given["page_language"] if has_own else given.pop("page_language")
        spoken.set(chosen)
        if chosen == "en":
            command(**given)
            return
        from fastcal.report.language import in_language

        with in_language(chosen):
            command(**given)

    if has_own:
        return speaking
    return with_options(speaking, {"page_language": (PageLanguage, "en")}, lambda given, chosen: given.update(chosen))
