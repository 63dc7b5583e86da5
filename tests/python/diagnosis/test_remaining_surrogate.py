# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cause that no name has: the diagnosis places it, closes the gap on other poses, and claims no cause."""

import copy
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.diagnosis import Diagnosis, diagnose, held_out, remaining_surrogate
from fastcal.diagnosis.adaptation import Judge
from fastcal.diagnosis.remaining_surrogate import with_surrogate
from fastcal.effects import registered
from fastcal.effects.registered import States
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot
from fastcal.surrogate import AddedSurrogate
from fastcal.surrogate.candidates import posture_inputs
from fastcal.units import to_si

from .rules.small_arm import arm, measured

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


def test_what_is_unexplained_has_a_place_and_a_surrogate_in_the_model(found: Diagnosis) -> None:
    assert found.verdict == "unexplained"
    assert found.unexplained is not None
    assert found.unexplained.owner == "joint3"
    assert "approach3" in found.unexplained.depends_on
    assert found.unexplained.added is not None
    assert found.unexplained.added.startswith("surrogate@joint3")
    assert found.gap[-1].added == found.unexplained.added
    assert any(entry["effect"] == "surrogate" for entry in found.model.spec["effects"])
    assert "surrogate" not in {f.effect for f in found.effects}
    written = found.to_json_dict()["unexplained"]
    assert written["added"] == found.unexplained.added
    assert 0 < written["share"] <= 1


def test_it_closes_the_gap_on_other_poses_and_no_name_is_sure(found: Diagnosis) -> None:
    first, last = found.gap[0].test_rms_mm or 0.0, found.gap[-1].test_rms_mm or 0.0
    floor = 0.03 * 3**0.5
    assert first**2 - last**2 > 0.9 * (first**2 - floor**2)
    assert all(f.grade != "A" for f in found.effects)


def test_a_surrogate_that_fits_worse_is_not_given(found: Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is linear near the fit need not be where it is added: the model itself is asked."""
    assert found.unexplained is not None
    spec = copy.deepcopy(found.model.spec)
    spec["tool"]["xyz_mm"][0] += 5.0
    places, less = np.zeros(0), np.zeros(9)
    off = AddedSurrogate(
        Robot(spec), ("surrogate@joint3",), "joint3", ("q3",), 0.9, 1e3, 0.1, *np.zeros((2, 9, 1)), places, less
    )
    monkeypatch.setattr(remaining_surrogate, "add_surrogate", lambda *_, **__: off)
    monkeypatch.setattr(remaining_surrogate, "formulas", lambda *_: [])
    judge = Judge(found.final.fit.problem.data, None)
    model, step, unexplained = with_surrogate(
        found.steps[-2], found.gap[-2], found.final.fit, found.final.fit.problem.used, judge, found.unexplained
    )
    assert (model, step) == (None, None)
    assert unexplained is not None
    assert (unexplained.owner, unexplained.added) == ("joint3", None)


def test_a_strong_cause_that_has_a_name_is_not_given_to_a_function() -> None:
    """At 400 times the noise the squares of two fits do not compare: one left "10336 % less" than a complete model."""
    yields = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 3e-4}}
    found = diagnose(arm(), measured([yields], rows=90))
    assert found.verdict == "named"
    assert [(f.label, f.in_model) for f in found.effects] == [("joint_compliance@joint2", True)]


def test_no_surrogate_is_learnt_on_a_grid_of_few_positions() -> None:
    """Rows held out of such a grid repeat those that are learnt; one joint at five positions shows what is between."""
    random = np.random.default_rng(0)
    few = random.choice([-1.0, 0.2, 0.9, 1.3], (50, 3))
    assert not held_out.shows_between(Dataset.from_arrays(few))
    assert {"q3", "load1", "down2_x", "height"} <= posture_inputs(3)
    assert posture_inputs(3).isdisjoint({"time", "temperature", "payload", "approach1"})
    few[:5, 1] = np.linspace(-1.0, 1.3, 5)
    assert held_out.shows_between(Dataset.from_arrays(few))
