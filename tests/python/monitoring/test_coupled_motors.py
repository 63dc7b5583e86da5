# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm whose third joint a parallelogram drives: q3 = J3 - J2, and motor 2 moves joints 2 and 3 of the chain."""

from __future__ import annotations

import numpy as np
import pytest

import fastcal
from fastcal.measurements.dataset import Dataset

OFF = np.radians(0.05)
RATIO = 1e-3


@pytest.fixture(scope="module")
def nominal() -> fastcal.Robot:
    spec = fastcal.load_robot("abb_irb6700_200_260").spec
    driven = {"pendant": [{"joint": 3, "minus": 2}], "coupling": [{"joint": 3, "source": 2, "ratio": -1}]}
    return fastcal.load_robot(spec | driven)


def measured(arm: fastcal.Robot, J: np.ndarray, motors: np.ndarray, seed: int) -> Dataset:
    """Points of an arm whose motors are at `motors` where the controller shows J; the chain by hand."""
    chain = motors.copy()
    chain[:, 2] = motors[:, 2] - motors[:, 1]
    shown = J.copy()
    shown[:, 2] = J[:, 2] - J[:, 1]
    points = arm.forward(chain)[:, :3, 3] + np.random.default_rng(seed).normal(scale=3e-5, size=(len(J), 3))
    return Dataset.from_arrays(shown, position=points, robot=arm)


def test_the_motor_that_was_mastered_anew_is_named(nominal) -> None:
    q = fastcal.random_poses(nominal, 60, seed=1)
    true = fastcal.perturbed(nominal, seed=2)
    data = fastcal.simulate(true, q, noise=3e-5, seed=3)
    model = fastcal.calibrate(nominal, data, checks=False).model
    J = model.pendant.shown(fastcal.check_poses(model, 8).q)
    motors = J.copy()
    motors[:, 1] += OFF
    found = fastcal.check(model, measured(true, J, motors, 4))
    assert [cause.label for cause in found.causes] == ["joint2 zero"]
    (change,) = found.causes[0].changes
    assert change.change == pytest.approx(np.degrees(OFF), abs=5 * change.std)


def test_a_ratio_is_that_of_the_motor_which_has_it(nominal) -> None:
    J = nominal.pendant.shown(fastcal.random_poses(nominal, 80, seed=5))
    motors = J.copy()
    motors[:, 1] *= 1 + RATIO
    data = measured(nominal, J, motors, 6)
    found = fastcal.calibrate(nominal, data, effects=["geometry", "reduction_ratio@joint2"], checks=False)
    assert found.sigma == pytest.approx(3e-5, rel=0.15)
    (ratio,) = [p for p in found.parameters if p.owner == "joint2" and p.name == "error"]
    assert ratio.value == pytest.approx(RATIO, abs=5 * ratio.std)
