# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Payloads beyond those of the fit, such as grams that were taken for kilograms."""

from __future__ import annotations

import numpy as np
import pytest

from fastcal import calibrate, load_robot, perturbed, random_poses, simulate
from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

YIELDS = "joint_compliance@joint2"


@pytest.fixture(scope="module")
def fitted() -> dict[bool, Robot]:
    """Models of the payloads 0, 3 and 5 kg, with and without a joint that yields to them."""
    nominal = load_robot("ur5e")
    given = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 2e-5}}
    real = perturbed(nominal, seed=1).with_(effects=[given])
    payload = np.tile([0.0, 3.0, 5.0], 14)
    data = simulate(real, random_poses(nominal, 42, seed=2), noise=5e-5, seed=3, payload=payload)
    effects = {True: ["geometry", YIELDS], False: ["geometry"]}
    return {yields: calibrate(nominal, data, effects=names).model for yields, names in effects.items()}


@pytest.mark.parametrize(("payload", "is_far"), [(0.0, False), (10.0, False), (10.1, True), (5000.0, True)])
def test_a_payload_of_more_than_twice_the_heaviest_is_told(
    fitted: dict[bool, Robot], payload: float, is_far: bool
) -> None:
    rows = Dataset.from_arrays(np.zeros((2, 6)), payload=np.array([1.0, payload]))
    told = [
        f"the payload is far outside the 0 to 5 kg that the model was fitted on in 1 rows (1 to {payload:g} kg in all)"
    ]
    assert range_notes(fitted[True], rows) == (told if is_far else [])


def test_a_model_that_yields_to_nothing_does_not_care(fitted: dict[bool, Robot]) -> None:
    rows = Dataset.from_arrays(np.zeros((2, 6)), payload=5000.0)
    assert range_notes(fitted[False], rows) == []
