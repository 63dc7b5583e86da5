# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A pedestal or floor that yields to the arm's own weight is no joint's: half of what it does is a wave of joint 2."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import diagnose
from fastcal.diagnosis.blocks import Blocks, blocks
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.library import build_library
from fastcal.diagnosis.partial_residuals import of_unexplained
from fastcal.diagnosis.problem import Noise, Problem, prepared_problem
from fastcal.diagnosis.search import Search
from fastcal.measurements.dataset import Dataset

from .plain_cobot import in_full

SIGMA = 4e-5  # [m]
ROWS = 130
FloatArray = NDArray[np.float64]

FLOOR = {"xyz_mm": [2500.0, 400.0, -700.0], "rpy_deg": [0.0, 0.0, 65.0]}
WALL = {"xyz_mm": [2500.0, 400.0, -700.0], "rpy_deg": [90.0, 0.0, 65.0]}


def arm(name: str, base: dict[str, list[float]], gravity: list[float] | None = None) -> Robot:
    """Weighed by nobody; gravity [m/s^2] of the measuring frame, along -z where it is not said."""
    spec = dict(load_robot(name).spec)
    spec["joints"] = [{key: value for key, value in joint.items() if key != "link"} for joint in spec["joints"]]
    down = [0.0, 0.0, -9.81] if gravity is None else gravity
    return Robot(spec | {"base": base, "gravity_m_s2": down, "gravity_frame": "measuring"})


def moment(robot: Robot, q: FloatArray, *, upper: float, fore: float) -> FloatArray:
    """(N, 3) moment [N m] on the base of an upper arm and a forearm of these masses [kg], in the measuring frame."""
    origins = robot.core.frame_origins(q)
    base, shoulder, elbow, wrist = (origins[:, k] for k in (0, 3, 5, 9))
    down = np.asarray(robot.spec["gravity_m_s2"])
    return np.cross(upper * ((shoulder + elbow) / 2 - base) + fore * ((elbow + wrist) / 2 - base), down)


def leaning(robot: Robot, axis: list[float], angle: float, *, seed: int = 3, rows: int = ROWS) -> Dataset:
    """Rows of an arm on a pedestal that yields about one axis of the measuring frame, by up to `angle` [rad]."""
    q = random_poses(robot, rows, seed=seed)
    true = perturbed(robot, seed=seed)
    seen = simulate(true, Dataset.from_arrays(q, robot=robot), noise=SIGMA, seed=seed)
    lean = np.outer(moment(true, q, upper=20.0, fore=15.0) @ axis, axis)
    lean *= angle / np.linalg.norm(lean, axis=1).max()
    origin = np.asarray(robot.spec["base"]["xyz_mm"]) / 1e3
    assert seen.position is not None
    return replace(seen, position=seen.position + np.cross(lean, seen.position - origin))


@pytest.mark.parametrize("seed", [1, *in_full(2)])
@pytest.mark.parametrize(("name", "angle"), [("kuka_kr6_r900", 1.2e-4), ("ur10e", 1e-4)])
def test_a_pedestal_that_yields_about_one_axis_is_no_gear_and_no_sag(name: str, angle: float, seed: int) -> None:
    """It was named as an eccentric gear of joint 1, or as the sag of joint 2."""
    robot = arm(name, FLOOR)
    found = diagnose(robot, leaning(robot, [1.0, 0.0, 0.0], angle, seed=seed), sigma=SIGMA)
    assert found.verdict == "unexplained"
    assert all(f.grade not in "AB" for f in found.effects)
    assert found.unexplained is not None
    assert (found.unexplained.owner, found.unexplained.depends_on) == ("base", ("reach",))
    assert "at the base or the instrument that depends on where the arm reaches" in found.sentence


