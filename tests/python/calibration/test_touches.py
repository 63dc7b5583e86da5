# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A tool, a base and a part from a few touches: where they are, how surely, and what is missing, in words."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal.calibration.touches import FoundPlace, find_place, with_place
from fastcal.errors import InvalidInput, Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import inverse, rotations_by, rpy_to_rotation

FloatArray = NDArray[np.float64]

NOISE, RADIUS = 1e-4, 0.025  # [m] of a touch; of the sphere
TOOL = {"xyz_mm": [40.0, -25.0, 180.0], "rpy_deg": [0.0, 0.0, 0.0]}
BASE = {"xyz_mm": [500.0, -300.0, 100.0], "rpy_deg": [1.0, -2.0, 70.0]}
AT = np.array([-0.45, -0.15, 0.2])
DOWN = np.array([0.0, -1.5, -1.5, -1.5, 1.5, 0.0])


def arm(**changes: Any) -> Robot:
    return fastcal.load_robot("ur5").with_(tool=TOOL, **changes)


def sent() -> Robot:
    """Without a tool, as it comes."""
    return arm().with_(tool={"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]})


def touches(kind: str, count: int, seed: int, *, turned: float = 0.6, about: tuple[int, ...] = (0, 1, 2)) -> Dataset:
    """Rows in which the tool touches a point, a plane or a sphere, turned by up to `turned` rad about some axes."""
    random = np.random.default_rng(seed)
    turns = np.zeros((count, 3))
    turns[:, about] = turned * random.uniform(-1, 1, (count, len(about)))
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = rotations_by(turns) @ rpy_to_rotation([np.pi, 0.0, 0.0])
    T[:, :3, 3] = AT + NOISE * random.standard_normal((count, 3))
    if kind == "plane":
        T[:, :2, 3] += random.uniform(-0.15, 0.15, (count, 2))
    if kind == "anchor":
        out = random.standard_normal((count, 3)) * [1, 1, 0.5]
        T[:, :3, 3] += RADIUS * out / np.linalg.norm(out, axis=1, keepdims=True)
    q = fastcal.inverse_kinematics(arm(), T, seed=np.tile(DOWN, (count, 1))).q
    if kind == "anchor":
        return Dataset.from_arrays(q, anchor=["ball"] * count, distance=np.full(count, RADIUS), source="ball.csv")
    return Dataset.from_arrays(q, observed_labels={kind: ["a"] * count}, source="touches.csv")


def points(robot: Robot, frame: FloatArray, count: int, seed: int, hidden: Any = None) -> Dataset:
    """Rows whose points (N, 3) are those of the tool in `frame`, with noise."""
    random = np.random.default_rng(seed)
    q = DOWN + random.uniform(-0.6, 0.6, (count, 6))
    p = (inverse(frame) @ robot.forward(q))[:, :3, 3] + NOISE * random.standard_normal((count, 3))
    return Dataset.from_arrays(q, position=p, source="points.csv")


def off(found: FoundPlace, true: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Errors [mm] along x, y, z and their stated deviations."""
    return 1e3 * (found.T[:3, 3] - true), np.array(found.std[0], dtype=float)


@pytest.mark.parametrize(("kind", "count"), [("socket", 4), ("socket", 8), ("plane", 12), ("anchor", 12)])
def test_a_tool_is_found_and_its_deviation_covers(kind: str, count: int) -> None:
    inside = []
    for seed in range(60):
        error, std = off(find_place(sent(), touches(kind, count, seed), "tool"), np.array(TOOL["xyz_mm"]) / 1e3)
        assert np.abs(error).max() < 40  # of an answer from the right start; the tool is 185 mm long
        inside.append(np.abs(error) < 1.96 * std)
    assert 0.9 <= np.mean(inside) <= 0.99  # 180 numbers: 93 to 97 % but for 2 standard errors


def test_a_spheres_radius_is_found_with_its_deviation() -> None:
    """From one that is 1 mm off; with the tool, whose deviation counts it."""
    inside, told = [], []
    for seed in range(60):
        data = touches("anchor", 14, seed)
        data = replace(data, distance=np.full(len(data), RADIUS + 1e-3))
        found = find_place(sent(), data, "tool", find_radius=True)
        error, std = off(found, np.array(TOOL["xyz_mm"]) / 1e3)
        assert found.radius is not None
        inside.append(np.abs(error) < 1.96 * std)
        told.append(abs(found.radius[0] - RADIUS) < 1.96 * found.radius[1])
        assert found.radius[1] < 1e-3
    assert 0.9 <= np.mean(inside) <= 0.99
    assert np.mean(told) >= 0.85  # of 60 at 95 %: fewer come by in 1 of 600 cases
    socket = touches("socket", 8, 1)
    with pytest.raises(InvalidInput, match="expected touches of spheres, anchor and one distance_mm"):
        find_place(sent(), socket, "tool", find_radius=True)


def test_a_base_and_a_part_are_found_from_three_points_and_from_many() -> None:
    inside = []
    world = arm(base=BASE)
    part = arm(base={"xyz_mm": [-300.0, -600.0, 50.0], "rpy_deg": [10.0, 5.0, -120.0]}).T_world_base
    for seed in range(40):
        count = 3 + seed % 9
        found = find_place(arm(), points(world, np.eye(4), count, seed), "base")
        error, std = off(found, world.T_world_base[:3, 3])
        inside.append(np.abs(error) < 1.96 * std)
        found = find_place(world, points(world, part, count, seed), "part")
        error, std = off(found, part[:3, 3])
        inside.append(np.abs(error) < 1.96 * std)
        assert all(value is not None and value < 1.0 for value in found.std[1])
    assert 0.9 <= np.mean(inside) <= 0.99


def test_three_points_that_are_no_coordinates_make_a_frame_as_a_pendant_does() -> None:
    q = DOWN + np.random.default_rng(4).uniform(-0.5, 0.5, (3, 6))
    p = arm().forward(q)[:, :3, 3]
    nan = np.nan
    x = np.array([[0.0, 0.0, 0.0], [nan, 0.0, 0.0], [nan, nan, 0.0]])
    data = Dataset.from_arrays(q, position=x, sigma_position=np.full(3, NOISE), source="frame.csv")
    found = find_place(arm(), data, "part")
    e_x = (p[1] - p[0]) / np.linalg.norm(p[1] - p[0])
    assert np.allclose(found.T[:3, 3], p[0], atol=1e-9)
    assert np.allclose(found.T[:3, 0], e_x, atol=1e-9)
    assert found.T[:3, 1] @ (p[2] - p[0]) > 0
    assert abs(found.T[:3, 2] @ (p[2] - p[0])) < 1e-9
    assert np.allclose(found.std[0], 0.1, rtol=1e-3)
    assert found.noise["position"].value == pytest.approx(NOISE)  # as stated: there is no residual
    bare = Dataset.from_arrays(q, position=x, source="frame.csv")
    with pytest.raises(Undetermined, match="as many equations as unknowns or fewer; touch more, or give sigma_mm"):
        find_place(arm(), bare, "part")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"turned": 0.0}, "all postures have one orientation; turn the tool by 30 degrees or more about two axes"),
        ({"about": (2,)}, "the tool was turned about one axis only"),
    ],
)
def test_what_is_not_shown_is_said_in_words(given: dict[str, Any], said: str) -> None:
    with pytest.raises(Undetermined, match=f"touches.csv: the readings do not show the tool: {said}"):
        find_place(sent(), touches("socket", 8, 1, **given), "tool")


def test_too_few_touches_and_wrong_columns_are_said() -> None:
    with pytest.raises(Undetermined, match=r"touches\.csv"):
        find_place(sent(), touches("plane", 5, 1), "tool")
    with pytest.raises(InvalidInput, match="holds no points; a base is found from columns x_mm y_mm z_mm"):
        find_place(sent(), touches("socket", 8, 1), "base")
    line = Dataset.from_arrays(np.tile(DOWN, (3, 1)), position=np.zeros((3, 3)), source="line.csv")
    with pytest.raises(Undetermined, match=r"line\.csv"):
        find_place(arm(), line, "base")


def test_a_calibrated_model_keeps_all_but_the_tool() -> None:
    random = np.random.default_rng(3)
    q = random.uniform(-1.5, 1.5, (60, 6))
    data = fastcal.simulate(arm(), Dataset.from_arrays(q), noise=NOISE, seed=2)
    model = fastcal.calibrate(fastcal.load_robot("ur5"), data).model
    found = find_place(model, touches("socket", 12, 5), "tool")
    placed = with_place(model, found)
    before, after = model.record, placed.record
    assert before is not None
    assert after is not None
    deviation = {name: np.linalg.norm(row) for name, row in after.roots.items()}
    assert np.allclose([1e3 * deviation[name] for name in found.parameters], found.std[0])
    kept = [name for name in before.parameters if not name.startswith("tool ")]
    assert [name for name in after.parameters if not name.startswith("tool ")] == kept
    assert np.allclose([deviation[name] for name in kept], [np.linalg.norm(before.roots[name]) for name in kept])
    assert np.isfinite(placed.position_deviation(q)).all()


def test_points_in_another_unit_or_row_place_nothing() -> None:
    """Centimetres under mm gave a base that missed by 243 mm, written without a word."""
    world = arm(base=BASE)
    right = points(world, np.eye(4), 12, 1)
    assert right.position is not None
    assert np.abs(find_place(arm(), right, "base").T[:3, 3] - world.T_world_base[:3, 3]).max() < 1e-3
    for wrong in (right.position / 10, right.position / 25.4, np.roll(right.position, 1, axis=0)):
        for what in ("base", "part"):
            with pytest.raises(InvalidInput, match=rf"points.csv: no {what} fits: half of the points are missed"):
                find_place(arm(), replace(right, position=wrong), what)  # type: ignore[arg-type]


def test_a_diameter_for_a_radius_is_refused_and_the_radius_found_from_it() -> None:
    data = touches("anchor", 16, 3)
    assert find_place(sent(), data, "tool").radius is None
    twice = replace(data, distance=np.full(len(data), 2 * RADIUS))
    with pytest.raises(InvalidInput, match=r"distance_mm is 50, .* a sphere of radius 2\d\.\d+ mm .*--find-radius"):
        find_place(sent(), twice, "tool")
    found = find_place(sent(), twice, "tool", find_radius=True).radius
    assert found is not None
    assert abs(found[0] - RADIUS) < 4 * found[1]
