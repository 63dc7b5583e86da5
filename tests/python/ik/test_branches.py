# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""All configurations of an arm of six joints."""

import copy

import numpy as np
import pytest

from fastcal import InvalidInput, Robot, branches, load_robot


def test_an_arm_with_a_wrist_in_one_point_has_eight_of_which_each_flips_its_wrist() -> None:
    """q5 -> -q5, q4 and q6 by half a turn: the same pose, exactly, where axes 4, 5, 6 meet."""
    spec = copy.deepcopy(load_robot("staubli_rx160l").spec)
    for joint in spec["joints"]:
        joint["min_deg"], joint["max_deg"] = -180, 180
    robot = Robot(spec)
    q = np.array([0.3, 0.2, 1.6, 0.6, 0.7, 0.8])  # near enough to be reached over the shoulder, too
    found = branches(robot, robot.forward(q)[0])
    assert len(found) == 8
    assert found.reached.all()
    assert np.abs(robot.forward(found.q) - robot.forward(q)).max() < 2e-9
    turned = (found.q[:, None] - found.q[None] + np.pi) % (2 * np.pi) - np.pi
    assert (np.abs(turned).max(axis=2)[~np.eye(8, dtype=bool)] > 1e-2).all()
    flipped = found.q * [1, 1, 1, 1, -1, 1] + [0, 0, 0, np.pi, 0, np.pi]
    apart = np.abs((flipped[:, None] - found.q[None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
    assert apart.min(axis=1).max() < 1e-7


def test_each_branch_is_followed_to_the_arm_that_gives_way() -> None:
    nominal = load_robot("staubli_rx160l")
    spec = copy.deepcopy(nominal.spec)
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": f"joint{i}", "parameters": {"compliance_rad_nm": 1e-6}}
        for i in range(1, 7)
    ]
    model = Robot(spec)
    q = np.array([0.3, 0.2, 0.9, 0.6, 0.7, 0.8])
    target = nominal.forward(q)[0]
    there, here = branches(nominal, target, near=q), branches(model, target, near=q, payload=10.0)
    assert np.abs(there.q[0] - q).max() < 1e-7
    assert len(here) == len(there)
    assert (here.status == "reached").all()
    assert np.abs(model.forward(here.q, payload=10.0)[:, :3, 3] - target[:3, 3]).max() < 2e-9
    assert 1e-4 < np.abs(here.q - there.q).max() < 0.05


def test_a_redundant_arm_has_no_list() -> None:
    with pytest.raises(InvalidInput, match="lbr_iiwa14 has 7 joints: a pose has infinitely many solutions"):
        branches(load_robot("lbr_iiwa14"), np.eye(4))
