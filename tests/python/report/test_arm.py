# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

import fastcal
from fastcal.report.arm import compared_arm, contributions, skeleton
from fastcal.report.parameter_sizes import differences_at_tool

UR10 = fastcal.load_robot("ur10")
Q = np.random.default_rng(4).uniform(-2, 2, (40, 6))


def changed(joint: int, key: str, by: float, *effects: dict[str, object]) -> fastcal.Robot:
    """The arm with one number of a joint (from 0) changed, and with effects."""
    joints = [dict(each) for each in UR10.spec["joints"]]
    joints[joint][key] += by
    return fastcal.Robot({**UR10.spec, "joints": joints, "effects": list(effects)})


def test_the_skeleton_ends_at_the_tool_and_has_a_point_for_each_joint() -> None:
    points, joints, through = skeleton(UR10, Q)
    assert through == list(range(points.shape[1]))
    np.testing.assert_allclose(points[:, -1], 1e3 * UR10.forward(Q)[:, :3, 3], atol=1e-9)
    np.testing.assert_allclose(points[:, 0], 0, atol=1e-9)  # the base
    assert len(joints) == 6
    assert joints == sorted(joints)
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2)
    assert (lengths.max(axis=0) > 0.5).all()  # no point is drawn twice
    np.testing.assert_allclose(lengths, lengths[0][np.newaxis].repeat(40, axis=0), atol=1e-9)  # links are rigid


def test_frames_on_each_other_are_one_point() -> None:
    joints = [
        {"type": "revolute", "theta_deg": 0, "d_mm": 0, "a_mm": 0, "alpha_deg": 90},
        {"type": "revolute", "theta_deg": 0, "d_mm": 0, "a_mm": 300, "alpha_deg": 0},
    ]
    robot = fastcal.load_robot({"name": "elbow", "kinematics": "dh", "joints": joints})
    points, places, _through = skeleton(robot, np.zeros((1, 2)))
    np.testing.assert_allclose(points[0], [[0, 0, 0], [300, 0, 0]], atol=1e-9)
    assert places == [0, 0]


def test_a_contribution_is_how_far_the_tool_moves_with_the_one_joint_as_it_was() -> None:
    wave = {"effect": "gear_harmonic", "owner": "joint2", "order": 2, "parameters": {"amplitude_rad": 1e-3}}
    model = changed(3, "a_mm", 0.7, wave)
    data = fastcal.simulate(model, Q)
    found = contributions(model, UR10, data)
    assert found is not None
    bent = changed(3, "a_mm", 0.7)
    waved = fastcal.Robot({**UR10.spec, "effects": [wave]})
    far = np.linalg.norm(model.forward(Q)[:, :3, 3] - bent.forward(Q)[:, :3, 3], axis=1)
    assert found[1] == pytest.approx(1e3 * np.sqrt(np.mean(far**2)), rel=1e-9)
    far = np.linalg.norm(model.forward(Q)[:, :3, 3] - waved.forward(Q)[:, :3, 3], axis=1)
    assert found[3] == pytest.approx(1e3 * np.sqrt(np.mean(far**2)), rel=1e-9)
    np.testing.assert_allclose(found[[0, 2, 4, 5]], 0, atol=1e-12)


def test_other_kinematics_are_not_compared() -> None:
    data = fastcal.simulate(UR10, Q)
    assert contributions(fastcal.Robot(fastcal.convert(UR10, "poe").spec), UR10, data) is None


def test_two_models_are_drawn_in_the_base_of_the_first() -> None:
    placed = {"xyz_mm": [900.0, -400.0, 300.0], "rpy_deg": [10.0, -20.0, 70.0]}
    first = fastcal.Robot({**UR10.spec, "base": placed})
    second = fastcal.Robot({**changed(2, "a_mm", 0.5).spec, "base": placed})
    found = fastcal.compare(first, second)
    positions, apart, arm = compared_arm(found, differences_at_tool(found))
    np.testing.assert_allclose(arm.points[:, -1], positions, atol=1e-6)
    np.testing.assert_allclose(arm.points[:, 0], 0, atol=1e-6)
    shown = [row for _set, row in arm.rows]
    np.testing.assert_allclose(np.linalg.norm(apart, axis=1), 1e3 * found.distance[shown], rtol=1e-9)
    assert 0.1 < np.linalg.norm(apart, axis=1).max() < 0.6
    # At the postures the second model, its base fitted, is where the arrows end.
    ends = (positions + apart) / 1e3
    there = fastcal.Robot(changed(2, "a_mm", 0.5).spec).forward(found.q[shown])[:, :3, 3]
    left = ends - there
    left -= left.mean(axis=0)
    assert np.linalg.norm(left, axis=1).max() < 3e-4
