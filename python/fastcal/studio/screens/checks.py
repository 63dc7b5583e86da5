# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A few new poses of an arm against its model: does it still hold, what to do, and all checks over time."""

from __future__ import annotations

import datetime
import re
from pathlib import PurePath
from typing import Any

from nicegui import events, ui

from fastcal.errors import InvalidInput
from fastcal.io.atomic import write_bytes
from fastcal.report.language import _
from fastcal.said import said
from fastcal.studio.files import address
from fastcal.studio.project import Project
from fastcal.studio.shell import card, command_line, drop_here, job_bar, told
from fastcal.studio.state import Studio

CHECKS, HISTORY = "checks", "history"
_GRADES = {"holds": "text-positive", "changed": "text-negative", "cannot_tell": "text-warning"}
_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")


def build_checks(studio: Studio) -> None:
    """The card: which arm, its new poses, the date; what was found below, and the page of all checks."""
    project = studio.project
    hint = _("Five to ten poses, measured later, in a measurement file. Each check is kept in the folder {folder}.",
             folder=CHECKS)  # fmt: skip
    with card(_("Does it still hold?"), hint):
        with ui.row().classes("items-end gap-4"):
            there = models_of(project)
            model = ui.select(there, value=there[0] if there else None, label=_("Model")).classes("w-64")
            model.props('data-test="check-model"')
            date = ui.input(_("Date"), value=datetime.date.today().isoformat()).classes("w-36")

            async def arrived(event: events.UploadEventArguments) -> None:
                with told():
                    start(await event.file.read())
                upload.reset()

            upload = ui.upload(label=_("Drop the new poses (.csv)"), auto_upload=True, on_upload=arrived)
            upload.classes("w-72").props('flat bordered data-test="drop-check"')
            drop_here(upload)
        line = ui.column().classes("w-full")

        def start(content: bytes) -> None:
            if not model.value:
                raise InvalidInput(said("there is no calibrated model yet: calibrate on Result, or a fleet here"))
            if not _DATE.fullmatch(date.value or ""):
                raise InvalidInput(said("expected the date as YYYY-MM-DD, got {date}", date=date.value or "-"))
            arm = PurePath(model.value).parent.name
            kept = f"{CHECKS}/{arm}/{date.value}"
            project.path(kept).parent.mkdir(parents=True, exist_ok=True)
            write_bytes(project.path(f"{kept}.csv"), content)
            studio.start(
                "check", said("check of {arm}", arm=arm), "check", model=model.value, kept=kept, date=date.value,
                checks=CHECKS, out=HISTORY,
            )  # fmt: skip
            line.clear()
            with line:
                asked = [model.value, f"{kept}.csv", "--date", date.value]
                command_line(project.remember(["check", *asked, "-o", f"{kept}.json"]))
                command_line(project.remember(["history", CHECKS, "-o", HISTORY]))

        found = ui.column().classes("w-full")

        def show(result: dict[str, Any]) -> None:
            found.clear()
            with found:
                sentence = ui.label(result["sentence"]).classes(f"text-lg {_GRADES[result['verdict']]}")
                sentence.props(f'data-test="checked" data-verdict="{result["verdict"]}"')
                if result["act"]:
                    ui.label(result["act"]).props('data-test="act"')
                with ui.row():
                    ui.link(_("The page of this check"), address(result["page"]), new_tab=True)
                    all_checks = ui.link(_("All checks over time"), address(f"{HISTORY}/report.html"), new_tab=True)
                    all_checks.props('data-test="history-link"')

        job_bar(studio, "check", show)


def models_of(project: Project) -> list[str]:
    """Calibrated models of the project, its fleet's as well."""
    fleet = sorted(str(path.relative_to(project.folder)) for path in project.folder.glob("fleet/*/model.yaml"))
    return [*project.models(), *fleet]
