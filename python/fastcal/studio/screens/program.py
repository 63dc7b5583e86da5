# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Program: a robot program before and after, its targets in space, its text as a comparison, the file to take."""

from __future__ import annotations

import difflib
import html
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import events, run, ui

from fastcal.compensation import (
    CompensatedProgram,
    TargetRefused,
    compensate_program,
    kilograms,
    shared_in_words,
    target_points,
)
from fastcal.errors import FastcalError
from fastcal.io.programs import load_program, write_programs
from fastcal.io.robot_file import load_robot
from fastcal.programs import SUFFIXES, Program, carried, foreign, language_of, other_language, refusal, stated_masses
from fastcal.report.formatting import fixed
from fastcal.report.language import _, retold
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot
from fastcal.said import sentence_of
from fastcal.studio import pictures
from fastcal.studio.files import address
from fastcal.studio.project import INPUTS
from fastcal.studio.shell import card, command_line, decimals, drop_here, refuse, table, told
from fastcal.studio.state import Studio
from fastcal.units import from_si

OUT = "programs"
_READ = ", ".join(SUFFIXES)
_TIMES = 50  # so much longer are the arrows
_FEW = 10  # targets are shown without a space below them


def build(studio: Studio) -> None:
    """Builds the screen."""
    project = studio.project
    models = project.models()
    if not models:
        ui.label(_("There is no calibrated model yet."))
        ui.link(_("To the screen Result"), "/result")
        return

    def programs() -> list[str]:
        folder = project.path(INPUTS)
        found = sorted(folder.iterdir()) if folder.is_dir() else []
        read = [path.name for path in found if language_of(path.name) and path.suffix.lower() != ".dat"]
        return [f"{INPUTS}/{name}" for name in read]

    hint = _("RAPID (.mod), KRL (.src with its .dat), TP (.ls) or URScript (.script).")
    with card(_("Which program, by which model"), hint), ui.row().classes("items-end gap-4"):

        async def arrived(event: events.UploadEventArguments) -> None:
            with told():
                name, content = event.file.name, await event.file.read()
                if why := _not_read(name, content):
                    refuse(why)
                else:
                    name = project.receive(name, content)
                    source.set_options(programs(), value=name if name in programs() else source.value)
            upload.reset()

        upload = ui.upload(label=_("Drop a program"), auto_upload=True, multiple=True, on_upload=arrived)
        upload.props('flat bordered data-test="drop-program"').classes("w-60")
        drop_here(upload)
        there = programs()
        source = ui.select(there, value=there[0] if there else None, label=_("Program")).classes("w-64")
        model = ui.select(models, value=models[0], label=_("Model")).classes("w-56")
        payload = ui.number(_("Payload, kg"), min=0).classes("w-28").props("stack-label")

        async def change() -> None:
            if not source.value:
                ui.notify(_("drop a program first"))
                return
            out.clear()
            with out:
                robot, path = load_robot(project.path(model.value)), project.path(source.value)
                options: dict[str, Any] = {} if payload.value is None else {"payload": float(payload.value)}
                try:
                    program = load_program(path)
                    found = await run.io_bound(partial(compensate_program, robot, program, **options))
                except FastcalError as error:
                    _refused(studio, robot, path, error)
                    return
                if found is None:  # the window was closed
                    return
                place = project.path(f"{OUT}/{path.name}")
                place.parent.mkdir(exist_ok=True)
                files = write_programs([(place, found.documents)])
                words = ["compensate", model.value, source.value]
                words += ["--payload-kg", f"{payload.value:g}"] if options else []
                _shown(studio, robot, program, found, files, project.remember([*words, "-o", f"{OUT}/{path.name}"]))

        ui.button(_("Compensate"), on_click=change).props('data-test="compensate"')
        stated = ui.label().classes("text-sm w-full").props('data-test="stated"')

        def say_payload() -> None:
            known, missing = _payload_of(project.path(source.value)) if source.value else ("", "")
            stated.text = f"{known} {missing}".strip()
            payload.props(f'placeholder="{_("as stated") if known else 0}"')

        source.on_value_change(say_payload)
        say_payload()
    out = ui.column().classes("w-full")


def _not_read(name: str, content: bytes) -> str:
    """Why a file is no program that is read; empty where it may be one."""
    if (other := other_language(name, content)) is not None:
        return refusal(name, other)
    if language_of(name) is None:
        return _("{name}: no robot program, by its ending; read are {endings}", name=name, endings=_READ)
    return ""


def _payload_of(path: Path) -> tuple[str, str]:
    """What a program states that the arm carries, and what of it is not known; empty where there is nothing to say."""
    try:
        program = load_program(path)
    except FastcalError:  # said when it is compensated
        return "", ""
    masses, unknown = stated_masses(program, {}), dict.fromkeys(w for c in carried(program, {}) for w in c.unknown)
    known = _("Payload as the program states it: {stated}.", stated=_(kilograms(masses))) if masses else ""
    why = "; ".join(map(retold, unknown))
    return known, _("Enter the payload: {why}.", why=why) if why else ""


def _own(studio: Studio, text: str) -> str:
    """A sentence with the project's files as the screens call them."""
    return text.replace(f"{studio.project.folder}/", "")


