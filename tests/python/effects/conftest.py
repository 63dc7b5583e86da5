# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm with masses and data with every column, for the tests of effects."""

import copy
from typing import Any

import numpy as np
import pytest

from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

Spec = dict[str, Any]


@pytest.fixture(scope="session")
def arm() -> Robot:
    """The PMC arm in front of an instrument that stands askew, with a tool off every axis."""
    spec = copy.deepcopy(load_robot("pmc6va030").spec)
    spec["base"] = {"xyz_mm": [2500.0, -300.0, 700.0], "rpy_deg": [0.5, -0.8, 35.0]}
    spec["tool"] = {"xyz_mm": [60.0, 20.0, 110.0], "rpy_deg": [0.0, 0.0, 0.0]}
    for joint in spec["joints"]:
        joint["motor_ratio"] = 101.0
    return Robot(spec)


@pytest.fixture(scope="session")
def poses(arm: Robot) -> Dataset:
    """300 postures within the limits, all conditions known, in the order of time."""
    random = np.random.default_rng(4)
    rows = 300
    time = np.sort(random.uniform(0.0, 14400.0, rows))
    return Dataset.from_arrays(
        random.uniform(*arm.limits.T, (rows, arm.joint_count)),
        payload=random.choice([0.0, 10.0], rows),
        temperature=293.15 + 12 * (1 - np.exp(-time / 5000)) + random.normal(0, 0.3, rows),
        time=time,
        station=["hall", "door", "desk", *random.choice(["hall", "door", "desk"], rows - 3)],
        mount=[1, 2, *random.integers(1, 3, rows - 2)],
        approach=random.choice([-1.0, 1.0], (rows, arm.joint_count)),
        current=random.normal(0, 3, (rows, arm.joint_count)),
        extra={"tilt": random.normal(0, 1, rows), "level": random.normal(0, 1, rows)},
    )


def with_effects(robot: Robot, *entries: Spec) -> Robot:
    """The robot with these effects alone."""
    spec = copy.deepcopy(robot.spec)
    spec["effects"] = [copy.deepcopy(entry) for entry in entries]
    return Robot(spec)


@pytest.fixture(name="with_effects", scope="session")
def with_effects_fixture() -> Any:
    return with_effects
