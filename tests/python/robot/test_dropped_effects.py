# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects leave a model by their names; what stays keeps its numbers and their covariance."""

import numpy as np
import pytest

import fastcal
from fastcal.robot.dropped_effects import drop_effects, name_of

EFFECTS = "geometry,joint_compliance@joint2,joint_compliance@joint3,gear_harmonic@joint1:order=2"
WAVES = ("gear_harmonic@joint1:order=2", "gear_harmonic@joint1:order=3")


@pytest.fixture(scope="module")
def model() -> fastcal.Robot:
    """A calibrated arm with compliances and two waves of one joint."""
    robot = fastcal.load_robot("staubli_rx160l")
    data = fastcal.random_poses(robot, 80, seed=5)
    measured = fastcal.simulate(fastcal.perturbed(robot, seed=6), data, noise=5e-5, seed=7)
    return fastcal.calibrate(robot, measured, effects=f"{EFFECTS},{WAVES[1]}", checks=False).model


def names(robot: fastcal.Robot) -> list[str]:
    return [name_of(entry) for entry in robot.spec["effects"]]


def covariance(robot: fastcal.Robot, parameters: list[str]) -> np.ndarray:
    record = robot.record
    assert record is not None
    at = [record.parameters.index(name) for name in parameters]
    return (record.root @ record.root.T)[np.ix_(at, at)]


def test_names_tell_the_entries_apart(model: fastcal.Robot) -> None:
    assert names(model) == ["joint_compliance@joint2", "joint_compliance@joint3", *WAVES]


@pytest.mark.parametrize(
    ("dropped", "left"),
    [
        ("joint_compliance@joint2", ["joint_compliance@joint3", *WAVES]),
        ("joint_compliance", list(WAVES)),
        ("gear_harmonic@joint1:order=3", ["joint_compliance@joint2", "joint_compliance@joint3", WAVES[0]]),
        (["gear_harmonic", "joint_compliance@joint3"], ["joint_compliance@joint2"]),
        ("gear_harmonic,joint_compliance", []),
        (["joint_compliance", "joint_compliance@joint2"], list(WAVES)),
    ],
)
def test_what_is_named_goes_and_nothing_else(model: fastcal.Robot, dropped: str | list[str], left: list[str]) -> None:
    before = names(model)
    bare = drop_effects(model, dropped)
    assert names(bare) == left
    assert bare.spec["joints"] == model.spec["joints"]
    assert names(model) == before, "the model itself is changed"


def test_the_covariance_of_what_stays_is_the_same(model: fastcal.Robot) -> None:
    bare = drop_effects(model, "joint_compliance")
    assert bare.record is not None
    assert model.record is not None
    gone = set(model.record.parameters) - set(bare.record.parameters)
    assert gone == {name for name in model.record.parameters if "compliance" in name}
    np.testing.assert_array_equal(bare.record.root, np.tril(bare.record.root))
    kept = bare.record.parameters
    np.testing.assert_allclose(covariance(bare, kept), covariance(model, kept), rtol=1e-9, atol=1e-30)


def test_the_model_moves_as_one_that_never_had_it(model: fastcal.Robot) -> None:
    bare = drop_effects(model, "gear_harmonic,joint_compliance")
    by_hand = fastcal.Robot(model.spec | {"effects": []})
    q = fastcal.random_poses(model, 5, seed=1)
    np.testing.assert_array_equal(bare.forward(q, payload=np.full(5, 8.0)), by_hand.forward(q, payload=np.full(5, 8.0)))


@pytest.mark.parametrize(
    "name",
    ["backlash@joint3", "joint_compliance@joint4", "gear_harmonic@joint1:order=4", "geometry", "correction", ""],
)
def test_an_effect_that_is_not_there_is_refused_with_those_that_are(model: fastcal.Robot, name: str) -> None:
    with pytest.raises(fastcal.InvalidInput, match=r"there are joint_compliance@joint2, .*harmonic@joint1:order=2"):
        drop_effects(model, name)


def test_a_nominal_robot_has_none() -> None:
    with pytest.raises(fastcal.InvalidInput, match="it has none"):
        drop_effects(fastcal.load_robot("ur5"), "backlash")
