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
from fastcal.report.language import _, retold
from fastcal.said import said
from fastcal.studio import pictures
from fastcal.studio.files import address
from fastcal.studio.project import ROBOT
from fastcal.studio.shell import card, command_line, job_bar, onward, refuse, told
from fastcal.studio.space import Box, Space, column, floor
from fastcal.studio.state import Studio
from fastcal.units import to_si

POSES = "plan/poses.csv"
_SURROUNDINGS = "plan/surroundings.yaml"
_OBSTACLES = {
    1: said("would meet a keep-out box"),
    6: said("would go below the mounting face or into the arm's own column"),
}


def build(studio: Studio) -> None:
    """Builds the screen."""
    project = studio.project
    if not project.has_robot:
        ui.label(_("Choose the arm first."))
        ui.link(_("To the screen Data"), "/")
        return
    _Screen(studio)


class _Screen:
    """The screen: what for, the boxes, and the poses between them."""

    def __init__(self, studio: Studio) -> None:
        self.studio, self.project = studio, studio.project
        self.boxes: list[Box] = list(self.project.answers.get("keep_out_mm") or [])
        self.curve: list[Any] = []
        self.drawn: list[Callable[[], None]] = []  # draws the poses anew where there are any
        with card(_("What for")), ui.row().classes("items-end gap-4"):
            self._asked()
        hint = _("Boxes in mm in the measuring frame; the floor and the arm's own column are kept clear.")
        with card(_("Keep out"), hint):
            self.listed = ui.column().classes("w-full")
            with ui.row().classes("items-end gap-2"):
                self._new_box()
        self.line, work = ui.column().classes("w-full"), ui.column().classes("w-full")
        self.out = ui.column().classes("w-full")
        with work:
            job_bar(studio, "plan", self.done)
        self.changed()

    def _asked(self) -> None:
        """How many poses, for which effects, with which payloads; and the button."""
        answers = self.project.answers
        count = ui.number(_("Poses"), value=40, min=8, max=500, precision=0).classes("w-28")
        effects = ui.input(_("Effects to identify"), value=answers.get("effects", "geometry")).classes("w-72")
        payloads = ui.input(_("Available payloads, kg"), value="0").classes("w-40")

        def plan() -> None:
            try:
                masses = [float(mass) for mass in str(payloads.value).replace(";", ",").split(",")]
            except ValueError:
                refuse(_("expected masses in kg with commas between them, got {text}", text=str(payloads.value)))
                return
            with told():
                _write_surroundings(self.studio, self.boxes)
                self.studio.start("plan", said("planning"), "design", robot=ROBOT, count=int(count.value), out=POSES,
                                  effects=effects.value, payloads=masses, keep_out=self.boxes,
                                  sigma_mm=float(answers.get("sigma_mm", 0.05)))  # fmt: skip
                words = ["design", ROBOT, "--count", str(int(count.value)), "--effects", effects.value]
                words += ["--candidates", "grid", "--candidate-count", "20000", "--payload-kg", str(payloads.value)]
                words += ["--surroundings", _SURROUNDINGS, "-o", POSES]
                self.line.clear()
                with self.line:
                    command_line(self.project.remember(words))

        ui.button(_("Plan the poses"), on_click=plan).props('data-test="plan"')

    def _new_box(self) -> None:
        """A box by its corners, or a floor or a column to be dragged to its place."""
        sides = (_("from"), _("to"))
        fields = [ui.number(f"{side} {axis}", value=0.0).classes("w-24") for side in sides for axis in "xyz"]

        def put(box: Box) -> None:
            self.boxes.append(box)
            self.changed()

        def add() -> None:
            corners = np.array([field.value or 0.0 for field in fields], dtype=float).reshape(2, 3)
            low, high = np.sort(corners, axis=0).tolist()
            if any(a == b for a, b in zip(low, high, strict=True)):
                refuse(_("a box needs two corners that differ in x, y and z: enter them at the left"))
                return
            put([low, high])

        ui.button(_("Add"), on_click=add, icon="add").props('outline data-test="add-box"')
        for label, make in ((_("Floor"), floor), (_("Column"), column)):
            ui.button(label, on_click=lambda make=make: put(make(self.project.robot())), icon="add").props("outline")

    def remove(self, k: int) -> None:
        """Takes a box away."""
        self.boxes.pop(k)
        self.changed()

    def moved(self) -> None:
        """Keeps where the boxes are, and draws what they block."""
        self.project.answer("keep_out_mm", self.boxes)
        with told():
            for draw in self.drawn:
                draw()

    def dragged(self, k: int, middle: list[float]) -> None:
        """A box that was dragged: its middle is there [mm], its size stays."""
        low, high = self.boxes[k]
        for axis, at in enumerate(middle):
            half = (high[axis] - low[axis]) / 2
            low[axis], high[axis] = at - half, at + half
        self.list_boxes()
        self.moved()

    def list_boxes(self) -> None:
        """A row a box."""
        self.listed.clear()
        with self.listed:
            _places(self.boxes, pictures.reach_of(self.project.robot()), self.moved, self.remove)

    def changed(self) -> None:
        """Shows everything anew: there is another box, or another plan."""
        self.list_boxes()
        self.out.clear()
        self.drawn.clear()
        with self.out, told():
            self.drawn.extend(_poses(self.studio, self.boxes, self.curve, self.dragged))
        self.moved()

    def done(self, result: dict[str, Any]) -> None:
        """There is a plan."""
        self.curve[:] = result["curve"]
        self.changed()
        for note in result["notes"]:
            ui.notify(retold(note))


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


