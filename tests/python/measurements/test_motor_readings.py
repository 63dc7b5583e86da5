# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of robots with closed loops that were meant otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fastcal import load_robot, perturbed, random_poses, simulate
from fastcal.calibration.inspection import check_columns
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

ROWS = 12


def measured(name: str) -> tuple[Robot, Dataset]:
    nominal = load_robot(name)
    return nominal, simulate(perturbed(nominal, seed=1), random_poses(nominal, ROWS, seed=2), noise=5e-5, seed=3)


@pytest.mark.parametrize("name", ["delta", "five_bar", "hexapod", "palletizer"])
def test_columns_as_they_were_meant_pass(name: str) -> None:
    nominal, data = measured(name)
    assert check_columns(nominal, data) == []


@pytest.mark.parametrize(
    ("name", "slip", "words"),
    [
        ("palletizer", {2: (2, -1.0)}, "the sign of joint 3 turned"),
        ("palletizer", {1: (2, 1.0), 2: (1, 1.0)}, "the columns of joints 2 and 3 swapped"),
        ("delta", {0: (0, -1.0)}, "the sign of joint 1 turned"),
    ],
)
def test_a_motor_read_otherwise_is_named(name: str, slip: dict[int, tuple[int, float]], words: str) -> None:
    nominal, data = measured(name)
    q = data.q.copy()
    for joint, (column, sign) in slip.items():
        q[:, joint] = sign * data.q[:, column]
    wrong = replace(data, q=q)
    with pytest.raises(InvalidInput, match=f"with {words} it would be"):
        check_columns(nominal, wrong)


def test_points_in_another_unit_are_named() -> None:
    nominal, data = measured("delta")
    assert data.position is not None
    (note,) = check_columns(nominal, replace(data, position=data.position / 1000), as_read=True)
    assert "with the points in m where they were read in mm it would be" in note


def test_points_of_another_robot_are_left_to_the_calibration() -> None:
    nominal, data = measured("delta")
    random = np.random.default_rng(4)
    assert check_columns(nominal, replace(data, position=random.normal(0, 1, (ROWS, 3)))) == []
