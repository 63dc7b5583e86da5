# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Result: calibrate or diagnose, the page in a frame, and effects switched off to see the gap move."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from fastcal.effects.entries import identity_options, traits_of
from fastcal.io.atomic import write_bytes
from fastcal.io.measurements import load_measurements
from fastcal.io.results import read_json
from fastcal.io.robot_file import load_robot
from fastcal.report.diagnosis_words import short_name
from fastcal.report.formatting import significant
from fastcal.report.language import _
from fastcal.report.tables import capitalised
from fastcal.robot.dropped_effects import name_of
from fastcal.robot.robot_spec import Spec
from fastcal.said import said
from fastcal.studio import pictures
from fastcal.studio.files import address
from fastcal.studio.project import ROBOT, TEST
from fastcal.studio.screens.plan import POSES
from fastcal.studio.shell import card, command_line, job_bar, onward, refuse, told
from fastcal.studio.state import Studio

CALIBRATION, DIAGNOSIS = "calibration", "diagnosis"
_TABS = {CALIBRATION: said("Calibration"), DIAGNOSIS: said("Diagnosis")}
SCREEN, REFIT = "result", "refit"
_ALL = said("with all")


def build(studio: Studio) -> None:
    """Builds the screen."""
    project = studio.project
    data = project.data_files()
    if not project.has_robot or not data:
        ui.label(_("Nothing is measured yet: save the list on the screen Data, or measure with the robot."))
        with ui.row():
            ui.link(_("To the screen Data"), "/")
            ui.link(_("To the screen Live"), "/live")
        return

    hint = _("Calibrate fits the geometry and the effects that are named; Diagnose finds out which there are.")
    with card(_("Run"), hint):
        with ui.row().classes("items-end gap-4"):
            source = ui.select(data, value=data[0], label=_("Measurements")).classes("w-56")
            tests = {"": _("none"), **{name: name for name in data}}
            test = ui.select(tests, value=TEST if TEST in data and data[0] != TEST else "", label=_("Test poses"))
            test.classes("w-40").props('data-test="test"')
            effects = ui.input(_("Effects"), value=project.answers.get("effects", "geometry")).classes("w-72")
            ui.button(_("Calibrate"), on_click=lambda: run_it("calibrate", CALIBRATION)).props('data-test="calibrate"')
            ui.button(_("Diagnose: what is missing?"), on_click=lambda: run_it("diagnose", DIAGNOSIS)).props(
                'outline data-test="diagnose"'
            )
        line = ui.column().classes("w-full")

        def run_it(task: str, out: str) -> None:
            titles = {"calibrate": said("calibrating"), "diagnose": said("diagnosing")}
            options = {"effects": effects.value} if task == "calibrate" else {}
            words = [task, ROBOT, source.value, "-o", out]
            words += ["--effects", effects.value] if options and effects.value != "geometry" else []
            if test.value == source.value:
                refuse(_("the test poses are those of the fit: choose others, or none"))
                return
            if test.value:
                options["test"] = test.value
                words += ["--test", test.value]
            with told():
                project.answer("effects", effects.value)
                studio.start(SCREEN, titles[task], task, robot=ROBOT, data=source.value, out=out, **options)
                line.clear()
                with line:
                    command_line(project.remember(words))

        job_bar(studio, SCREEN, lambda result: pages.refresh())

    @ui.refreshable
    def pages() -> None:
        there = [out for out in (DIAGNOSIS, CALIBRATION) if project.path(f"{out}/report.html").exists()]
        there.sort(key=lambda out: project.path(f"{out}/report.html").stat().st_mtime, reverse=True)
        if not there:
            return
        onward(_("Next: compensate a robot program on the screen Program"), "/program")
        with ui.tabs().props("align=left") as tabs:
            for out in there:
                ui.tab(out, label=_(_TABS[out]))
        with ui.tab_panels(tabs, value=there[0]).classes("w-full"):
            for out in there:
                with ui.tab_panel(out).classes("p-0"):
                    _switches(studio, out, source)
                    if out == DIAGNOSIS:
                        _apart(studio)
                    changed = int(project.path(f"{out}/report.html").stat().st_mtime)
                    page = f"{address(out)}/report.html?at={changed}"
                    ui.element("iframe").props(f'src="{page}" title="{_(_TABS[out])}" data-test="page-{out}"').classes(
                        "w-full border rounded bg-white"
                    ).style("height: 85vh")
                    ui.link(_("open it by itself"), page, new_tab=True)

    pages()


