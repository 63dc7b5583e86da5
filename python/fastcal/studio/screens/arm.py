# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Arm: the skeleton with a slider a joint, beside the numbers that the pendant shows; what stands where."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from nicegui import ui

from fastcal.design.candidates import joint_ranges
from fastcal.errors import FastcalError
from fastcal.io.robot_file import load_robot
from fastcal.measurements.rotations import quaternions
from fastcal.place import joint_position
from fastcal.report.formatting import fixed
from fastcal.report.language import _
from fastcal.robot.pendant import relations
from fastcal.robot.robot import Robot
from fastcal.robots import available
from fastcal.studio import pictures
from fastcal.studio.project import ROBOT
from fastcal.studio.screens.places import build_places
from fastcal.studio.shell import card, told
from fastcal.studio.state import Studio
from fastcal.units import from_si, to_si


def build(studio: Studio) -> None:
    """Builds the screen."""
    project = studio.project
    own = [*([ROBOT] if project.has_robot else []), *project.models()]

    @ui.refreshable
    def shown(source: str) -> None:
        with told():
            robot = load_robot(project.path(source) if source in own else source)
            moved = _robot(robot)
            if source == ROBOT:
                build_places(project, robot, moved)

    hint = _("The project's own arm and models, or any that is shipped. A URDF is opened on the screen Data.")
    with card(_("Which"), hint):
        names = [*own, *available()]
        ui.select(names, value=names[0], on_change=lambda e: shown.refresh(e.value), with_input=True).props(
            f'data-test="which" aria-label="{_("Arm")}"'
        ).classes("w-72")
    shown(names[0])


def _robot(robot: Robot) -> Callable[[Robot], None]:
    """Sliders and skeleton; what is returned shows the same arm on another place, with other things on it."""
    units = ["mm" if kind == "prismatic" else "deg" for kind in robot.joint_types]
    signs = {"mm": "mm", "deg": "°"}
    try:
        ranges = joint_ranges(robot)
    except FastcalError:  # a rail without limits
        ranges = np.where(np.isfinite(robot.limits), robot.limits, [-1.0, 1.0])
    # Zero, or the middle where the limits leave zero out.
    q = np.where((ranges[:, 0] <= 0) & (ranges[:, 1] >= 0), 0.0, ranges.mean(axis=1))
    cube = pictures.reach_of(robot)
    numbers = []
    with ui.row().classes("w-full gap-3 no-wrap max-md:flex-wrap"):
        with card(
            robot.name,
            _(
                "{count} joints; stretched out at most {reach:.0f} mm long",
                count=robot.joint_count,
                reach=float(from_si(robot.reach, "mm")),
            ),
        ):
            for k, unit in enumerate(units):
                low, high = (float(from_si(value, unit)) for value in ranges[k])
                with ui.row().classes("w-full items-center no-wrap"):
                    ui.label(joint_position(k)).classes("w-8")
                    slider = ui.slider(min=low, max=high, step=(high - low) / 720, value=float(from_si(q[k], unit)))
                    slider.props(f'aria-label="{_("Joint {number}", number=k + 1)}" data-test="slider-{k + 1}"')
                    numbers.append(ui.label().classes("w-48 font-mono text-right whitespace-nowrap"))
                    slider.on_value_change(lambda e, k=k, unit=unit: turn(k, to_si(float(e.value), unit)))
            for text in relations(robot.description):
                ui.label(text).classes("text-sm")
            place = ui.label().classes("font-mono text-sm").props('data-test="tool"')
        with card(_("Skeleton"), _("Turn it with the mouse; the diamond is the tool.")):
            picture = (
                ui.plotly(pictures.scene(pictures.standing(robot, q), cube))
                .classes("w-full")
                .props('data-test="skeleton"')
            )

    def turn(joint: int, value: float) -> None:
        q[joint] = value
        show()

    def moved(other: Robot) -> None:
        nonlocal robot, cube
        robot, cube = other, pictures.reach_of(other)
        show()

    def show() -> None:
        say()
        picture.update_figure(pictures.scene(pictures.standing(robot, robot.follow(q[np.newaxis])[0]), cube))

    def say() -> None:
        there = robot.pendant.shown(q)
        for k, unit in enumerate(units):
            chain, axis = float(from_si(q[k], unit)), None if robot.pendant.is_chain else robot.pendant.axis(k)
            numbers[k].text = f"{fixed(chain, 2)}{signs[unit]}"
            if axis is not None:
                numbers[k].text += f"  J{axis + 1} {fixed(float(from_si(there[axis], unit)), 2)}{signs[unit]}"
        pose = robot.forward(q[np.newaxis])[0]
        x, y, z = (round(float(from_si(value, "mm")), 2) + 0.0 for value in pose[:3, 3])  # no -0.00
        turned = " ".join(fixed(float(value), 4) for value in quaternions(pose[np.newaxis, :3, :3])[0])
        place.text = _("tool: x {x:.2f}  y {y:.2f}  z {z:.2f} mm, quaternion {turned}", x=x, y=y, z=z, turned=turned)

    say()
    return moved
