# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A payload column that is not what its title says is told, with the reading that fits, and makes no cause."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.measurements.dataset import Dataset

from .rules.small_arm import SIGMA, arm, measured

ROWS = 90
YIELDING = [{"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 8e-6}}]


def written(payload: NDArray[np.float64], data: Dataset) -> Dataset:
    return replace(data, payload=payload)


def test_a_payload_as_it_was_measured_is_believed() -> None:
    found = diagnose(arm(), measured(YIELDING, rows=ROWS))
    assert [f.label for f in found.effects] == ["joint_compliance@joint2"]
    assert "payload column" not in found.sentence


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda load: np.where(np.arange(len(load)) < 55, load, load / 0.45359237),
            "11.02 and 22.05 kg, fit as pounds",
        ),
        (lambda load: np.r_[load[1:], load[-1:]], "that of the row before fits"),
        (lambda load: np.where(load == 5, 10.0, np.where(load == 10, 5.0, load)), "with 5 and 10 kg exchanged it does"),
    ],
)
def test_another_reading_of_the_payload_is_told(change, words: str) -> None:  # type: ignore[no-untyped-def]
    data = measured(YIELDING, rows=ROWS)
    found = diagnose(arm(), written(change(data.payload), data))
    assert found.sentence.startswith("The payload column does not fit these rows: ")
    assert words in found.sentence
    assert words in found.notes[0]
    assert [f.label for f in found.effects] == ["joint_compliance@joint2"]


def test_a_compliance_that_stiffens_is_no_wrong_payload() -> None:
    """The law bends beyond what most rows show, so those of one payload alone are missed by a straight one."""
    stiffening = {
        "effect": "joint_compliance_nonlinear",
        "owner": "joint2",
        "parameters": {"low_rad_nm": 9e-6, "high_rad_nm": 1e-6, "critical_nm": 90.0},
    }
    found = diagnose(arm(), measured([stiffening], rows=120))
    assert "payload column" not in found.sentence
    assert [f.label for f in found.effects] == ["joint_compliance_nonlinear@joint2"]


def test_a_bracket_that_bends_with_the_load_is_no_wrong_payload() -> None:
    """It shows most in the rows of the largest load, but no other load makes these fit.

    Found in a simulated set, a fifth of whose rows was left out as mislabelled.
    """
    robot, rows, seed = load_robot("abb_irb1200_7_70"), 60, 0
    q = random_poses(robot, rows, seed=seed)
    load = np.random.default_rng(seed).choice([0.0, 4.0, 9.0], rows, p=[0.42, 0.38, 0.2])
    true = perturbed(robot, seed=seed)
    R = true.forward(q)[:, :3, :3]
    bent = -8e-5 * load[:, np.newaxis] * R[:, 2, :] * [1.0, 1.0, 0.0]
    data = simulate(true, Dataset.from_arrays(q, payload=load, robot=robot), noise=SIGMA, seed=seed)
    found = diagnose(robot, replace(data, position=data.position + np.einsum("nij,nj->ni", R, bent)))
    assert "payload column" not in found.sentence


def with_play(lag: int, seed: int = 3) -> Dataset:
    """Rows of an arm with play in joint 2, whose directions of approach are written `lag` rows late."""
    data = measured([], rows=ROWS, seed=seed)
    approach = np.random.default_rng(seed).choice([-1.0, 1.0], (ROWS, 3))
    play = {"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": 4e-4}}
    true = Robot(dict(perturbed(arm(), seed=seed, length=5e-4, angle=5e-4).spec) | {"effects": [play]})
    poses = Dataset.from_arrays(data.q, payload=data.payload, approach=approach)
    rows = simulate(true, poses, noise=SIGMA, seed=seed)
    return replace(rows, approach=np.roll(approach, lag, axis=0))


def test_directions_that_are_a_row_late_are_told() -> None:
    found = diagnose(arm(), with_play(1))
    assert "the approach columns do not fit these rows: those of the row behind do" in found.notes[0]
    assert [f.label for f in found.effects] == ["backlash@joint2"]


def test_directions_as_they_were_are_believed() -> None:
    found = diagnose(arm(), with_play(0))
    assert "approach columns" not in found.sentence
    assert [f.label for f in found.effects] == ["backlash@joint2"]
