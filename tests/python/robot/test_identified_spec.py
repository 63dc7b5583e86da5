# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Robots made of others: a spec is copied once, and a chain that stays is not built again."""

import numpy as np
import pytest

import fastcal
from fastcal.robot.identified_spec import moved, with_frames
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot import Robot
from fastcal.robots import serial


def elsewhere(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    T[:3, :3] *= np.linalg.det(T[:3, :3])
    T[:3, 3] = rng.normal(size=3)
    return T


@pytest.mark.parametrize("name", list(serial()))
def test_a_moved_robot_is_that_of_its_spec_to_the_bit(name: str) -> None:
    robot = fastcal.load_robot(name)
    base, tool = elsewhere(1), elsewhere(2)
    found, built = moved(robot, base, tool), Robot(with_frames(robot.spec, base, tool))
    assert found.spec == built.spec
    q = fastcal.random_poses(robot, 20, seed=3)
    assert np.array_equal(found.forward(q, payload=3.0), built.forward(q, payload=3.0))
    assert np.array_equal(found.parameter_jacobian(q, rows=6), built.parameter_jacobian(q, rows=6))
    assert np.array_equal(found.core.nominal, built.core.nominal)


def test_a_robot_copies_its_spec_and_keeps_one_that_it_is_left() -> None:
    spec = plain_copy(fastcal.load_robot("ur5").spec)
    assert Robot(spec).spec is not spec
    assert Robot.keeping(spec).spec is spec
