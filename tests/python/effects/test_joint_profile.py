# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joint profiles: the curve is found, its curvature by what predicts unseen rows, and outside its range it fades."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.calibration.prediction import predict
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.calibration.smoothing import LinearProblem, choose_curvatures, prior_deviations
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]


def joint_error(model: Robot, joint: int, q: FloatArray) -> FloatArray:
    """How much the profile turns a joint: the tool's turn against the model without it, along the joint's own."""
    bare = Robot(model.spec | {"effects": []})
    posture = np.zeros((len(q), model.joint_count))
    posture[:, joint] = q
    step = np.zeros(model.joint_count)
    step[joint] = 1e-3
    nominal, there, further = (
        m.forward(p)[:, :3, :3] for m, p in ((bare, posture), (model, posture), (bare, posture + step))
    )
    axis = [np.asarray(_core.log_so3(a.T @ b)) / 1e-3 for a, b in zip(nominal, further, strict=True)]
    turn = [np.asarray(_core.log_so3(a.T @ b)) for a, b in zip(nominal, there, strict=True)]
    return np.einsum("ni,ni->n", turn, axis)


@pytest.fixture(scope="module")
def wavy(arm: Robot, poses: Dataset, with_effects: Any) -> Dataset:
    """Joint 3 errs by two waves, joint 1 by nothing."""
    truth = with_effects(
        perturbed(arm, seed=6),
        {
            "effect": "gear_harmonic",
            "owner": "joint3",
            "order": 2,
            "parameters": {"amplitude_rad": 4e-4, "phase_rad": 0.3},
        },
        {
            "effect": "gear_harmonic",
            "owner": "joint3",
            "order": 5,
            "parameters": {"amplitude_rad": 1e-4, "phase_rad": 1.3},
        },
    )
    return simulate(truth, poses, noise=3e-5, seed=2)


def test_the_curve_is_found_and_what_is_flat_stays_flat(arm: Robot, wavy: Dataset) -> None:
    found = calibrate(arm, wavy, effects="geometry,joint_profile@joint1,joint_profile@joint3")
    assert found.status == "converged"
    assert found.train.after is not None
    assert found.train.after.rms < 1.05 * 3e-5 * 3**0.5
    flat, wave = found.model.spec["effects"]
    assert wave["curvature"] > 30 * flat["curvature"]

    q = np.linspace(wave["low_rad"] + 0.05, wave["high_rad"] - 0.05, 60)
    truth = 4e-4 * np.sin(2 * q + 0.3) + 1e-4 * np.sin(5 * q + 1.3)
    got = joint_error(found.model, 2, q)
    # What offset, ratio and the neighbours' lengths take up of a curve is theirs: a straight line and one wave a turn.
    common = np.column_stack([np.ones_like(q), q, np.sin(q), np.cos(q)])
    rest = (got - truth) - common @ np.linalg.lstsq(common, got - truth, rcond=None)[0]
    assert np.std(rest) < 2e-5


def test_outside_its_range_it_is_the_robot_without(arm: Robot, wavy: Dataset) -> None:
    model = calibrate(arm, wavy, effects="geometry,joint_profile@joint3:knots=10").model
    (entry,) = model.spec["effects"]
    assert range_notes(model, wavy) == []
    beyond = replace(wavy, q=wavy.q + np.where(np.arange(6) == 2, 0.1, 0.0))
    count = int((beyond.q[:, 2] > entry["high_rad"]).sum())
    (note,) = range_notes(model, beyond)
    assert note.startswith("joint 3 is outside the ")
    assert f"in {count} of 300 rows; there the profile fades to zero within 5 deg" in note
    assert predict(model, beyond).notes == (note,)
    far = np.array([entry["low_rad"] - 0.09, entry["high_rad"] + 0.09, entry["high_rad"] + 1.0])
    assert joint_error(model, 2, far) == pytest.approx(0.0, abs=1e-14)
    near = np.array([entry["high_rad"] - 1e-4, entry["high_rad"] + 1e-4])
    inside, outside = joint_error(model, 2, near)
    assert outside == pytest.approx(inside, abs=1e-6)


def test_a_curvature_that_is_given_is_taken(arm: Robot, wavy: Dataset) -> None:
    model = calibrate(arm, wavy, effects="geometry,joint_profile@joint3:curvature=1e-6:knots=8").model
    (entry,) = model.spec["effects"]
    assert entry["curvature"] == 1e-6
    bent = [v["value"] for name, v in entry["parameters"].items() if name != "curve1_rad"]
    assert max(abs(v) for v in bent) < 1e-6


def test_the_prior_of_a_coefficient_is_the_curvature_over_its_roughness() -> None:
    assert prior_deviations(0.02, np.array([0.0, 4.0, 100.0])) == pytest.approx([np.inf, 0.01, 0.002])


def test_cross_validation_finds_the_curvature_that_made_the_data() -> None:
    """Coefficients drawn from N(0, s^2 / w), s 10 and 0.01: the first to within a factor of 3, the other far below."""
    random = np.random.default_rng(1)
    penalty = np.arange(1, 21, dtype=float) ** 4
    J = random.normal(0, 1, (600, 41))
    b = np.concatenate(
        [
            random.normal(0, 1, 1),
            random.normal(0, 1, 20) * 10 / penalty**0.5,
            random.normal(0, 1, 20) * 0.01 / penalty**0.5,
        ]
    )
    residual = J @ b + random.normal(0, 0.05, 600)
    blocks = [np.arange(1, 21), np.arange(21, 41)]
    problem = LinearProblem(J, residual, np.repeat(np.arange(200), 3), blocks, [penalty, penalty], np.full(41, 100.0))
    rough, smooth = choose_curvatures(problem)
    assert 10 / 3 < rough < 10 * 3
    assert smooth < rough / 30