def test_a_surrogate_at_the_base_closes_the_gap_on_other_poses(tmp_path: Path) -> None:
    robot = arm("kuka_kr6_r900", FLOOR)
    rows = leaning(robot, [1.0, 0.0, 0.0], 4e-4, seed=6, rows=330)
    found = diagnose(robot, rows.select(slice(0, ROWS)), test=rows.select(slice(ROWS, None)), sigma=SIGMA)
    assert found.unexplained is not None
    assert (found.unexplained.owner, found.unexplained.added) == ("base", "surrogate@base")
    first, last = found.gap[0].test_rms_mm, found.gap[-1].test_rms_mm
    noise = np.sqrt(3) * 1e3 * SIGMA
    assert first is not None
    assert last is not None
    assert last**2 - noise**2 < 0.25 * (first**2 - noise**2)
    found.save(tmp_path)
    assert "Something remains" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_lean_by_the_first_joints_is_drawn() -> None:
    """The page draws the motion of the base over q1 and q2, by the two turns that the block has."""
    robot = arm("kuka_kr6_r900", FLOOR)
    start = Search(problem_of(robot, leaning(robot, [1.0, 0.0, 0.0], 4e-4))).start
    seen = of_unexplained(start, "base", ("q1", "q2"))
    assert seen is not None
    assert seen.x.shape == (ROWS, 2)
    off = np.linalg.norm(seen.reading.fitted, axis=1)
    assert 1e-5 < np.sqrt(np.mean(off**2)) < 4e-4
    assert of_unexplained(start, "base", ("reach",)) is None


def test_a_bearing_that_tilts_keeps_its_name() -> None:
    """The one lean that the library has: round, and as strong as the loads are."""
    robot = load_robot("pmc6va030")
    tilt = {"effect": "bearing_tilt", "owner": "joint1", "parameters": {"rad_nm": 4e-7}}
    true = Robot(dict(perturbed(robot, seed=4).spec) | {"effects": [tilt]})
    payload = np.random.default_rng(4).choice([0.0, 15.0, 30.0], ROWS)
    rows = Dataset.from_arrays(random_poses(robot, ROWS, seed=4), robot=robot, payload=payload)
    found = diagnose(robot, simulate(true, rows, noise=SIGMA, seed=4), sigma=SIGMA)
    assert [f.label for f in found.effects] == ["bearing_tilt@joint1"]
    assert found.unexplained is None


@pytest.mark.parametrize(("base", "axis"), [(FLOOR, [0.6, 0.8, 0.0]), (WALL, [0.6, -0.8, 0.0])])
def test_the_block_holds_a_lean_about_any_level_axis(base: dict[str, list[float]], axis: list[float]) -> None:
    robot = arm("kuka_kr6_r900", base)
    start = started(robot, leaning(robot, axis, 1e-2))
    at = [i for i in range(len(start.sizes)) if str(start.label(i)) == "base by reach"]
    scores = start.tests.scores
    assert len(at) == 1
    assert scores.statistic[at[0]] > 0.97 * start.tests.remaining


def test_without_gravity_nothing_leans() -> None:
    robot = arm("kuka_kr6_r900", FLOOR, gravity=[0.0, 0.0, 0.0])
    seen = simulate(robot, Dataset.from_arrays(random_poses(robot, ROWS, seed=1), robot=robot), noise=SIGMA, seed=1)
    labels = [str(block) for block in started(robot, seen).generics]
    assert not {"base by reach", "base by q1, q2"} & set(labels)


def started(robot: Robot, data: Dataset) -> Blocks:
    """What could be added to the geometry alone."""
    return blocks(fit(problem_of(robot, data), []))


def problem_of(robot: Robot, data: Dataset) -> Problem:
    """All names, the noise known."""
    return prepared_problem(robot, data, build_library(robot, data).names, Noise((SIGMA, 1e-4, SIGMA)), 1)


def test_a_column_called_reach_is_another_thing() -> None:
    robot = arm("kuka_kr6_r900", FLOOR)
    rows = leaning(robot, [1.0, 0.0, 0.0], 4e-4)
    named = replace(rows, extra={"reach": np.arange(float(ROWS))})
    at = {str(block): block.curves.count for block in started(robot, named).generics if block.owner == "base"}
    assert at["base by reach"] == 4
