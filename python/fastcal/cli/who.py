# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""--serial, --instrument, --operator, --customer and --date, for every command whose result keeps who measured what."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Annotated, Any

import typer

from fastcal.cli.signatures import with_options

Who = Mapping[str, str | None]
_TEXTS = {
    "serial": ("TEXT", "The arm's serial number, kept with the result."),
    "instrument": ("TEXT", "What measured, kept with the result."),
    "operator": ("TEXT", "Who measured, kept with the result."),
    "customer": ("TEXT", "For whom, kept with the result."),
    "date": ("YYYY-MM-DD", "When it was measured, kept with the result."),
}
OPTIONS: dict[str, tuple[Any, Any]] = {
    name: (Annotated[str | None, typer.Option(metavar=metavar, help=text)], None)
    for name, (metavar, text) in _TEXTS.items()
}


def with_who(command: Callable[..., None]) -> Callable[..., None]:
    """The command with these options, where it has a parameter `who`, which then holds them."""
    if "who" not in inspect.signature(command).parameters:
        return command
    return with_options(command, OPTIONS, lambda given, chosen: given.update(who=chosen), ("who",))
