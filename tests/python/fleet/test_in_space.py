# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What arms of a fleet have in common: found where it is put in, and no base or tool counts."""

from __future__ import annotations

import numpy as np
import pytest

import fastcal
from fastcal.fleet.in_space import error_of, shared_errors
from fastcal.fleet.result import ArmResult, Fleet
from fastcal.robot.robot import Robot


def bent(seed: int, base_mm: float = 0.0, zero_deg: float = 0.05) -> Robot:
    """An arm whose third joint's zero is off, calibrated, in front of an instrument that stands elsewhere."""
    nominal = fastcal.load_robot("ur5e")
    spec = fastcal.load_robot("ur5e").spec
    spec["joints"][2]["theta_deg"] += zero_deg
    spec["base"] = {"xyz_mm": [base_mm, 50.0, -20.0], "rpy_deg": [0.0, 0.0, 30.0]}
    q = fastcal.random_poses(nominal, 60, seed=seed)
    data = fastcal.simulate(fastcal.load_robot(spec), q, noise=1e-6, seed=seed)
    return fastcal.calibrate(nominal, data).model


def test_a_zero_that_is_off_is_drawn_as_the_joints() -> None:
    """By hand: a point at the distance d of the third axis moves by d * angle, but for what base and tool take over."""
    models = [bent(1), bent(2, base_mm=900.0)]
    data = fastcal.Dataset.from_arrays(fastcal.random_poses(models[0], 40, seed=3))
    first, second = (error_of(model, data) for model in models)
    np.testing.assert_allclose(first, second, atol=5e-6)  # wherever the instrument stood
    reference = fastcal.load_robot("ur5e")
    J = np.asarray(reference.joint_jacobian(data.q))[:, :3, 2] * np.radians(0.05)
    assert np.sqrt(np.mean(first**2)) == pytest.approx(np.sqrt(np.mean(J**2)), rel=0.5)
    found = Fleet([ArmResult(f"arm {k}", "converged", model=model) for k, model in enumerate(models)])
    figure = shared_errors(found)
    assert figure is not None
    assert "of 2 arms of the kind ur5e" in figure.note
    assert "(RMS): joint 3 " in figure.note


def test_arms_as_built_have_nothing_in_common() -> None:
    model = bent(4, zero_deg=0.0)
    data = fastcal.Dataset.from_arrays(fastcal.random_poses(model, 20, seed=3))
    assert np.abs(error_of(model, data)).max() < 5e-6
    assert shared_errors(Fleet([ArmResult("one", "converged", model=model)])) is None
    assert shared_errors(Fleet([ArmResult("one", "refused"), ArmResult("two", "refused")])) is None
