# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cause that no name has: the diagnosis places it, closes the gap on other poses, and claims no cause."""

import copy
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.effects import registered
from fastcal.effects.registered import States
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.units import to_si

NOISE = to_si(0.03, "mm")


def hooked(states: States) -> np.ndarray[Any, Any]:
    """Joint 3 errs to the side that it came from, more at one end of its range."""
    xi = np.zeros((len(states.q), 6, 1))
    assert states.approach is not None
    xi[:, 5, 0] = 3e-4 * states.approach[:, 2] * np.exp(np.sin(states.q[:, 2]))
    return xi


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    arm = load_robot("ur5")
    random = np.random.default_rng(12)
    poses = Dataset.from_arrays(random.uniform(-2.5, 2.5, (320, 6)), approach=random.choice([-1.0, 1.0], (320, 6)))
    fastcal.register_effect(
        "hooked", owners=["joint3"], parameters=[("size", "1", 1.0, "share")], basis=hooked, columns=["approach"]
    )
    spec = copy.deepcopy(perturbed(arm, seed=3).spec)
    spec["effects"] = [{"effect": "hooked", "owner": "joint3", "parameters": {"size": 1.0}}]
    measured = simulate(Robot(spec), poses, noise=NOISE, seed=4)
    registered._effects.pop("hooked")
    return diagnose(arm, measured.select(slice(0, 200)), test=measured.select(slice(200, None)))


def test_the_rest_has_a_place_and_a_surrogate_in_the_model(found: Diagnosis) -> None:
    assert found.verdict == "unexplained"
    assert found.unexplained is not None
    assert found.unexplained.owner == "joint3"
    assert "approach3" in found.unexplained.depends_on
    assert found.unexplained.added is not None
    assert found.unexplained.added.startswith("surrogate@joint3")
    assert found.gap[-1].added == found.unexplained.added
    assert any(entry["effect"] == "surrogate" for entry in found.model.spec["effects"])
    assert "surrogate" not in {f.effect for f in found.effects}
    rest = found.to_json_dict()["unexplained"]
    assert rest["added"] == found.unexplained.added
    assert 0 < rest["share"] <= 1


def test_it_closes_the_gap_on_other_poses_and_no_name_is_sure(found: Diagnosis) -> None:
    first, last = found.gap[0].test_rms_mm or 0.0, found.gap[-1].test_rms_mm or 0.0
    floor = 0.03 * 3**0.5
    assert first**2 - last**2 > 0.9 * (first**2 - floor**2)
    assert all(f.grade != "A" for f in found.effects)
