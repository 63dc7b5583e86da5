# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Options that a command gets from elsewhere, as typer reads them from its signature."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Collection, Mapping
from typing import Any, get_type_hints

Values = dict[str, Any]


def with_options(
    command: Callable[..., None],
    options: Mapping[str, tuple[Any, Any]],
    take: Callable[[Values, Values], None],
    instead_of: Collection[str] = (),
) -> Callable[..., None]:
    """The command with further options.

    Args:
        command: A function of keywords, whose parameters are its arguments and options.
        options: Annotation and default of each further option, by its name.
        take: Called with the command's own values, which it may change, and with those of the options.
        instead_of: Parameters of the command that only `take` fills: typer does not see them.
    """

    @functools.wraps(command)
    def run(**given: Any) -> None:
        chosen = {name: given.pop(name) for name in options}
        take(given, chosen)
        command(**given)

    # With the annotations resolved: as text they would be looked up among the names of this module.
    hints = {k: hint for k, hint in get_type_hints(command, include_extras=True).items() if k not in instead_of}
    own = [
        part.replace(annotation=hints[name])
        for name, part in inspect.signature(command).parameters.items()
        if name not in instead_of
    ]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=option)
        for name, (option, default) in options.items()
    ]
    run.__annotations__ = hints | {name: option for name, (option, _) in options.items()}
    run.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    return run
