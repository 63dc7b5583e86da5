# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses for a check of arms with play and a temperature, before any data say how joints come and how warm it is."""

import numpy as np
import pytest

import fastcal
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.plan import assumed, check_poses
from fastcal.robot.robot import Robot
from fastcal.units import to_si

NOISE = 3e-5
EFFECTS = [
    {"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": {"value": 5e-4}}},
    {"effect": "thermal_expansion", "owner": "robot", "t0_c": 20.0, "parameters": {"coefficient_1_k": {"value": 4e-5}}},
]


@pytest.fixture(scope="module")
def model() -> Robot:
    nominal = fastcal.load_robot("staubli_rx160l")
    true = Robot(fastcal.perturbed(nominal, seed=3).spec | {"effects": EFFECTS})
    random = np.random.default_rng(0)
    sent = Dataset.from_arrays(
        fastcal.random_poses(nominal, 80, seed=1),
        approach=random.choice([-1.0, 1.0], (80, 6)),
        temperature=to_si(random.uniform(18.0, 32.0, 80), "c"),
        robot=nominal,
    )
    effects = ["geometry", "backlash@joint3", "thermal_expansion@robot:t0_c=20"]
    return fastcal.calibrate(nominal, fastcal.simulate(true, sent, noise=NOISE, seed=5), effects=effects).model


def test_joints_with_play_come_from_either_side_at_the_middle_temperature(model) -> None:
    """It ended: 'needs the column approach3, which the data do not have', and nobody had given data."""
    poses = check_poses(model, 10)
    assert poses.approach is not None
    assert set(poses.approach[:, 2]) == {-1.0, 1.0}
    assert not np.delete(poses.approach, 2, axis=1).any()
    low, high = model.spec["calibration"]["covered"]["temperature_c"]
    (note,) = assumed(model)
    assert note.startswith(f"thermal_expansion@robot: the poses are chosen for one temperature, {(low + high) / 2:.4g}")


def test_an_arm_that_nothing_warms_has_no_note(calibrated) -> None:
    assert assumed(calibrated.model) == []
    assert check_poses(calibrated.model, 4).approach is None


def test_the_poses_find_what_changed(model) -> None:
    poses = check_poses(model, 10)
    spec = model.spec | {"joints": [dict(joint) for joint in model.spec["joints"]]}
    spec["joints"][1]["theta_deg"] += 0.05
    sent = Dataset.from_arrays(
        poses.q, payload=poses.payload, approach=poses.approach, temperature=to_si(25.0, "c"), robot=model
    )
    data = fastcal.simulate(Robot(spec), sent, noise=NOISE, seed=1)
    found = fastcal.check(model, data)
    assert found.verdict == "changed"
    assert found.causes[0].label == "joint2 zero"


def test_too_few_poses_without_approach_columns_ask_for_more(model) -> None:
    """The directions of the rows are known from their order, and those of poses to come from nothing."""
    sent = Dataset.from_arrays(check_poses(model, 8).q, temperature=to_si(25.0, "c"), robot=model)
    found = fastcal.check(model, fastcal.simulate(model, sent, noise=NOISE, seed=1)[:3])
    assert found.verdict == "cannot_tell"
    assert len(found.next_poses) > 0
