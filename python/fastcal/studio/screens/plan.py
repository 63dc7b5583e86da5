# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Plan: which poses to measure, drawn where they are; what cannot be driven in red; the error that they would leave."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from fastcal.design.surroundings import REASONS, Surroundings
from fastcal.io.measurements import load_measurements
from fastcal.report.formatting import plural
from fastcal.report.language import _
from fastcal.said import said
from fastcal.studio import pictures
from fastcal.studio.files import address
from fastcal.studio.project import ROBOT
from fastcal.studio.shell import card, command_line, job_bar, told
from fastcal.studio.state import Studio
from fastcal.units import to_si

POSES = "plan/poses.csv"
_SURROUNDINGS = "plan/surroundings.yaml"
_OBSTACLES = {
    1: said("would meet a keep-out box"),
    6: said("would go below the mounting face or into the arm's own column"),
}

Box = list[list[float]]  # lower and upper corner [mm] in the measuring frame


def build(studio: Studio) -> None:
    """Builds the screen."""
    project = studio.project
    if not project.has_robot:
        ui.label(_("Choose the arm first."))
        ui.link(_("To the screen Data"), "/")
        return
    boxes: list[Box] = list(project.answers.get("keep_out_mm") or [])

    with card(_("What for")), ui.row().classes("items-end gap-4"):
        count = ui.number(_("Poses"), value=40, min=8, max=500, precision=0).classes("w-28")
        effects = ui.input(_("Effects to identify"), value=project.answers.get("effects", "geometry")).classes("w-72")
        payloads = ui.input(_("Payloads at hand, kg"), value="0").classes("w-40")

        def plan() -> None:
            with told():
                masses = [float(mass) for mass in str(payloads.value).replace(";", ",").split(",")]
                _write_surroundings(studio, boxes)
                studio.start("plan", said("planning"), "design", robot=ROBOT, count=int(count.value), out=POSES,
                             effects=effects.value, payloads=masses, keep_out=boxes,
                             sigma_mm=float(project.answers.get("sigma_mm", 0.05)))  # fmt: skip
                words = ["design", ROBOT, "--count", str(int(count.value)), "--effects", effects.value]
                words += ["--candidates", "grid", "--candidate-count", "20000", "--payload-kg", str(payloads.value)]
                words += ["--surroundings", _SURROUNDINGS, "-o", POSES]
                line.clear()
                with line:
                    command_line(project.remember(words))

        ui.button(_("Plan"), on_click=plan).props('data-test="plan"')
    with card(
        _("Keep out"), _("Boxes in mm in the measuring frame; the floor and the arm's own column are kept clear.")
    ):
        listed = ui.column().classes("w-full")
        with ui.row().classes("items-end gap-2"):
            fields = [
                ui.number(f"{side} {axis}", value=0.0).classes("w-24")
                for side in (_("from"), _("to"))
                for axis in "xyz"
            ]

            def add() -> None:
                values = [float(field.value or 0) for field in fields]
                boxes.append([values[:3], values[3:]])
                changed()

            ui.button(_("Add"), on_click=add, icon="add").props('outline data-test="add-box"')
    line, work = ui.column().classes("w-full"), ui.column().classes("w-full")
    out = ui.column().classes("w-full")
    curve: list[Any] = []
    drawn: list[Callable[[], None]] = []  # draws the poses anew where there are any

    def remove(k: int) -> None:
        boxes.pop(k)
        changed()

    def moved() -> None:
        project.answer("keep_out_mm", boxes)
        with told():
            for draw in drawn:
                draw()

    def changed() -> None:
        listed.clear()
        with listed:
            _places(boxes, pictures.reach_of(project.robot()), moved, remove)
        out.clear()
        drawn.clear()
        with out, told():
            drawn.extend(_poses(studio, boxes, curve))
        moved()

    def done(result: dict[str, Any]) -> None:
        curve[:] = result["curve"]
        changed()
        for note in result["notes"]:
            ui.notify(_(note))

    with work:
        job_bar(studio, "plan", done)
    changed()


def _places(boxes: list[Box], reach: Any, moved: Callable[[], None], remove: Callable[[int], None]) -> None:
    """A row a box: where it is, and a button that takes it away."""
    for k, box in enumerate(boxes):
        with ui.row().classes("items-center w-full gap-4"):
            _place(box, reach, _("box {number}", number=k + 1), moved)
            ui.button(icon="close", on_click=lambda k=k: remove(k)).props(
                f'flat dense round aria-label="{_("Remove box {number}", number=k + 1)}"'
            )


