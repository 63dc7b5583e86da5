# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal history`: checks and models of an arm, or of a fleet, over time; history.json and report.html out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fastcal.cli.console import progress, tell, warn
from fastcal.cli.options import PageLanguage

ALARM = 4


def history(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Checks (JSON) and models (YAML), of one arm or of many.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="OUT", help="The folder for history.json and report.html."),
    ] = None,
    page_language: PageLanguage = "en",
) -> None:
    """Show checks and models over time.

    With control limits and alarms; exit code 4 if the last check of an arm shows a change or raises an alarm. Arms are
    told apart by serial number, or else by the folder of their files.
    """
    from fastcal.io.folder import check_folder
    from fastcal.monitoring.history import history as read
    from fastcal.report.monitoring_files import HISTORY_FILES, write_history
    from fastcal.report.summaries import summary

    if output is not None:
        check_folder(output, HISTORY_FILES)
    with progress() as show:
        show("reading")
        found = read(folder)
    if output is not None:
        write_history(found, output, language=page_language)
    warn(found.notes)
    tell(found, summary(found), output)
    if any(arm.state in ("changed", "alarm") for arm in found.arms):
        raise typer.Exit(ALARM)