def _apart(studio: Studio) -> None:
    """Leads to the poses that tell apart what these data cannot, where the diagnosis names some."""
    project = studio.project
    poses = project.path(f"{DIAGNOSIS}/next_poses.csv")
    if not poses.exists():
        return

    def plan() -> None:
        with told():
            place = project.path(POSES)
            place.parent.mkdir(exist_ok=True)
            write_bytes(place, poses.read_bytes())
            ui.navigate.to("/plan")

    with card(
        _("What tells them apart"), _("The data fit several causes; measuring these poses next tells them apart.")
    ):
        count = len(load_measurements(poses, project.robot(), require_measured=False))
        ui.button(_("Take the {count} poses to Plan", count=count), on_click=plan, icon="route").props(
            'data-test="tell-apart"'
        )


def _switches(studio: Studio, out: str, source: Any) -> None:
    """The effects of a model as switches; the rest is fitted again as one is turned."""
    model = f"{out}/model.yaml"
    names = {
        name_of(entry): _switched(entry)
        for entry in load_robot(studio.project.path(model)).entries
        if traits_of(entry["effect"]).role != "nuisance"  # what the loads may be wrong by is no cause of its own
    }
    if not names:
        return
    gaps = _known(studio, out)
    folded = ui.expansion(_("What does each effect do?"), icon="toggle_on").classes("w-full border rounded mb-2")
    with folded.props('data-test="without" header-class="font-medium"'):
        ui.label(_("Turn an effect off; the others are fitted again in the background."))
        with ui.row().classes("items-center gap-x-6 gap-y-0"):
            switches = {
                name: ui.switch(text, value=True).props(f'data-test="switch-{name}"') for name, text in names.items()
            }

        def refit() -> None:
            off = [name for name in names if not switches[name].value]
            data, robot = source.value, ROBOT
            studio.start(f"{REFIT}-{out}", said("fitting"), "without", robot=robot, data=data, model=model, off=off)

        chart = ui.plotly(_bars(gaps)).classes("w-full").props('data-test="gap"')
        left = ui.label().props('data-test="gap-said"')

        def show(result: dict[str, Any]) -> None:
            off = [name for name in names if not switches[name].value]
            name = _("without {effects}", effects=", ".join(names[each] for each in off)) if off else _(_ALL)
            gaps[name] = result["after_mm"]
            chart.update_figure(_bars(gaps))
            left.text = f"{name}: {significant(result['after_mm'], 4)} mm"

        job_bar(studio, f"{REFIT}-{out}", show)
        for switch in switches.values():
            switch.on_value_change(refit)


def _switched(entry: Spec) -> str:
    """An effect in words, with what tells it from another of its kind and place."""
    options = ", ".join(
        f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in identity_options(entry).items()
    )
    return capitalised(short_name(entry["effect"], entry["owner"], options))


def _known(studio: Studio, out: str) -> dict[str, float]:
    """The RMS error on the rows of the fit that the result itself states [mm]."""
    folder = studio.project.path(out)
    if (folder / "diagnosis.json").exists():
        gap = read_json(folder / "diagnosis.json")["gap"]
        return {_("geometry alone"): gap[0]["train_rms_mm"], _(_ALL): gap[-1]["train_rms_mm"]}
    after = read_json(folder / "result.json")["train"].get("after_mm")
    return {} if after is None else {_(_ALL): after["rms"]}


def _bars(gaps: dict[str, float]) -> pictures.Figure:
    colours = [pictures.GREEN if name == _(_ALL) else pictures.RED for name in gaps]
    return pictures.bars(list(gaps), list(gaps.values()), colours, _("RMS error, mm"))
