# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Waves of any order: where no smooth block shows one, and beyond forty cycles a turn, a thousand for each joint."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.periodic import fine_looks
from fastcal.report.diagnosis_steps import next_steps

from .rules.small_arm import SIGMA, arm

ROWS = 150


def wave(order: float) -> Hypothesis:
    return Hypothesis({"effect": "gear_harmonic", "owner": "joint3", "order": order})


def test_looks_are_the_orders_that_a_range_tells_apart_times_the_joints() -> None:
    problem: Any = SimpleNamespace(kept=SimpleNamespace(q=np.tile(np.linspace(-1.0, 1.0, 50)[:, None], (1, 6))))
    apart = np.pi / (2 * 2.0)  # half a resolution of a range of 2 rad
    assert fine_looks(problem, wave(78.75)) == pytest.approx(6 * 400 / apart, rel=0.02)
    assert fine_looks(problem, wave(12.0)) == 0.0
    assert fine_looks(problem, Hypothesis({"effect": "joint_compliance", "owner": "joint3"})) == 0.0


@pytest.mark.parametrize("seed", range(4))
def test_rounded_joints_and_too_small_a_claim_make_no_fine_wave(seed: int) -> None:
    """One such set in a gauntlet had a wave of order 78.75 at six times the noise, which made test poses worse."""
    robot = fastcal.load_robot("ur5")
    arm = fastcal.perturbed(robot, seed=seed)
    poses = fastcal.random_poses(robot, ROWS, seed=seed + 50)
    data = fastcal.simulate(arm, poses, noise=5e-5, seed=seed + 90)
    step = np.radians(0.01)
    read = fastcal.Dataset.from_arrays(
        np.round(data.q / step) * step, position=data.position, robot=robot, sigma_position=np.full((ROWS, 3), 4e-5)
    )
    found = fastcal.diagnose(robot, read)
    assert [of for of in found.effects if of.in_model] == []


def measured(effect: dict[str, Any], reach: float | NDArray[np.float64], rows: int) -> fastcal.Dataset:
    """Rows of the small arm with an effect, each joint within `reach` [rad] of 0."""
    true = fastcal.perturbed(arm(), seed=1, length=5e-4, angle=5e-4)
    q = np.random.default_rng(1).uniform(-1, 1, (rows, 3)) * reach
    having = fastcal.Robot(dict(true.spec) | {"effects": [effect]})
    return fastcal.simulate(having, fastcal.Dataset.from_arrays(q), noise=SIGMA, seed=1)


@pytest.mark.parametrize("order", [12, 17, 25])
def test_a_wave_that_smooth_blocks_miss_is_named(order: int) -> None:
    """It passed for noise: a fifth of a millimetre at a noise of a twentieth."""
    effect = {
        "effect": "gear_harmonic",
        "owner": "joint2",
        "order": order,
        "parameters": {"amplitude_rad": 2e-4, "phase_rad": 0.7},
    }
    found = fastcal.diagnose(arm(), measured(effect, reach=2.0, rows=200))
    assert [(of.label, of.grade) for of in found.effects] == [("gear_harmonic@joint2", "A")]
    assert found.effects[0].parameters["order"].value == order


@pytest.mark.parametrize(("reach", "grade"), [(0.35, "C"), (2.0, "A")])
def test_a_ratio_in_a_short_range_may_be_a_slow_wave(reach: float, grade: str) -> None:
    effect = {"effect": "reduction_ratio", "owner": "joint2", "parameters": {"error": 3e-3}}
    found = fastcal.diagnose(arm(), measured(effect, reach=reach, rows=90))
    assert [(of.label, of.grade) for of in found.effects] == [("reduction_ratio@joint2", grade)]
    assert ("a slow wave fits equally well in a short range" in str(found.effects[0].limits)) == (grade == "C")


def test_what_makes_test_poses_worse_is_no_more_than_possible() -> None:
    """A wave of joint 2 is a slope where the joint was measured, and turns back where the test poses are."""
    wave = {"amplitude_rad": 1.5e-3, "phase_rad": 0.0}
    effect = {"effect": "gear_harmonic", "owner": "joint2", "order": 3, "parameters": wave}
    data = measured(effect, reach=np.array([2.0, 0.3, 2.0]), rows=90)
    found = fastcal.diagnose(arm(), data, test=measured(effect, reach=2.5, rows=60))
    assert [(of.label, of.grade) for of in found.effects] == [("reduction_ratio@joint2", "C")]
    assert "but the test poses are predicted worse with it" in found.sentence
    assert found.status == "predicts_worse"
    assert next_steps(found)[0].startswith("Do not compensate with model.yaml: other poses are predicted worse with it")
