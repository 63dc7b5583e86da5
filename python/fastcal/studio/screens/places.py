# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where base, tool, cameras and boards of an arm stand, in numbers that can be changed and kept in its file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from nicegui import ui

from fastcal.report.language import _
from fastcal.report.tables import capitalised
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot import Robot
from fastcal.studio.project import ROBOT, Project
from fastcal.studio.shell import card, told

_PARTS = (("xyz_mm", "mm"), ("rpy_deg", "°"))


def build_places(project: Project, robot: Robot, moved: Callable[[Robot], None]) -> None:
    """The card of what stands where; `moved` is told of the arm as it is now, robot.yaml when it is saved."""
    spec = plain_copy(dict(robot.spec))

    def changed() -> None:
        with told():
            moved(Robot(plain_copy(spec)))

    def save() -> None:
        with told():
            Robot(plain_copy(spec)).save(project.path(ROBOT))
            kept.text = _("kept in {file}", file=ROBOT)

    hint = _("Base and tool in the measuring frame and on the flange, cameras and boards on what carries them.")
    with card(_("What stands where"), hint):
        for title, entry in _members(spec):
            with ui.row().classes("w-full items-center gap-2"):
                ui.label(capitalised(title)).classes("w-48")
                for key, unit in _PARTS:
                    for k in range(3):
                        _number(title, entry.setdefault(key, [0.0, 0.0, 0.0]), k, key, unit, changed)
        with ui.row().classes("items-center"):
            ui.button(_("Save"), icon="save", on_click=save).props('data-test="save-places"')
            kept = ui.label().classes("text-sm").props('data-test="kept-places"')


def _number(title: str, values: list[float], k: int, key: str, unit: str, changed: Callable[[], None]) -> None:
    """A field for one of three numbers, which are changed in place."""
    axis = ("r" if key == "rpy_deg" else "") + "xyz"[k]

    def take(event: Any) -> None:
        if event.value is not None:
            values[k] = float(event.value)
            changed()

    field = ui.number(f"{axis} {unit}", value=round(float(values[k]), 6), on_change=take).classes("w-24")
    field.props(f'dense debounce=300 aria-label="{title}: {axis} {unit}"')


def _members(spec: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """What stands somewhere, in words, and its entry in the file."""
    yield _("base"), spec["base"]
    yield _("tool"), spec["tool"]
    for kind, members in ((_("camera"), spec.get("cameras")), (_("board"), spec.get("boards"))):
        for name, entry in (members or {}).items():
            yield _("{kind} {name} on {frame}", kind=kind, name=name, frame=entry["on"]), entry
