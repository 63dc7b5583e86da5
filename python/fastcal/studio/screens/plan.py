# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Plan: which poses to measure, drawn where they are; what cannot be driven in red; the error that they would leave."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from fastcal.design.surroundings import REASONS, Surroundings
from fastcal.io.measurements import load_measurements
from fastcal.studio import pictures
from fastcal.studio.files import address
from fastcal.studio.project import ROBOT
from fastcal.studio.shell import card, command_line, job_bar, told
from fastcal.studio.state import Studio
from fastcal.units import to_si

POSES = "plan/poses.csv"
_SURROUNDINGS = "plan/surroundings.yaml"


def build(studio: Studio) -> None:
    """Builds the screen."""
    project = studio.project
    if not project.has_robot:
        ui.label("Choose the arm first.")
        ui.link("To the screen Data", "/")
        return
    boxes: list[list[list[float]]] = list(project.answers.get("keep_out_mm") or [])

    with card("What for"), ui.row().classes("items-end gap-4"):
        count = ui.number("Poses", value=40, min=8, max=500, precision=0).classes("w-28")
        effects = ui.input("Effects to identify", value=project.answers.get("effects", "geometry")).classes("w-72")
        payloads = ui.input("Payloads at hand, kg", value="0").classes("w-40")

        def plan() -> None:
            with told():
                masses = [float(mass) for mass in str(payloads.value).replace(";", ",").split(",")]
                _write_surroundings(studio, boxes)
                studio.start("plan", "planning", "design", robot=ROBOT, count=int(count.value), out=POSES,
                             effects=effects.value, payloads=masses, keep_out=boxes,
                             sigma_mm=float(project.answers.get("sigma_mm", 0.05)))  # fmt: skip
                words = ["design", ROBOT, "--count", str(int(count.value)), "--effects", effects.value]
                words += ["--candidates", "grid", "--candidate-count", "20000", "--payload-kg", str(payloads.value)]
                words += ["--surroundings", _SURROUNDINGS, "-o", POSES]
                line.clear()
                with line:
                    command_line(project.remember(words))

        ui.button("Plan", on_click=plan).props('data-test="plan"')
    with card(
        "Keep out", "Boxes in mm in the measuring frame; the floor and the arm's own column are kept clear anyway."
    ):
        listed = ui.column()
        with ui.row().classes("items-end gap-2"):
            fields = [
                ui.number(f"{side} {axis}", value=0.0).classes("w-24") for side in ("from", "to") for axis in "xyz"
            ]

            def add() -> None:
                values = [float(field.value or 0) for field in fields]
                boxes.append([values[:3], values[3:]])
                changed()

            ui.button("Add", on_click=add, icon="add").props('outline data-test="add-box"')
    line, work = ui.column().classes("w-full"), ui.column().classes("w-full")
    out = ui.column().classes("w-full")
    curve: list[Any] = []

    def remove(k: int) -> None:
        boxes.pop(k)
        changed()

    def changed() -> None:
        project.answer("keep_out_mm", boxes)
        listed.clear()
        with listed:
            for k, (low, high) in enumerate(boxes):
                with ui.row().classes("items-center"):
                    ui.label(f"{low} to {high} mm").classes("font-mono")
                    ui.button(icon="close", on_click=lambda k=k: remove(k)).props(
                        f'flat dense round aria-label="Remove box {k + 1}"'
                    )
        out.clear()
        with out, told():
            _poses(studio, boxes, curve)

    def done(result: dict[str, Any]) -> None:
        curve[:] = result["curve"]
        changed()
        for note in result["notes"]:
            ui.notify(note)

    with work:
        job_bar(studio, "plan", done)
    changed()


def _poses(studio: Studio, boxes: list[Any], curve: list[Any]) -> None:
    """The planned poses in space, those that cannot be driven in red, and the files to take along."""
    project = studio.project
    if not project.path(POSES).exists():
        return
    robot = project.robot()
    data = load_measurements(project.path(POSES), robot, require_measured=False)
    keep_out: Any = [tuple(np.asarray(to_si(np.array(corner, float), "mm")) for corner in box) for box in boxes]
    around = Surroundings(keep_out=keep_out)
    why = around.obstacles(robot, data.q)
    red = int(np.sum(why > 0))
    points = pictures.millimetres(robot.forward(data.q)[:, :3, 3])
    colours = [pictures.RED if reason else pictures.BLUE for reason in why]
    texts = [f"pose {k + 1}" + (f": would {REASONS[int(r)]}" if r else "") for k, r in enumerate(why)]
    with ui.row().classes("w-full gap-3 no-wrap max-md:flex-wrap"):
        with card(f"{len(data)} poses"):
            said = f"{red} cannot be driven as the boxes are now: plan again" if red else "all can be driven"
            ui.label(said).classes("text-negative" if red else "text-positive").props('data-test="drivable"')
            slider = ui.slider(min=1, max=len(data), value=1, step=1).props('label aria-label="Pose"')
            traces = [pictures.cloud(points, colours, texts, 5), *(pictures.box(*box) for box in boxes)]
            picture = ui.plotly(pictures.scene([*traces, *pictures.arm(robot, data.q[0])])).classes("w-full")

            def look() -> None:
                k = int(slider.value) - 1
                colour = pictures.RED if why[k] else pictures.BLUE
                picture.update_figure(pictures.scene([*traces, *pictures.arm(robot, data.q[k], colour)]))

            slider.on_value_change(look)
        with card("What they would do"):
            if curve:
                counts, values = zip(*curve, strict=True)
                goal = project.answers.get("goal_mm")
                ui.plotly(pictures.falling(counts, values, goal, "poses")).classes("w-full").props('data-test="curve"')
            for file in sorted(project.path(POSES).parent.iterdir()):
                name = str(file.relative_to(project.folder))
                ui.link(f"{Path(name).name}", address(name)).props(f'download data-test="file-{file.suffix}"')
            ui.link("Next: measure them on the screen Live", "/live")


def _write_surroundings(studio: Studio, boxes: list[Any]) -> None:
    """The boxes as the command reads them."""
    import yaml

    from fastcal.io.atomic import write_text

    path = studio.project.path(_SURROUNDINGS)
    path.parent.mkdir(exist_ok=True)
    content = {"keep_out": [{"min_mm": low, "max_mm": high} for low, high in boxes]}
    write_text(path, yaml.safe_dump(content))
