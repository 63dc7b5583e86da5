# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Live: rows arrive, each is checked as it comes; the uncertainty falls to the goal, and the next pose is named."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import run, ui

from fastcal.live import LiveSession, has_ros
from fastcal.measurements.dataset import Dataset
from fastcal.report.formatting import fixed, plural, significant
from fastcal.report.language import _, retold
from fastcal.said import said
from fastcal.studio import pictures
from fastcal.studio.project import LIVE, MEASUREMENTS
from fastcal.studio.shell import EVERY, card, decimals, onward, table, told
from fastcal.studio.state import Studio
from fastcal.units import from_si

ROWS_PORT = 8311
_PLAN = "plan/poses.csv"
_KINDS = {
    "ok": said("ok"),
    "slip": said("slip"),
    "dropped_beam": said("dropped beam"),
    "wrong_pose": said("wrong pose"),
    "unreadable": said("unreadable"),
    "keep": said("kept by hand"),
    "leave": said("left out by hand"),
}


def build(studio: Studio) -> None:
    """Builds the screen."""
    if not studio.project.has_robot:
        ui.label(_("Choose the arm first."))
        ui.link(_("To the screen Data"), "/")
        return

    @ui.refreshable
    def screen() -> None:
        if studio.session is None:
            _set_up(studio, screen.refresh)
        else:
            _running(studio, studio.session, screen.refresh)

    screen()


def _set_up(studio: Studio, shown: Any) -> None:
    """What the session needs to know."""
    answers = studio.project.answers
    planned = studio.project.path(_PLAN).exists()
    with card(_("Begin"), _("Rows are saved as they arrive; an interrupted session resumes where it stopped.")):
        with ui.row().classes("items-end gap-4"):
            goal = ui.number(
                _("Goal: σ of a predicted point, mm"), value=answers.get("goal_mm", 0.1), min=0.001, step=0.01
            )
            sigma = ui.number(
                _("Noise of the instrument, mm"), value=answers.get("sigma_mm", 0.05), min=0.001, step=0.01
            )
            port = ui.number(
                _("TCP port for rows"), value=answers.get("rows_port", ROWS_PORT), min=0, max=65535, precision=0
            )
            for field in (goal, sigma, port):
                field.classes("w-56")
        use_plan = ui.switch(_("Choose the next pose from the plan (plan/poses.csv)"), value=planned)
        use_plan.visible = planned

        async def begin() -> None:
            with told():
                plan = _plan(studio) if use_plan.visible and use_plan.value else None
                studio.project.answer("goal_mm", goal.value)
                studio.project.answer("sigma_mm", sigma.value)
                studio.project.answer("rows_port", int(port.value))
                await run.io_bound(studio.measure, int(port.value), goal.value, float(sigma.value), plan)
            shown()

        ui.button(_("Begin"), on_click=begin, icon="play_arrow").props('data-test="begin"')


def _plan(studio: Studio) -> Dataset:
    from fastcal.io.measurements import load_measurements

    return load_measurements(studio.project.path(_PLAN), studio.project.robot(), require_measured=False)