def _refused(studio: Studio, robot: Robot, path: Path, error: FastcalError) -> None:
    """Why a program was not compensated; its targets in space where one of them cannot be reached, that one in red."""
    told = ui.label(_own(studio, retold(sentence_of(error)))).classes("text-negative")
    told.props('data-test="refused" role=alert')
    if not isinstance(error, TargetRefused):
        return
    program = load_program(path)
    points = target_points(robot, program)
    known = [k for k in range(len(points)) if np.isfinite(points[k]).all()]
    if not known:
        return
    colours = [pictures.RED if program.targets[k] == error.target else pictures.BLUE for k in known]
    texts = [retold(program.targets[k].name) for k in known]
    nominal = nominal_robot(robot)
    traces = [pictures.cloud(pictures.millimetres(points[known]), colours, texts, 5)]
    with card(_("In space"), _("In red the target that cannot be reached.")):
        shown = pictures.scene([*traces, *pictures.arm(nominal, np.zeros(nominal.joint_count))])
        ui.plotly(shown).classes("w-full").props('data-test="unreached"')


def _shown(
    studio: Studio, robot: Robot, program: Program, found: CompensatedProgram, files: list[Path], line: str
) -> None:
    error = from_si(found.error, "mm")
    with card(_("What it does")):
        count = len(found.targets)
        taken = _(
            "{targets}; uncorrected, the tool misses them by {mean:.2f} mm in the mean, {most:.2f} mm at most",
            targets=_("1 target") if count == 1 else _("{count} targets", count=count),
            mean=float(error.mean()),
            most=float(error.max()),
        )
        ui.label(taken).classes("text-lg").props('data-test="taken"')
        if (shared := shared_in_words(found.shift)) is not None:
            ui.label(_(shared)).classes("text-sm").props('data-test="shared"')
        foreign_to = foreign(robot.name, program.language.name)
        for sentence in (*([foreign_to] if foreign_to else []), *found.left, *found.assumed):
            ui.label(f"⚠ {_own(studio, retold(sentence))}").classes("text-warning")
        for sentence in found.notes:
            ui.label(f"• {_own(studio, retold(sentence))}").classes("text-sm").props('data-test="note"')
        for file in files:
            name = str(file.relative_to(studio.project.folder))
            load = ui.button(_("Download {file}", file=file.name), icon="download")
            load.props('download data-test="download"')
            load.props["href"] = address(name)  # not parsed: a name may hold anything
        command_line(line)
    nominal = nominal_robot(robot)
    # What the pendant's robot and the real one do at the program's own joints, in the robot's base.
    before = nominal.forward(found.nominal_q)[:, :3, 3]
    points = pictures.millimetres(before)
    shift = pictures.millimetres(found.shift[:, :3])
    texts = [f"{retold(t.name)}: {fixed(float(e), 2)} mm" for t, e in zip(found.targets, error, strict=True)]
    with ui.row().classes("w-full gap-3 no-wrap max-md:flex-wrap"):
        with card(_("In space"), _("Targets, and where they are sent instead, {times} times as long.", times=_TIMES)):
            traces: list[dict[str, Any]] = [pictures.cloud(points, pictures.BLUE, texts, 5),
                                            pictures.arrows(points, shift, _TIMES, pictures.AMBER)]  # fmt: skip
            ui.plotly(pictures.scene([*traces, *pictures.arm(nominal, found.nominal_q[0])])).classes("w-full")
        with card(_("Targets")):
            rows = [
                {"target": retold(t.name), "line": t.line, "error": round(float(e), 3),
                 "turn": round(float(np.abs(from_si(found.q[k] - found.nominal_q[k], "deg")).max()), 4)}
                for k, (t, e) in enumerate(zip(found.targets, error, strict=True))
            ]  # fmt: skip
            titles = {
                "target": _("name"),
                "line": _("line"),
                "error": _("error, mm"),
                "turn": _("largest joint change, °"),
            }
            columns = [{"headerName": title, "field": key, "flex": 1} for key, title in titles.items()]
            for column, places in zip(columns[2:], (3, 4), strict=True):
                column[":valueFormatter"] = decimals(places)
            if len(rows) > _FEW:
                table({"columnDefs": columns, "rowData": rows}).classes("h-96")
            else:
                table({"columnDefs": columns, "rowData": rows, "domLayout": "autoHeight"}).classes("h-auto")
    with card(_("In the text")):
        for old, new in zip(program.documents, found.documents, strict=True):
            ui.html(_difference(old.text, new.text), sanitize=False).classes("w-full").props('data-test="difference"')


def _difference(before: str, after: str) -> str:
    """The lines that changed, each with what it was; our own markup around escaped text."""
    colours = {"-": "rgba(179,38,30,.15)", "+": "rgba(46,125,79,.18)"}
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="", n=1)
    parts = [
        f'<div style="background:{colours.get(line[:1], "transparent")}">{html.escape(line) or "&nbsp;"}</div>'
        for line in list(lines)[2:]
    ]
    return f'<pre style="overflow-x:auto;font-size:.8rem;max-height:30rem">{"".join(parts)}</pre>'
