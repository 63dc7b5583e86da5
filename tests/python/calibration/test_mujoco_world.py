# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots with closed loops that MuJoCo measures: fastcal's points are MuJoCo's, and a calibration finds its robot."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal import calibrate, load_robot, perturbed, random_poses
from fastcal.measurements.dataset import Dataset

pytest.importorskip("mujoco", reason="MuJoCo is not installed")
WORLD: Any = runpy.run_path(str(Path(__file__).parents[3] / "bench" / "python" / "mujoco_world.py"))["MujocoWorld"]
NOISE = 5e-5
ROBOTS = ["delta", "delta_printer", "five_bar"]


@pytest.mark.parametrize("name", ROBOTS)
def test_points_are_those_of_mujoco(name: str) -> None:
    real = perturbed(load_robot(name), seed=3)
    q = random_poses(real, 20, seed=1)
    assert WORLD(real.spec).points(q) == pytest.approx(real.forward(q)[:, :3, 3], abs=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_that_mujoco_measures_is_found(name: str) -> None:
    nominal = load_robot(name)
    real = perturbed(nominal, seed=5)
    world, q, other = WORLD(real.spec), random_poses(real, 60, seed=6), random_poses(real, 30, seed=7)
    noise = NOISE * np.random.default_rng(8).standard_normal((len(q), 3))
    found = calibrate(nominal, Dataset.from_arrays(q, position=world.points(q) + noise, robot=nominal))
    assert found.status == "converged"
    assert np.abs(nominal.forward(other)[:, :3, 3] - world.points(other)).max() > 20 * NOISE
    off = found.model.forward(found.model.assemble(other).q)[:, :3, 3] - world.points(other)
    assert np.sqrt((off**2).mean()) < 1.5 * NOISE
