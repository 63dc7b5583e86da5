# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Waves beyond forty cycles a turn: a thousand orders of each joint are looked at, and that counts against them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.periodic import fine_looks

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
