# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a calibration does once: of a hundred rows, a third of the time was work done twice."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration import evaluation as evaluation_module
from fastcal.calibration import problem as problem_module
from fastcal.calibration.data_notes import covered, ranges
from fastcal.calibration.evaluation import realigned
from fastcal.calibration.parameter_limits import parameter_limits
from fastcal.calibration.repeatability import numbered, pose_groups, visit_groups
from fastcal.measurements import dataset as dataset_module
from fastcal.measurements.conditions import build_samples
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import found_kinds
from fastcal.robot import described_robot
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


def test_the_robot_is_not_changed_and_one_chain_is_built(
    robot: Robot, data: Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = plain_copy(robot.spec)
    built = counted(build_core, monkeypatch, described_robot)
    result = fastcal.calibrate(robot, data, checks=False)
    assert len(built) == 1  # the identified one
    assert robot.spec == before
    for key, value in result.model.spec.items():
        if isinstance(value, list | dict):
            assert value is not robot.spec.get(key)
            assert value is not result.nominal.spec.get(key)


def test_limits_are_made_once(robot: Robot, data: Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    made = counted(parameter_limits, monkeypatch, problem_module)
    fastcal.calibrate(robot, data, effects="geometry,joint_compliance", checks=False)
    assert len(made) == 1


@pytest.mark.parametrize(("effects", "count"), [("geometry", 1), ("geometry,joint_compliance", 3)])
def test_rows_are_read_once_by_robots_without_effects(
    robot: Robot, data: Dataset, monkeypatch: pytest.MonkeyPatch, effects: str, count: int
) -> None:
    read = counted(build_samples, monkeypatch, robot_module)
    result = fastcal.calibrate(robot, data, effects=effects, checks=False)
    assert len(read) == count
    alone = fastcal.evaluate(result.model, data, before=result.nominal)
    assert np.array_equal(alone.error_after, result.train.error_after)
    assert alone.before == result.train.before


def test_what_was_measured_is_looked_for_once(robot: Robot, data: Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    looked = counted(found_kinds, monkeypatch, dataset_module)
    fastcal.calibrate(robot, data.select(slice(None)), checks=False)
    assert len(looked) == 1


def test_a_robot_is_hashed_once_and_tells_other_content_apart(robot: Robot) -> None:
    assert robot.sha256 is robot.sha256
    assert Robot(robot.spec | {"made_by": {"rows": 3}}).sha256 == robot.sha256
    assert Robot(robot.spec | {"name": "another"}).sha256 != robot.sha256


def test_a_rigid_motion_is_sought_only_where_it_may_help(monkeypatch: pytest.MonkeyPatch) -> None:
    """Distances between rows tell beforehand that no motion helps, and never where one does."""
    rng = np.random.default_rng(4)
    svd = counted(np.linalg.svd, monkeypatch, np.linalg)
    found = []
    for k in range(200):
        predicted = rng.normal(size=(int(rng.integers(4, 40)), 3))
        shift = rng.normal(size=3) * 10.0 ** rng.uniform(-4, 0) if k % 2 else np.zeros(3)
        found.append((predicted, shift + 10.0 ** rng.uniform(-5, -2) * rng.normal(size=predicted.shape)))
    quick = [realigned(*one) for one in found]
    tried = len(svd)
    monkeypatch.setattr(evaluation_module, "_is_hopeless", lambda p, x, e: False)
    for one, thorough in zip(quick, [realigned(*one) for one in found], strict=True):
        assert (one is None) == (thorough is None)
        assert one is None or thorough is None or np.array_equal(one.motion, thorough.motion)
    helped = sum(one is not None for one in quick)
    assert 30 < helped <= tried < 130
    assert len(svd) == tried + 200


def test_what_the_rows_cover_are_the_ends_of_their_ranges() -> None:
    arm = fastcal.load_robot("spray_7dof")
    q, rng = fastcal.random_poses(arm, 30, seed=1), np.random.default_rng(2)
    data = Dataset.from_arrays(
        q, position=rng.normal(size=(30, 3)), payload=rng.uniform(0, 5, 30), temperature=rng.uniform(280, 310, 30)
    )
    assert "prismatic" in arm.joint_types
    whole = ranges(arm, data)
    assert covered(arm, data) == {name: (float(v.min()), float(v.max())) for name, v in whole.items()}
    assert list(covered(arm, data)) == list(whole)


def test_visits_without_directions_or_labels_are_poses(data: Dataset) -> None:
    twice = Dataset.concatenate([data, data])
    assert np.array_equal(visit_groups(twice), numbered(pose_groups(twice)[:, np.newaxis]))
    assert np.array_equal(np.bincount(visit_groups(twice)), np.full(len(data), 2))
