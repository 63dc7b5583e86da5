# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What an attack on the diagnosis found of its noise, finding D2: what was missing passed for noise.

The arm is that of plain_cobot, in numpy; its joints err in ways that no effect of the library has.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Dataset, diagnose, load_measurements, load_robot

from .plain_cobot import SIGMA, directions, in_full, measured, points, postures, robot, shifted

FloatArray = NDArray[np.float64]
Shift = Callable[[FloatArray, FloatArray], dict[int, FloatArray]]

ROWS = 150


def by_load(q: FloatArray, approach: FloatArray) -> dict[int, FloatArray]:
    """Joint 3 stops short by its direction times a load."""
    return {3: 5e-4 * approach[:, 2] * np.cos(q[:, 1] + q[:, 2])}


def by_another_joint(q: FloatArray, approach: FloatArray) -> dict[int, FloatArray]:
    """Joint 3 by the direction of joint 2, as a motor does that drives it through a parallelogram."""
    return {3: 3e-4 * approach[:, 1]}


def by_the_previous_pose(q: FloatArray, approach: FloatArray) -> dict[int, FloatArray]:
    """Joint 2 by the direction in which the command last moved, whatever the columns of approach say."""
    return {2: np.append(0.0, 3e-4 * np.sign(np.diff(q[:, 1])))}


def through_a_parallelogram(q: FloatArray, approach: FloatArray) -> dict[int, FloatArray]:
    """Lost motion of motor 2: joint 3 turns back by what joint 2 turns."""
    return {2: 3e-4 * approach[:, 1], 3: -3e-4 * approach[:, 1]}


def rows(shift: Shift, thrice: int = 0, **columns: FloatArray) -> Dataset:
    """Poses, the first of which are measured three times, with a column of the noise that is true."""
    visits = np.r_[np.arange(ROWS), np.arange(thrice), np.arange(thrice)]
    q, approach = postures(ROWS, 1)[visits], directions(ROWS, 1)[visits]
    claim = np.full((len(q), 3), SIGMA)
    place = points(shifted(q, shift(q, approach)), 1)
    return measured(q, place, 1, approach=approach, sigma_position=claim, **columns)


@pytest.mark.parametrize("shift", [by_load, *in_full(by_another_joint, through_a_parallelogram)])
def test_a_true_claim_is_not_overruled(shift: Shift) -> None:
    """D2: it was in 14 of 22 sets with a cause outside the library, by a noise 1.9 times too large in the median."""
    found = diagnose(robot(), rows(shift))
    assert found.sigma_source == "column"
    assert found.sigma_mm == pytest.approx(1e3 * SIGMA, rel=1e-6)
    assert found.verdict == "unexplained"
    assert all(f.grade != "A" for f in found.effects)


@pytest.mark.parametrize("shift", [by_load, *in_full(through_a_parallelogram)])
def test_the_pure_error_of_repeats_is_looked_at_beside_a_claim(shift: Shift) -> None:
    """D2: of 20 poses that were measured three times it was not, and backlash of joint 2 got grade A."""
    found = diagnose(robot(), rows(shift, thrice=20))
    assert found.sigma_source in ("column", "repeats")
    assert found.sigma_mm == pytest.approx(1e3 * SIGMA, rel=0.15)
    assert found.verdict == "unexplained"
    assert all(f.grade != "A" for f in found.effects)


def test_repeats_of_an_independent_simulator_are_the_noise(shared_data: Path) -> None:
    """D2, friction by load on an arm that it was found on."""
    folder = shared_data / "hidden_effects_2" / "44_repeats_friction_by_load"
    nominal = load_robot(folder / "robot.yaml")
    found = diagnose(nominal, load_measurements(folder / "measurements.csv", nominal))
    assert found.sigma_mm == pytest.approx(0.03905, rel=0.15)


@pytest.mark.parametrize(
    ("shift", "owner", "variable"),
    [
        (by_load, "joint3", "approach3"),
        pytest.param(by_another_joint, "joint3", "approach2", marks=pytest.mark.full),
        pytest.param(by_the_previous_pose, "joint2", "last move of joint 2", marks=pytest.mark.full),
    ],
)
def test_what_lost_motion_may_depend_on_is_among_the_blocks(shift: Shift, owner: str, variable: str) -> None:
    """D2: direction times load, directions of other joints and the previous pose were not."""
    found = diagnose(robot(), rows(shift, time=30.0 * np.arange(ROWS)))
    assert found.unexplained is not None
    assert found.unexplained.owner == owner
    assert variable in found.unexplained.depends_on
