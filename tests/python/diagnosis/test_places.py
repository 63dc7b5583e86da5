# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes that no name describes are placed where they are, and no other name is given in their stead."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import diagnose
from fastcal.measurements.dataset import Dataset

from .plain_cobot import in_full

SIGMA = 4e-5  # [m]
ROWS = 150
FloatArray = NDArray[np.float64]


@cache
def arm() -> Robot:
    return load_robot("pmc6va030")


def measured(shift: Callable[[FloatArray, FloatArray], FloatArray] | None, seed: int = 3) -> Dataset:
    """Rows in which each joint is off its command by `shift` of commands (N, 6) and approaches (N, 6)."""
    q = random_poses(arm(), ROWS, seed=seed)
    approach = np.random.default_rng(seed).choice([-1.0, 1.0], q.shape)
    there = q if shift is None else q + shift(q, approach)
    more = {"approach": approach, "time": 30.0 * np.arange(ROWS)}
    seen = simulate(
        perturbed(arm(), seed=seed), Dataset.from_arrays(there, robot=arm(), **more), noise=SIGMA, seed=seed
    )
    return replace(seen, q=q)


def friction_by_load(q: FloatArray, approach: FloatArray) -> FloatArray:
    """Joint 3 stops short by its direction times a load that changes with its own posture."""
    out = np.zeros_like(q)
    out[:, 2] = 4e-4 * approach[:, 2] * np.cos(q[:, 1] + q[:, 2])
    return out


def short_of_the_last_move(q: FloatArray, approach: FloatArray) -> FloatArray:
    """Joint 2 lags by the direction in which the command last moved, whatever the column of approaches says."""
    out = np.zeros_like(q)
    out[1:, 1] = 2e-4 * np.sign(np.diff(q[:, 1]))
    return out


@pytest.mark.parametrize(
    ("shift", "owner", "variable"),
    [(friction_by_load, "joint3", "approach3"), (short_of_the_last_move, "joint2", "last move of joint 2")],
)
def test_lost_motion_of_another_form_is_placed(
    shift: Callable[[FloatArray, FloatArray], FloatArray], owner: str, variable: str
) -> None:
    found = diagnose(arm(), measured(shift), sigma=SIGMA)
    if found.unexplained is None:  # the library may hold the cause by now: then it has to be its owner's
        assert {f.owner for f in found.effects} == {owner}
        return
    assert found.unexplained.owner == owner
    assert variable in found.unexplained.depends_on
    assert all(f.grade != "A" for f in found.effects)


def test_an_instrument_s_circle_is_the_instrument_s() -> None:
    data = measured(None)
    assert data.position is not None
    place = data.position + np.array([2.5, 1.0, -0.5])  # the instrument stands beside the arm
    x, y, _ = place.T
    azimuth = np.arctan2(y, x)
    around = np.column_stack([-y, x, np.zeros_like(x)])
    seen = place + 2e-4 * np.sin(2 * azimuth + 0.7)[:, np.newaxis] * around
    found = diagnose(arm(), replace(data, position=seen), sigma=SIGMA)
    owners = {f.owner for f in found.effects} | ({found.unexplained.owner} if found.unexplained else set())
    assert "instrument" in owners
    assert all(f.owner == "instrument" or f.grade != "A" for f in found.effects)


@pytest.mark.parametrize("seed", [1, *in_full(2, 3, 4)])
def test_what_is_wrong_in_a_small_part_of_a_joints_way_is_not_thrown_out(seed: int) -> None:
    """A bump that few rows show predicts no held-out row: they are told with their place, and nothing is 'none'."""

    def bump(q: FloatArray, approach: FloatArray) -> FloatArray:
        out = np.zeros_like(q)
        centre = np.quantile(q[:, 3], 0.4)
        out[:, 3] = 4e-3 * np.exp(-(((q[:, 3] - centre) / 0.08) ** 2))
        return out

    data = measured(bump, seed)
    wrong = np.flatnonzero(np.abs(data.q[:, 3] - np.quantile(data.q[:, 3], 0.4)) < 0.08)
    assert len(wrong) >= 4
    found = diagnose(arm(), data)
    assert found.verdict != "none"
    assert all(f.grade != "A" for f in found.effects)
    assert found.unexplained is not None or [f.owner for f in found.effects] == ["joint4"]
    if found.unexplained is not None:
        assert found.unexplained.owner == "joint4"