def _poses(
    studio: Studio, boxes: list[Box], curve: list[Any], dragged: Callable[[int, list[float]], None]
) -> list[Callable[[], None]]:
    """The planned poses in space, those that cannot be driven in red, and the files; what draws them anew, if any."""
    project = studio.project
    if not project.path(POSES).exists():
        return []
    robot = project.robot()
    data = load_measurements(project.path(POSES), robot, require_measured=False)
    with ui.row().classes("w-full gap-3 no-wrap max-md:flex-wrap"):
        with card(plural(len(data), "pose"), _("Drag a box with the mouse; elsewhere the mouse turns the view.")):
            driven = ui.label().props('data-test="drivable"')
            slider = ui.slider(min=1, max=len(data), value=1, step=1).props(f'label aria-label="{_("Pose")}"')
            which = ui.label().classes("text-sm")
            space = Space(robot, robot.forward(data.q)[:, :3, 3], dragged)

            def draw() -> None:
                keep_out: Any = [
                    tuple(np.asarray(to_si(np.array(corner, float), "mm")) for corner in box) for box in boxes
                ]
                why = Surroundings(keep_out=keep_out).obstacles(robot, data.q)
                red = int(np.sum(why > 0))
                words = _("{count} cannot be reached with the boxes as they are now: plan again", count=red)
                driven.set_text(words if red else _("all can be reached"))
                driven.classes(replace="text-negative" if red else "text-positive")
                colours = [pictures.RED if reason else pictures.BLUE for reason in why]
                k = int(slider.value) - 1
                reason = f": {_(_OBSTACLES.get(int(why[k]), REASONS[int(why[k])]))}" if why[k] else ""
                which.set_text(_("pose {number}", number=k + 1) + reason)
                space.show_poses(colours)
                space.show_boxes(boxes)
                space.show_arm(data.q[k], colours[k])

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
            onward(_("Next: measure them on the screen Live"), "/live")
    return [draw]


def _write_surroundings(studio: Studio, boxes: list[Any]) -> None:
    """The boxes as the command reads them."""
    import yaml

    from fastcal.io.atomic import write_text

    path = studio.project.path(_SURROUNDINGS)
    path.parent.mkdir(exist_ok=True)
    content = {"keep_out": [{"min_mm": low, "max_mm": high} for low, high in boxes]}
    write_text(path, yaml.safe_dump(content))
