# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Three joints and few rows: the real fits and score tests, in hundredths of a second."""

from functools import cache
from typing import Any

import numpy as np

from fastcal import Robot, load_robot, perturbed, simulate
from fastcal.diagnosis.library import build_library
from fastcal.diagnosis.problem import Noise, Problem, prepared_problem
from fastcal.measurements.dataset import Dataset

SIGMA = 5e-5  # [m]
ROWS = 60


def _joint(d: float, a: float, alpha: float, mass: float) -> dict[str, Any]:
    link = {"mass_kg": mass, "com_mm": [-a / 2, 0.0, 0.0]}
    return {
        "type": "revolute",
        "theta_deg": 0.0,
        "d_mm": d,
        "a_mm": a,
        "alpha_deg": alpha,
        "beta_deg": 0.0,
        "min_deg": -170.0,
        "max_deg": 170.0,
        "link": link,
    }


@cache
def arm() -> Robot:
    """A shoulder, an elbow and a target off the last axis."""
    joints = [_joint(300.0, 50.0, 90.0, 20.0), _joint(0.0, 500.0, 0.0, 15.0), _joint(0.0, 400.0, 0.0, 8.0)]
    tool = {"xyz_mm": [30.0, 40.0, 60.0], "rpy_deg": [0.0, 0.0, 0.0]}
    return Robot(dict(load_robot("pmc6va030").spec) | {"kinematics": "dh", "joints": joints, "tool": tool})


def measured(
    effects: list[dict[str, Any]],
    seed: int = 1,
    rows: int = ROWS,
    length: float = 5e-4,
    angle: float = 5e-4,
    robot: Robot | None = None,
    time: np.ndarray[Any, Any] | None = None,
    noise: float = SIGMA,
) -> Dataset:
    """Rows of an arm as a workshop builds it, errors of `length` [m] and `angle` [rad] in its sizes, with effects."""
    random = np.random.default_rng(seed)
    true = perturbed(robot or arm(), seed=seed, length=length, angle=angle)
    q, payload = random.uniform(-2.5, 2.5, (rows, 3)), random.choice([0.0, 5.0, 10.0], rows)
    poses = Dataset.from_arrays(q, payload=payload, time=time)
    return simulate(Robot(dict(true.spec) | {"effects": effects}), poses, noise=noise, seed=seed)


def problem(data: Dataset, sigma: float = SIGMA) -> Problem:
    """All names, this noise."""
    return prepared_problem(arm(), data, build_library(arm(), data).names, Noise((sigma, 1e-4, sigma)), 1)
