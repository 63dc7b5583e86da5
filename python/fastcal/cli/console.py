# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What commands say to a person: progress and warnings on standard error, results on standard output."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import typer


def say(text: str) -> None:
    """A line on standard output."""
    typer.echo(text)


def warn(warnings: Iterable[str]) -> None:
    """A line on standard error for each."""
    for text in warnings:
        typer.echo(f"fastcal: warning: {text}", err=True)


def fail(text: str) -> None:
    """The one line of an error, on standard error."""
    typer.echo(f"fastcal: error: {' '.join(text.splitlines())}", err=True)


@contextmanager
def progress() -> Iterator[Callable[[str], None]]:
    """Gives a function that shows what is being done, on a terminal; in a pipe it shows nothing."""
    if not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.live import Live
    from rich.spinner import Spinner

    with Live(console=Console(stderr=True), transient=True) as live:
        # Drawn at once: a step may end before the next turn of the spinner.
        yield lambda text: live.update(Spinner("dots", text=f"{text} ..."), refresh=True)