def _place(box: Box, reach: Any, name: str, moved: Callable[[], None]) -> None:
    """Sliders that drag a box along the axes, and numbers for its middle and size; `moved` is called after each."""
    low, high = box

    def put(k: int, middle: float, size: float) -> None:
        low[k], high[k] = middle - size / 2, middle + size / 2
        moved()

    for k, axis in enumerate("xyz"):
        low[k], high[k] = min(low[k], high[k]), max(low[k], high[k])
        middle, size = (low[k] + high[k]) / 2, high[k] - low[k]
        centre, far = float(np.mean(reach[k])), float(np.ptp(reach[k]))  # as far again as the arm reaches
        ends = min(centre - far, middle), max(centre + far, middle)
        with ui.column().classes("gap-0 w-56"):
            slider = ui.slider(min=round(ends[0]), max=round(ends[1]), value=middle, step=1)
            slider.props(f'aria-label="{_("{axis} of {name}", axis=axis, name=name)}"')
            with ui.row().classes("no-wrap gap-2"):
                at = ui.number(f"{axis} mm", value=middle).classes("w-24").bind_value(slider)
                width = ui.number(_("size"), value=size, min=0).classes("w-24")

        def follow(_event: Any, k: int = k, at: Any = at, width: Any = width) -> None:
            if at.value is not None and width.value is not None:
                put(k, float(at.value), float(width.value))

        at.on_value_change(follow)
        width.on_value_change(follow)


def _poses(studio: Studio, boxes: list[Box], curve: list[Any]) -> list[Callable[[], None]]:
    """The planned poses in space, those that cannot be driven in red, and the files; what draws them anew, if any."""
    project = studio.project
    if not project.path(POSES).exists():
        return []
    robot = project.robot()
    data = load_measurements(project.path(POSES), robot, require_measured=False)
    points = pictures.millimetres(robot.forward(data.q)[:, :3, 3])
    with ui.row().classes("w-full gap-3 no-wrap max-md:flex-wrap"):
        with card(plural(len(data), "pose")):
            driven = ui.label().props('data-test="drivable"')
            slider = ui.slider(min=1, max=len(data), value=1, step=1).props(f'label aria-label="{_("Pose")}"')
            picture = ui.plotly(pictures.scene([pictures.cloud(points, pictures.BLUE, [])])).classes("w-full")

            def draw() -> None:
                keep_out: Any = [
                    tuple(np.asarray(to_si(np.array(corner, float), "mm")) for corner in box) for box in boxes
                ]
                why = Surroundings(keep_out=keep_out).obstacles(robot, data.q)
                red = int(np.sum(why > 0))
                words = _("{count} cannot be driven as the boxes are now: plan again", count=red)
                driven.set_text(words if red else _("all can be driven"))
                driven.classes(replace="text-negative" if red else "text-positive")
                colours = [pictures.RED if reason else pictures.BLUE for reason in why]
                texts = [
                    _("pose {number}", number=k + 1) + (f": {_(_OBSTACLES.get(int(r), REASONS[int(r)]))}" if r else "")
                    for k, r in enumerate(why)
                ]
                k = int(slider.value) - 1
                traces = [pictures.cloud(points, colours, texts, 5), *(pictures.box(*box) for box in boxes)]
                picture.update_figure(pictures.scene([*traces, *pictures.arm(robot, data.q[k], colours[k])]))

            slider.on_value_change(draw)
        with card(_("What they would do")):
            if curve:
                counts, values = zip(*curve, strict=True)
                goal = project.answers.get("goal_mm")
                ui.plotly(pictures.falling(counts, values, goal, _("poses"))).classes("w-full").props(
                    'data-test="curve"'
                )
            for file in sorted(project.path(POSES).parent.iterdir()):
                name = str(file.relative_to(project.folder))
                ui.link(f"{Path(name).name}", address(name)).props(f'download data-test="file-{file.suffix}"')
            ui.link(_("Next: measure them on the screen Live"), "/live")
    return [draw]


def _write_surroundings(studio: Studio, boxes: list[Any]) -> None:
    """The boxes as the command reads them."""
    import yaml

    from fastcal.io.atomic import write_text

    path = studio.project.path(_SURROUNDINGS)
    path.parent.mkdir(exist_ok=True)
    content = {"keep_out": [{"min_mm": low, "max_mm": high} for low, high in boxes]}
    write_text(path, yaml.safe_dump(content))
