# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Shoulder, elbow and wrist: told by signs that the Jacobian's determinant confirms, and kept."""

import copy

import numpy as np
import pytest

from fastcal import InvalidInput, Robot, configurations, inverse_kinematics, load_robot, perturbed, random_poses
from fastcal.ik.posture import SphericalWristArm
from fastcal.robots import serial

SIX = [name for name in serial() if load_robot(name).joint_types == ["revolute"] * 6]


@pytest.mark.parametrize("name", SIX)
def test_what_the_configuration_says_changes_where_the_jacobian_is_singular_and_nowhere_else(name: str) -> None:
    """det J is the product of what the three signs are taken of and of a number of one sign."""
    robot = load_robot(name)
    arm = SphericalWristArm(robot)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (4000, 6))
    signs = np.prod(1 - 2.0 * arm.sides(q), axis=1) * np.sign(np.linalg.det(robot.joint_jacobian(q)))
    assert arm.has_configurations
    assert abs(signs.sum()) == len(q)
    assert len(set(configurations(robot, q))) == 8


def test_words_say_where_the_wrist_is() -> None:
    """The RX160L stretches upwards at q = 0, to its x; joint 2 leans it forward, joint 3 bends it."""
    robot = load_robot("staubli_rx160l")
    folded, straight = [0.0, 0.0, 1.2, 0.0, 0.5, 0.0], [0.0, 0.0, -1.2, 0.0, -0.5, 0.0]
    assert configurations(robot, [folded, straight])[0] == "front up positive"
    assert configurations(robot, straight)[0].endswith("down negative")
    wrist = robot.forward([0.0, -1.0, 0.2, 0.0, 0.5, 0.0])[0, 0, 3]
    assert wrist < 0  # leant over backwards
    assert configurations(robot, [0.0, -1.0, 0.2, 0.0, 0.5, 0.0])[0].startswith("back")


def test_an_arm_of_another_kind_has_none() -> None:
    robot = load_robot("spray_7dof")
    assert configurations(robot, random_poses(robot, 3)).tolist() == ["", "", ""]
    assert inverse_kinematics(robot, robot.forward(np.zeros(7))).configuration.tolist() == [""]


def in_the_same(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Other postures, each in the configuration of a row of q."""
    others = random_poses(robot, 4000, seed=2)
    words = configurations(robot, others)
    return np.array([others[words == word][row % 100] for row, word in enumerate(configurations(robot, q))])


def test_far_targets_are_reached_in_the_configuration_of_the_seed() -> None:
    robot = load_robot("staubli_rx160l")
    q = random_poses(robot, 150, seed=1)
    targets, seed = robot.forward(q), in_the_same(robot, q)
    jumped = inverse_kinematics(robot, targets, seed)
    assert (jumped.configuration != configurations(robot, q)).mean() > 0.2
    found = inverse_kinematics(robot, targets, seed, keep_configuration=True)
    assert (found.status == "reached").all()
    assert (found.configuration == configurations(robot, q)).all()
    assert np.abs(robot.forward(found.q) - targets).max() < 2e-9
    assert ((found.q >= robot.limits[:, 0]) & (found.q <= robot.limits[:, 1])).all()
    # The one solution of a configuration, but for whole turns.
    assert np.abs((found.q - q + np.pi) % (2 * np.pi) - np.pi).max() < 1e-6


def test_the_arm_that_gives_way_keeps_the_configuration_of_the_nominal_one() -> None:
    nominal = load_robot("staubli_rx160l")
    spec = copy.deepcopy(perturbed(nominal, seed=3).spec)
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": f"joint{i}", "parameters": {"compliance_rad_nm": 2e-6}} for i in (2, 3)
    ]
    model = Robot(spec)
    q = random_poses(nominal, 150, seed=1) * 0.95
    J = nominal.joint_jacobian(q)
    J[:, :3] /= nominal.reach
    q = q[np.linalg.svd(J, compute_uv=False)[:, -1] > 0.05]
    targets = nominal.forward(q)
    found = inverse_kinematics(model, targets, in_the_same(nominal, q), keep_configuration=True, payload=5.0)
    assert (found.status == "reached").all()
    assert (found.configuration == configurations(nominal, q)).all()
    assert np.abs(model.forward(found.q, payload=5.0) - targets).max() < 2e-9
    assert 1e-4 < np.abs((found.q - q + np.pi) % (2 * np.pi) - np.pi).max() < 0.2


def test_a_command_just_across_a_singularity_keeps_the_branch() -> None:
    """Joint 5 is built 0.6 degrees off: commanded there from 0.2 degrees it crosses 0, and the wrist does not turn."""
    nominal = load_robot("staubli_rx160l")
    spec = copy.deepcopy(nominal.spec)
    spec["joints"][4]["theta_deg"] += 0.6
    q = np.radians([20.0, 30.0, 70.0, 40.0, 0.2, -30.0])
    found = inverse_kinematics(Robot(spec), nominal.forward(q), q, keep_configuration=True)
    assert found.status[0] == "reached"
    assert found.q[0] == pytest.approx(np.radians([20.0, 30.0, 70.0, 40.0, -0.4, -30.0]), abs=1e-6)
    assert (found.configuration[0], configurations(nominal, q)[0]) == ("front up negative", "front up positive")


def test_what_only_another_configuration_reaches_is_reported() -> None:
    robot = load_robot("staubli_rx160l")
    q = np.array([0.3, 0.4, 1.2, 0.3, 0.7, 0.8])
    box = np.stack([q - 0.3, q + 0.3], axis=1)
    box[4] = -1, 1
    seed, far = q * [1, 1, 1, 1, -1, 1], robot.forward(q)[0]
    far[:3, 3] *= 10
    lost = far * np.nan
    targets = [robot.forward(q)[0], far, lost, robot.forward(seed)[0]]
    found = inverse_kinematics(robot, targets, seed, limits=box, keep_configuration=True)
    assert found.status.tolist() == ["configuration", "unreachable", "bad_target", "reached"]
    assert found.reached.tolist() == [False, False, False, True]
    assert found.q[0] == pytest.approx(q, abs=1e-6)
    assert found.message(0) == "the target can be reached only in another configuration: front up positive"


def test_what_cannot_be_kept_is_refused() -> None:
    iiwa, six = load_robot("lbr_iiwa14"), load_robot("ur5")
    with pytest.raises(InvalidInput, match="lbr_iiwa14 has no shoulder, elbow and wrist whose configuration could"):
        inverse_kinematics(iiwa, np.eye(4), keep_configuration=True)
    with pytest.raises(InvalidInput, match="give it or keep_configuration=True, not both"):
        inverse_kinematics(six, np.eye(4), along_path=True, keep_configuration=True)
