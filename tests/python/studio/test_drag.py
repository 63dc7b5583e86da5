# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A box of the plan is dragged in space with the mouse, in a browser that draws in software."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from typing import Any

import pytest

import fastcal
from fastcal.studio.project import Project
from fastcal.studio.space import column, floor

from ..conftest import SOFTWARE_GL
from .conftest import PATIENCE

# Where the middle of a box is in the window; the element's own component knows its camera.
ON_SCREEN = """([id, x, y, z]) => {
  const view = getElement(Number(id.slice(1)));
  const at = view.camera.position.clone().set(x, y, z).project(view.camera);
  const frame = view.renderer.domElement.getBoundingClientRect();
  return [frame.left + (at.x + 1) / 2 * frame.width, frame.top + (1 - at.y) / 2 * frame.height];
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
    name = space.get_attribute("id")
    space.scroll_into_view_if_needed()
    page.wait_for_function("(id) => getElement(Number(id.slice(1))).draggable_objects?.length === 1", arg=name)
    x, y = page.evaluate(ON_SCREEN, [name, 0.65, 0.0, 0.65])
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 40, y - 60, steps=4)
    page.mouse.move(x + 60, y - 90, steps=4)
    page.mouse.up()
    page.get_by_text("cannot be driven").or_(page.get_by_text("all can be driven")).wait_for()
    deadline = time.monotonic() + PATIENCE / 1000
    while box(studio) == BOX and time.monotonic() < deadline:
        page.wait_for_timeout(200)
    drawing.close()
    low, high = box(studio)
    assert [b - a for a, b in zip(low, high, strict=True)] == [300, 300, 300]
    assert (low[2] + high[2]) / 2 > 700


def test_a_floor_and_a_column_begin_beside_the_arm() -> None:
    robot = fastcal.load_robot("ur5e").with_(base={"xyz_mm": [1000.0, 0.0, 500.0], "rpy_deg": [0.0, 0.0, 30.0]})
    (low, high), (left, right) = floor(robot), column(robot)
    assert low[0] < 1000 - 1000 * robot.reach < 1000 + 1000 * robot.reach < high[0]
    assert low[2] < high[2] < 500
    assert 1000 < left[0] < right[0] < 1000 + 1000 * robot.reach
    assert left[2] <= high[2] < 500 < right[2]
