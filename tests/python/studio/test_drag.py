# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A box of the plan is dragged in space with the mouse, in a browser that draws in software."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

import fastcal
from fastcal.studio.project import Project
from fastcal.studio.space import camera_at
from fastcal.units import to_si

from ..conftest import SOFTWARE_GL
from .conftest import PATIENCE

# Where the middle of a box is in the window; the element's own component knows its camera.
ON_SCREEN = """([id, x, y, z]) => {
  const view = getElement(Number(id.slice(1)));
  const at = view.camera.position.clone().set(x, y, z).project(view.camera);
  const frame = view.renderer.domElement.getBoundingClientRect();
  return [frame.left + (at.x + 1) / 2 * frame.width, frame.top + (1 - at.y) / 2 * frame.height];
}"""

# The camera is where the screen put it and the box where the project has it, both drawn so at least once: a press of
# the mouse is looked up among what was drawn last.
DRAWN = """([id, x, y, z, eye]) => {
  const view = getElement(Number(id.slice(1)));
  const at = (object) => [12, 13, 14].map((k) => object.matrixWorld.elements[k]);
  const near = (a, b) => Math.hypot(...a.map((value, k) => value - b[k])) < 1e-3;
  if (view.draggable_objects?.length !== 1 || !near(at(view.draggable_objects[0]), [x, y, z])) return false;
  const { x: a, y: b, z: c } = view.camera.position;
  return near(at(view.camera), [a, b, c]) && near([a, b, c], eye);
}"""

# The number field is made anew after the project has kept the box: what it then shows.
HEIGHT = """(was) => {
  const text = document.querySelector('input[aria-label="z mm"]')?.value ?? "";
  return text !== "" && Number(text) !== was && Number(text);
}"""

BOX = [[500.0, -150.0, 500.0], [800.0, 150.0, 800.0]]


@pytest.fixture(scope="module")
def studio(studio_in: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    folder = tmp_path_factory.mktemp("studio") / "cell"
    project = Project(folder)
    robot = project.choose_robot("ur5e")
    (folder / "plan").mkdir()
    planned = fastcal.Dataset.from_arrays(fastcal.random_poses(robot, 12, seed=3))
    fastcal.write_measurements(folder / "plan" / "poses.csv", planned, robot.joint_types)
    project.answer("keep_out_mm", [BOX])
    running = studio_in(folder)
    yield running
    running.end()


def box(studio: Any) -> list[list[float]]:
    """The corners of the only box, as the project has them [mm]."""
    (only,) = Project(studio.folder).answers["keep_out_mm"]
    return list(only)


def middle(of: list[list[float]]) -> list[float]:
    """Of a box [m]."""
    return [float(to_si((low + high) / 2, "mm")) for low, high in zip(*of, strict=True)]


def test_a_box_is_dragged_with_the_mouse(chromium: Any, studio: Any) -> None:
    drawing = chromium.browser_type.launch(
        executable_path=shutil.which("chromium"), args=["--no-sandbox", *SOFTWARE_GL], timeout=PATIENCE
    )
    page = drawing.new_page(viewport={"width": 1300, "height": 1400})
    page.set_default_timeout(PATIENCE)
    page.goto(studio.address)
    page.goto(studio.base + "/plan")
    space = page.locator('[data-test="space"]')
    space.locator("canvas").wait_for()
    page.get_by_text("cannot be reached").or_(page.get_by_text("all can be reached")).wait_for()
    space.scroll_into_view_if_needed()
    place = [space.get_attribute("id"), *middle(BOX)]
    eye = camera_at(Project(studio.folder).robot())
    page.wait_for_function(DRAWN, arg=[*place, eye.tolist()])
    x, y = page.evaluate(ON_SCREEN, place)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y - 60, steps=4)
    page.mouse.move(x + 60, y - 90, steps=4)
    page.mouse.up()
    height = page.wait_for_function(HEIGHT, arg=650).json_value()
    drawing.close()
    low, high = box(studio)
    assert [b - a for a, b in zip(low, high, strict=True)] == [300, 300, 300]
    assert height == (low[2] + high[2]) / 2 > 700