def _running(studio: Studio, session: LiveSession, shown: Any) -> None:
    assert studio.rows_server is not None  # noqa: S101 - begun together
    with card(_("Where rows come from")):
        with ui.row().classes("w-full items-end gap-4"):
            ui.label(f"TCP 127.0.0.1:{studio.rows_server.port}").classes("font-mono").props('data-test="address"')
            ui.label(
                _("the header line of a measurement file, then a row a line; each is answered ok or what is wrong")
            )
        with ui.row().classes("w-full items-end gap-4"):
            folder = (
                ui.input(_("or a folder to watch for CSV files"), value="").classes("w-96").props('data-test="watch"')
            )

            def watch() -> None:
                with told():
                    studio.watch(folder.value)
                    ui.notify(_("watching") if folder.value else _("no folder is watched"))

            ui.button(_("Watch"), on_click=watch).props("outline")
            if has_ros():
                _topic(studio)

            def end() -> None:
                studio.stop_measuring()
                shown()

            ui.button(_("End the session"), on_click=end).props('outline color=negative data-test="end"')
    with ui.row().classes("w-full gap-3 no-wrap max-md:flex-wrap"):
        with card(_("Last row")):
            last = (
                ui.label(_("waiting for the first row")).classes("text-lg").props('data-test="last" aria-live=polite')
            )
        with card(_("So far")):
            sigma = ui.label().classes("studio-number").props('data-test="sigma"')
            count = ui.label().props('data-test="count"')
            then = onward(_("Next: calibrate on the screen Result"), "/result")
    with ui.row().classes("w-full gap-3 no-wrap max-md:flex-wrap"):
        with card(_("σ of a predicted point, over where the arm may work")):
            chart = ui.plotly(pictures.falling([], [], session.goal and from_si(session.goal, "mm"), _("rows kept")))
            chart.classes("w-full")
        with card(_("Measure this next")):
            next_said = ui.label().classes("font-mono").props('data-test="next"')
            picture = ui.plotly(pictures.scene([])).classes("w-full")
    with card(_("Rows"), _("Select one to keep it or leave it out regardless of the verdict here.")):
        grid = (
            table(
                {
                    "columnDefs": [
                        {"headerName": _("row"), "field": "row", "maxWidth": 80},
                        {"headerName": _("verdict"), "field": "kind", "maxWidth": 130},
                        {"headerName": _("off, mm"), "field": "off", "maxWidth": 110, ":valueFormatter": decimals(3)},
                        {
                            "headerName": _("expected below, mm"),
                            "field": "expected",
                            "maxWidth": 170,
                            ":valueFormatter": decimals(3),
                        },
                        {"headerName": _("what is wrong"), "field": "text", "flex": 1, "tooltipField": "text"},
                    ],
                    "rowData": [],
                    "rowSelection": {"mode": "singleRow"},
                    "rowClassRules": {"text-red-600 dark:text-red-300": "!data.kept"},
                },
            )
            .classes("h-72")
            .props('data-test="rows"')
        )

        async def decide(choice: str) -> None:
            chosen = await grid.get_selected_row()
            if chosen is None:
                ui.notify(_("select a row first"))
                return
            with told():
                session.decide(int(chosen["row"]), choice)
            seen["rows"] = -1

        with ui.row():
            ui.button(_("Keep"), on_click=lambda: decide("keep")).props("outline dense")
            ui.button(_("Leave out"), on_click=lambda: decide("leave")).props("outline dense")
            ui.label(_("kept rows: {file}", file=f"{LIVE}/{MEASUREMENTS}")).classes("text-sm self-center")

    seen = {"rows": -1}

    async def look() -> None:
        if seen["rows"] == len(session.rows) or studio.session is not session:
            return
        seen["rows"] = len(session.rows)
        pose = await run.io_bound(session.next_pose)
        _fill(session, last, sigma, count)
        then.visible = session.is_enough
        goal = None if session.goal is None else float(from_si(session.goal, "mm"))
        steps = [(n, float(from_si(value, "mm"))) for n, value in session.history]
        chart.update_figure(pictures.falling([n for n, _ in steps], [v for _, v in steps], goal, _("rows kept")))
        grid.options["rowData"] = _table(session)
        grid.update()
        if pose is None:
            next_said.text = _("every pose of the plan is measured")
            return
        units = ["mm" if kind == "prismatic" else "°" for kind in session.nominal.joint_types]
        positions = enumerate(zip(pose.shown, units, strict=True), start=1)
        shown_at = "  ".join(f"J{k}\N{NO-BREAK SPACE}{fixed(float(v), 2)}{unit}" for k, (v, unit) in positions)
        which = "" if pose.planned is None else _("planned pose {number}", number=pose.planned + 1) + ": "
        next_said.text = which + shown_at
        robot = session.nominal if session.belief is None else session.belief.robot
        done = [row.data.position[0] for row in session.rows
                if row.is_kept and row.data is not None and row.data.position is not None]  # fmt: skip
        traces = pictures.arm(robot, pose.q)
        if done and session.belief is not None:
            points = pictures.millimetres(np.array(done))
            traces.append(pictures.cloud(points, pictures.GREEN, [_("row {row}", row=k) for k in session.kept], 3))
        picture.update_figure(pictures.scene(traces))

    ui.timer(EVERY, look)


def _topic(studio: Studio) -> None:
    """A ROS 2 topic that rows come from."""
    name = ui.input(_("or a ROS 2 topic of std_msgs/String"), value="").classes("w-72").props('data-test="topic"')

    def listen() -> None:
        with told():
            studio.listen(name.value)
            ui.notify(_("listening") if name.value else _("no topic is listened to"))

    ui.button(_("Listen"), on_click=listen).props("outline")


def _fill(session: LiveSession, last: Any, sigma: Any, count: Any) -> None:
    """The last row's verdict, and where the session stands."""
    if session.rows:
        row = session.rows[-1]
        good = row.judgement.kind == "ok"
        last.text = _("row {row}", row=len(session.rows) - 1) + f": {retold(row.judgement.text) or _('ok')}"
        last.classes(replace=f"text-lg {'text-positive' if good else 'text-negative font-bold'}")
    kept = len(session.kept)
    count.text = _("{rows}, {kept} kept", rows=plural(len(session.rows), "row"), kept=kept)
    if session.deviation is None:
        sigma.text = _("σ not known yet")
        return
    sigma.text = f"σ {significant(from_si(session.deviation, 'mm'))} mm"
    if session.goal is not None:
        goal = float(from_si(session.goal, "mm"))
        if session.is_enough:
            count.text += _("; goal {goal:g} mm reached: enough", goal=goal)
        else:
            more = session.rows_to_go
            count.text += (
                _("; goal {goal:g} mm", goal=goal)
                if more is None
                else _("; about {count} more to {goal:g} mm", count=more, goal=goal)
            )


def _table(session: LiveSession) -> list[dict[str, Any]]:
    def mm(value: float | None) -> float | None:
        return None if value is None else round(float(from_si(value, "mm")), 3)

    return [
        {
            "row": k,
            "kind": _(_KINDS.get(row.decision or row.judgement.kind, row.judgement.kind)),
            "off": mm(row.judgement.off),
            "expected": mm(row.judgement.expected),
            "text": retold(row.judgement.text),
            "kept": row.is_kept,
        }
        for k, row in reversed(list(enumerate(session.rows)))
    ]
