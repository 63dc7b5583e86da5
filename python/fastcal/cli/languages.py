# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The language in which a command speaks: that of its page, also where it writes none."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, get_type_hints

from fastcal.cli.options import PageLanguage
from fastcal.cli.signatures import with_options

_WITHOUT_PAGE = ("compensate", "design", "evaluate")


def with_language(name: str, command: Callable[..., None]) -> Callable[..., None]:
    """The command, whose texts are in the language of --page-language, where it has that option or is to have it."""
    has_own = "page_language" in get_type_hints(command)
    if not has_own and name not in _WITHOUT_PAGE:
        return command

    @functools.wraps(command)
    def speaking(**given: Any) -> None:
        from fastcal.report.language import in_language

        with in_language(given["page_language"] if has_own else given.pop("page_language")):
            command(**given)

    if has_own:
        return speaking
    return with_options(speaking, {"page_language": (PageLanguage, "en")}, lambda given, chosen: given.update(chosen))
