# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal studio`: the local web app beside the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fastcal.cli.console import emit, say
from fastcal.cli.options import PageLanguage


def studio(
    folder: Annotated[
        Path,
        typer.Argument(metavar="[FOLDER]", help="The project folder; it is created if it does not exist."),
    ] = Path("fastcal-studio"),
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to listen on, on this machine only; 0: any free port.")
    ] = 8310,
    demo: Annotated[bool, typer.Option("--demo", help="Fill an empty FOLDER with a simulated project first.")] = False,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
    page_language: PageLanguage = "en",
) -> None:
    """Open the studio: data, plan, measuring, result, programs.

    A web app that is reachable from this machine only; the printed address contains the access token.
    """
    from fastcal.io import inputs
    from fastcal.studio.server import check_extra, serve

    check_extra()
    if demo:
        from fastcal.studio.demo import fill

        fill(folder, say)

    def tell(address: str) -> None:
        say(f"fastcal studio: {address}")
        emit({"address": address})

    with inputs.replaceable():  # a project is read and written all along
        serve(folder, port=port, show=browser, say=tell, page_language=page_language)
