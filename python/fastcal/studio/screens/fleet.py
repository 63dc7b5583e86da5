# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Fleet: a list of arms, calibrated or diagnosed side by side; a row an arm, coloured by how it stands among them."""

from __future__ import annotations

import os
from statistics import median
from typing import Any

from nicegui import events, ui

from fastcal.errors import InvalidInput
from fastcal.fleet import read_list
from fastcal.fleet.page import OUTSTANDING, STATUSES
from fastcal.io.tables import read_table
from fastcal.report.diagnosis_words import VERDICTS
from fastcal.report.formatting import MISSING, plural, significant
from fastcal.report.language import _, retold
from fastcal.said import said
from fastcal.studio.files import address
from fastcal.studio.project import MEASUREMENTS
from fastcal.studio.screens.checks import build_checks
from fastcal.studio.shell import card, command_line, drop_here, job_bar, told
from fastcal.studio.state import Studio

OUT = "fleet"
_COLUMNS = {
    "before_mm": said("before, mm"),
    "after_mm": said("after, mm"),
    "sigma_mm": said("noise, mm"),
    "outliers": said("outliers"),
    "unidentifiable": said("unidentifiable"),
}
_LIST = {"robot", "data"}
_NEARLY = 1.5  # times the median, from which on an arm is near to standing out


def build(studio: Studio) -> None:
    """Builds the screen."""
    project = studio.project

    def lists() -> list[str]:
        found = []
        for path in sorted(project.folder.glob("*.csv")):
            with path.open(encoding="utf-8", errors="replace") as file:
                titles = {title.strip().lower() for title in file.readline().replace(";", ",").split(",")}
            if titles >= _LIST:
                found.append(path.name)
        return found

    hint = _("A CSV file in the project's folder with the columns {asked} and, where wanted, {more}.",
             asked="robot, data", more="test, name")  # fmt: skip
    with card(_("Which arms"), hint):
        with ui.row().classes("items-end gap-4"):

            async def arrived(event: events.UploadEventArguments) -> None:
                from fastcal.io.atomic import write_bytes

                with told():
                    name = project.plain_name(event.file.name)
                    if not name.endswith(".csv") or name == MEASUREMENTS:
                        raise InvalidInput(
                            said("{name}: expected a list of arms, a CSV file with a name of its own", name=name)
                        )
                    write_bytes(project.path(name), await event.file.read())
                    source.set_options(lists(), value=name if name in lists() else None)
                upload.reset()

            upload = ui.upload(label=_("Drop a list (.csv)"), auto_upload=True, on_upload=arrived).props(
                "flat bordered"
            )
            upload.classes("w-72")
            drop_here(upload)
            there = lists()
            source = ui.select(there, value=there[0] if there else None, label=_("List")).classes("w-64")
            diagnosed = ui.switch(_("Diagnose each"))
            ui.button(_("Run"), on_click=lambda: start()).props('data-test="run-fleet"')
        line = ui.column().classes("w-full")

        def start() -> None:
            with told():
                if not source.value:
                    ui.notify(_("drop a list first"))
                    return
                count = len(read_list(project.path(source.value)))
                studio.start(
                    "fleet",
                    said("1 arm") if count == 1 else said("{count} arms", count=count),
                    "fleet",
                    arms=source.value,
                    out=OUT,
                    diagnosed=diagnosed.value,
                )
                line.clear()
                with line:
                    more = ["--diagnose"] if diagnosed.value else ["--reports"]
                    command_line(project.remember(["fleet", source.value, *more, "-o", OUT]))

        job_bar(studio, "fleet", lambda result: matrix.refresh())

    @ui.refreshable
    def matrix() -> None:
        table = project.path(f"{OUT}/fleet.csv")
        if table.exists():
            with told():
                _matrix(studio, _rows(read_table(table)))

    matrix()
    build_checks(studio)


def _rows(table: Any) -> list[dict[str, str]]:
    columns = {name: table.labels(k) for k, name in enumerate(table.names)}
    return [{name: column[row] for name, column in columns.items()} for row in range(len(table))]


def _shade(ratio: float) -> str:
    """The colour behind a size in times the fleet's median."""
    if ratio > OUTSTANDING:
        return "background: rgba(179,38,30,.35)"
    return "background: rgba(199,119,0,.25)" if ratio > _NEARLY else ""


def _matrix(studio: Studio, rows: list[dict[str, str]]) -> None:
    """A row an arm, those first that need a look; a click opens the arm's own page below."""
    usual = {key: median([float(row[key]) for row in rows if row.get(key)] or [0.0]) for key in _COLUMNS}

    def heat(row: dict[str, str]) -> float:
        value = row.get("after_mm") or ""
        return float(value) / (usual["after_mm"] or 1.0) if value else float("inf")

    def shade(key: str, text: str) -> str:
        if not text or key not in ("before_mm", "after_mm", "sigma_mm") or not usual[key]:
            return ""
        return _shade(float(text) / usual[key])

    failed = [row for row in rows if row.get("status") != "converged"]
    title = _("{arms}, {failed} without a model", arms=plural(len(rows), "arm"), failed=len(failed))
    hint = _("Red: more than twice the fleet's median; amber: more than one and a half times.")
    with card(title, hint):
        with (
            ui.grid(columns=f"2fr 1fr {'1fr ' * len(_COLUMNS)}2fr")
            .classes("w-full gap-0 studio-matrix")
            .props('data-test="matrix"')
        ):
            last = _("verdict") if any(row.get("verdict") for row in rows) else _("note")
            for title in (_("arm"), _("status"), *map(_, _COLUMNS.values()), last):
                ui.label(title).classes("text-sm text-gray-600 dark:text-gray-300 p-1")
            for row in sorted(rows, key=heat, reverse=True):
                folder = f"{OUT}/{row['name']}/report.html"
                if studio.project.path(folder).exists():
                    ui.link(row["name"], address(folder), new_tab=True).classes("p-1").props('data-test="arm-link"')
                else:
                    ui.label(row["name"]).classes("p-1")
                ui.label(_(STATUSES.get(row.get("status", ""), ""))).classes("p-1")
                for key in _COLUMNS:
                    text = row.get(key, "")
                    size = significant if key.endswith("_mm") else lambda value: f"{value:.0f}"
                    shown = size(float(text)) if text else MISSING
                    ui.label(shown).classes("p-1 font-mono").style(shade(key, text))
                verdict = VERDICTS.get(row.get("verdict", ""))
                if verdict is not None:
                    ui.label(_(verdict[0])).classes("p-1 text-sm").tooltip(row.get("causes", ""))
                else:
                    inside = f"{studio.project.folder}{os.sep}"  # a long path would hide what is wrong
                    message = retold(row.get("message", "").replace(inside, ""))
                    ui.label(message).classes("p-1 text-sm truncate said").tooltip(message)
        page = studio.project.path(f"{OUT}/report.html")
        if page.exists():
            ui.link(_("The fleet's page"), address(f"{OUT}/report.html"), new_tab=True)
