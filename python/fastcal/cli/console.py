# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What commands say to a person: progress and warnings on standard error, results on standard output."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Literal, Protocol

import typer

NOT_CONVERGED = 3  # the exit code of a fit that is no answer
CHANGED, CANNOT_TELL = 4, 3  # of a check
LEFT = 5  # the exit code of --strict where a part of a program was left as not understood
# What moves a terminal's cursor, colours it, names its window or turns the direction of writing.
_CONTROL = re.compile("[\x00-\x08\x0a-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]")

_WARNING, _ERROR = {"en": "warning", "de": "Warnung"}, {"en": "error", "de": "Fehler"}
_SEE = {"en": "see", "de": "siehe"}


def visible(text: str) -> str:
    """The text on one line, with control characters, which names in files may hold, written out as escapes."""
    return _CONTROL.sub(lambda found: ascii(found[0])[1:-1], text)


Manner = Literal["text", "quiet", "json"]
manner: ContextVar[Manner] = ContextVar("manner", default="text")
spoken: ContextVar[str] = ContextVar("spoken", default="en")  # the language, of which the English needs no catalogue


def retold(text: str) -> str:
    """A sentence of a lower room in the language of the command."""
    if spoken.get() == "en":
        return text
    from fastcal.report.language import in_language
    from fastcal.report.language import retold as again

    with in_language(spoken.get()):
        return again(text)


def say(text: str) -> None:
    """A line of a summary on standard output, where one is wanted."""
    if manner.get() == "text":
        typer.echo(visible(retold(text)))


def emit(content: Mapping[str, Any]) -> None:
    """The summary as JSON on standard output, where that is wanted."""
    if manner.get() == "json":
        from fastcal.io.results import json_text

        typer.echo(json_text(content), nl=False)


class Result(Protocol):
    """What a command found."""

    def to_json_dict(self) -> dict[str, Any]:
        """All of it."""


def tell(found: Result, lines: Iterable[str], output: Path | None = None) -> None:
    """A result: a few lines and the path of its report, where one was written; or all of it as JSON."""
    for line in lines:
        say(line)
    if output is not None:
        say(str(output / "report.html"))
    emit(found.to_json_dict())


def warn(warnings: Iterable[str]) -> None:
    """A line on standard error for each."""
    for text in warnings:
        typer.echo(f"fastcal: {_WARNING[spoken.get()]}: {visible(retold(text))}", err=True)


def fail(text: str, command: str = "") -> None:
    """The one line of an error, on standard error, and of which command the help tells more."""
    after = f" ({_SEE[spoken.get()]} {command} --help)" if command else ""
    line = visible(" ".join(retold(text).splitlines()))
    typer.echo(f"fastcal: {_ERROR[spoken.get()]}: {line}{after}", err=True)


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Gives a function that shows what is being done, on a terminal; in a pipe it shows nothing."""
    if manner.get() == "quiet" or not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.live import Live
    from rich.spinner import Spinner

    with Live(console=Console(stderr=True), transient=True) as live:
        # Drawn at once: a step may end before the next turn of the spinner.
        yield lambda text: live.update(Spinner("dots", text=f"{visible(retold(text))} ..."), refresh=True)
