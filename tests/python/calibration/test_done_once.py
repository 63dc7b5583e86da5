# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a calibration does once: of a hundred rows, half of the time was work done twice."""

from collections.abc import Callable
from typing import Any

import pytest

import fastcal
from fastcal.calibration import problem as problem_module
from fastcal.calibration.parameter_limits import parameter_limits
from fastcal.measurements.dataset import Dataset
from fastcal.robot import robot as robot_module
from fastcal.robot.core_model import build_core
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot import Robot


def counted(function: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, module: Any) -> list[Any]:
    """What the function, a name of this module, is called with from now on."""
    calls: list[Any] = []

    def call(first: Any, *others: Any, **options: Any) -> Any:
        calls.append(first)
        return function(first, *others, **options)

    monkeypatch.setattr(module, function.__name__, call)
    return calls


@pytest.fixture(scope="module")
def robot() -> Robot:
    return fastcal.load_robot("ur5")


@pytest.fixture(scope="module")
def data(robot: Robot) -> Dataset:
    return fastcal.simulate(robot, fastcal.random_poses(robot, 30, seed=1), noise=5e-5, seed=2)


def test_the_robot_is_not_changed_and_two_chains_are_built(
    robot: Robot, data: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = plain_copy(robot.spec)
    built = counted(build_core, monkeypatch, robot_module)
    result = fastcal.calibrate(robot, data, checks=False)
    assert len(built) == 2  # with the effects that are asked for, and the identified one
    assert robot.spec == before
    for key, value in result.model.spec.items():
        if isinstance(value, list | dict):
            assert value is not robot.spec.get(key)
            assert value is not result.nominal.spec.get(key)


def test_limits_are_made_once(robot: Robot, data: Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    made = counted(parameter_limits, monkeypatch, problem_module)
    fastcal.calibrate(robot, data, effects="geometry,joint_compliance", checks=False)
    assert len(made) == 1
