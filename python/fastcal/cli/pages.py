# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""--open, for every command that writes a page for people."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from fastcal.cli.console import warn
from fastcal.cli.signatures import with_options

WITH_PAGE = frozenset(
    (
        *("calibrate", "diagnose", "compliance", "check", "update", "compare", "history", "train", "accept", "fleet"),
        *("paper", "demo", "detect"),
    )
)
_CLOCK = 2.0  # s; times of files may be as coarse as this

Open = Annotated[bool, typer.Option("--open", help="Open the report in the browser.")]


def with_page(name: str, command: Callable[..., None]) -> Callable[..., None]:
    """The command with --open, where it is one that writes a page."""
    if name not in WITH_PAGE:
        return command

    @functools.wraps(command)
    def shown(*, open_page: bool, **given: Any) -> None:
        began = time.time()
        try:
            command(**given)
        except typer.Exit:  # done, with a verdict that is told by its code
            if open_page:
                show(given.get("output"), began)
            raise
        if open_page:
            show(given.get("output"), began)

    def take(given: dict[str, Any], chosen: dict[str, Any]) -> None:
        given["open_page"] = chosen["open"]

    return with_options(shown, {"open": (Open, False)}, take)


def show(output: Path | None, began: float) -> None:
    """Opens the page that a command wrote into `output` since `began`; warns where there is none, or no browser."""
    import webbrowser

    page = None if output is None else _page_of(output)
    if page is None or not page.is_file() or page.stat().st_mtime < began - _CLOCK:
        warn(["--open: this run wrote no page; -o names the folder or the .html file for it"])
    elif not webbrowser.open(page.resolve().as_uri()):
        warn([f"--open: no browser could be started; the page is {page}"])


def _page_of(output: Path) -> Path:
    """The page in a folder of results, or the one beside a table."""
    return output / "report.html" if output.suffix.lower() not in (".html", ".csv") else output.with_suffix(".html")
