# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The plan in space: poses, arm and boxes, which are dragged with the mouse; drawn by three.js, in metres."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from nicegui import events, ui
from numpy.typing import NDArray

from fastcal.report.arm import skeleton, through_points
from fastcal.report.language import _
from fastcal.robot.robot import Robot
from fastcal.studio import pictures
from fastcal.units import from_si, to_si

FloatArray = NDArray[np.float64]
Box = list[list[float]]  # lower and upper corner [mm] in the measuring frame

_HEIGHT = 440  # of the view [pixels]
_BOX = "box "
FLOOR_BELOW, FLOOR_THICK, COLUMN_WIDE, COLUMN_AWAY = 0.3, 0.02, 0.2, 0.7  # of the reach, where they begin


class Space:
    """The view.

    Args:
        robot: The arm.
        points: (N, 3) where the planned poses bring the tool [m].
        dragged: Called with the number of a box and the middle that it was dragged to [mm].
    """

    def __init__(self, robot: Robot, points: FloatArray, dragged: Callable[[int, list[float]], None]) -> None:
        self._robot, self._points, self._dragged = robot, points, dragged
        self._arm: list[Any] = []
        self._boxes: list[Any] = []
        T_world_base = robot.core.base_and_tool(robot.core.nominal)[0]
        reach, base = robot.reach, T_world_base[:3, 3]
        self._scene = ui.scene(height=_HEIGHT, grid=False, on_drag_end=self._end, background_color="#e9ebee")
        self._scene.classes("w-full").props(f'role=img data-test="space" aria-label="{_("Poses, arm and boxes")}"')
        with self._scene:
            plate = self._scene.box(1.2 * reach, 1.2 * reach, 0.002 * reach).material(pictures.GREY, 0.35)
            plate.move(*base).rotate_R(T_world_base[:3, :3].tolist())
            self._cloud = self._scene.point_cloud(points.tolist(), [[0.0, 0.0, 0.0]] * len(points), 0.05 * reach)
        eye, at = camera_at(robot), base + reach * np.array([0.0, 0.0, 0.25])
        names = ("x", "y", "z", "look_at_x", "look_at_y", "look_at_z")
        self._scene.move_camera(**dict(zip(names, map(float, [*eye, *at]), strict=True)), duration=0)

    def show_poses(self, colours: Sequence[str]) -> None:
        """Each pose in its colour, as #rrggbb."""
        parts = [[int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)] for colour in colours]
        self._cloud.set_points(self._points.tolist(), parts)

    def show_arm(self, q: FloatArray, colour: str) -> None:
        """The skeleton at q (n,)."""
        for each in self._arm:
            each.delete()
        self._arm = []
        points, joints, through = skeleton(self._robot, q[np.newaxis])
        line = through_points(points[0], through)
        thick = 0.02 * self._robot.reach
        with self._scene:
            for start, end in itertools.pairwise(line):
                if np.isfinite([start, end]).all() and np.linalg.norm(end - start) > thick / 10:
                    a, middle, b = (to_si(each, "mm").tolist() for each in (start, (start + end) / 2, end))
                    tube = self._scene.quadratic_bezier_tube(a, middle, b, tubular_segments=1, radius=thick)
                    self._arm.append(tube.material(colour))
            for at in points[0][joints]:
                self._arm.append(self._scene.sphere(1.6 * thick).material("#ffffff").move(*to_si(at, "mm").tolist()))

    def show_boxes(self, boxes: Sequence[Box]) -> None:
        """The keep-out boxes, each of which can be dragged."""
        for each in self._boxes:
            each.delete()
        self._boxes = []
        with self._scene:
            for k, (low, high) in enumerate(boxes):
                wide, deep, tall = (float(to_si(max(abs(b - a), 1.0), "mm")) for a, b in zip(low, high, strict=True))
                middle = [float(to_si((a + b) / 2, "mm")) for a, b in zip(low, high, strict=True)]
                box = self._scene.box(wide, deep, tall).material(pictures.RED, 0.35).move(*middle)
                self._boxes.append(box.with_name(f"{_BOX}{k}").draggable())

    def _end(self, event: events.SceneDragEventArguments) -> None:
        if event.object_name.startswith(_BOX):
            middle = [round(float(from_si(value, "mm"))) for value in (event.x, event.y, event.z)]
            self._dragged(int(event.object_name[len(_BOX) :]), [float(value) for value in middle])


def camera_at(robot: Robot) -> FloatArray:
    """(3,) where the view is seen from at first [m]."""
    base = robot.core.base_and_tool(robot.core.nominal)[0][:3, 3]
    return np.asarray(base + robot.reach * np.array([0.85, -0.85, 0.85]))


def floor(robot: Robot) -> Box:
    """A floor below the arm's base, to be dragged to where it is [mm]."""
    base, reach = _base_and_reach(robot)
    top = base[2] - FLOOR_BELOW * reach
    low, high = base - 1.2 * reach, base + 1.2 * reach
    return _rounded([low[0], low[1], top - FLOOR_THICK * reach], [high[0], high[1], top])


def column(robot: Robot) -> Box:
    """A column beside the arm, to be dragged to where it is [mm]."""
    base, reach = _base_and_reach(robot)
    half = COLUMN_WIDE * reach / 2
    x, y = base[0] + COLUMN_AWAY * reach, base[1]
    bottom = base[2] - FLOOR_BELOW * reach
    return _rounded([x - half, y - half, bottom], [x + half, y + half, base[2] + reach])


def _base_and_reach(robot: Robot) -> tuple[FloatArray, float]:
    T_world_base = robot.core.base_and_tool(robot.core.nominal)[0]
    return pictures.millimetres(T_world_base[:3, 3]), float(from_si(robot.reach, "mm"))


def _rounded(low: Sequence[float], high: Sequence[float]) -> Box:
    return [[float(round(value)) for value in corner] for corner in (low, high)]
