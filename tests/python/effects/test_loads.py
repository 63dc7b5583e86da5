# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Gravity torques of shipped arms against pinocchio, by way of URDF; loads to first order where it is asked for."""

import copy
from pathlib import Path

import numpy as np
import pinocchio
import pytest

import fastcal
from fastcal.io.robot_file import read_spec
from fastcal.io.urdf_file import urdf_text
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot

ARMS = ["kuka_kr500_3", "staubli_rx160l", "siasun_sr210d", "spray_7dof", "lbr_iiwa14"]  # mdh, dh, poe, prismatic, 7R


@pytest.mark.parametrize("name", ARMS)
def test_gravity_torques_agree_with_pinocchio(name: str) -> None:
    spec = copy.deepcopy(fastcal.load_robot(name).spec)
    # Off its axes and tilted, so that no torque is 0 by symmetry; a base tilt reaches pinocchio as tilted gravity.
    spec["gravity_m_s2"] = [1.5, -2.0, -9.3]
    spec["gravity_frame"] = "base"
    spec["base"] = {"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]}
    spec["payload"] = {"com_mm": [40.0, -30.0, 150.0]}
    robot = Robot(spec)
    assert sum(joint["link"]["mass_kg"] for joint in spec["joints"]) > 10
    as_urdf = fastcal.convert(robot, "urdf").spec
    model = pinocchio.buildModelFromXML(urdf_text(as_urdf))
    model.gravity = pinocchio.Motion(np.array(as_urdf["gravity_m_s2"]), np.zeros(3))
    payload = 12.5
    at = pinocchio.SE3(np.eye(3), np.zeros(3))
    flange = pose(as_urdf["flange"])
    com = flange[:3, :3] @ (np.array(as_urdf["payload"]["com_mm"]) / 1000.0) + flange[:3, 3]
    model.appendBodyToJoint(model.njoints - 1, pinocchio.Inertia(payload, com, np.zeros((3, 3))), at)
    data = model.createData()

    q = np.random.default_rng(2).uniform(*np.clip(robot.limits, -3, 3).T, (50, robot.joint_count))
    loads = np.asarray(robot.error_model.loads(robot.conditions(q, payload=payload), robot.error_model.start))
    axis = [5 if kind == "revolute" else 2 for kind in robot.joint_types]
    ours = np.column_stack([loads[:, 2 * joint + 1, axis[joint]] for joint in range(robot.joint_count)])
    theirs = np.array([pinocchio.computeGeneralizedGravity(model, data, row) for row in q])
    assert np.abs(theirs).max() > 10
    assert np.abs(ours + theirs).max() < 1e-9


@pytest.fixture
def soft() -> Robot:
    """A KR500 that sags by millimetres."""
    spec = copy.deepcopy(fastcal.load_robot("kuka_kr500_3").spec)
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 4e-7}},
        {"effect": "joint_compliance", "owner": "joint3", "parameters": {"compliance_rad_nm": 6e-7}},
    ]
    return Robot(spec)


def first_order(robot: Robot) -> Robot:
    return Robot(robot.spec | {"equilibrium": False})


def test_the_deflected_arm_carries_its_load_elsewhere(soft: Robot) -> None:
    q = fastcal.random_poses(soft, 100, seed=1)
    bare = Robot(soft.spec | {"effects": []}).forward(q, payload=400.0)
    there, first = (robot.forward(q, payload=400.0) for robot in (soft, first_order(soft)))
    sag = np.linalg.norm((there - bare)[:, :3, 3], axis=1)
    apart = np.linalg.norm((there - first)[:, :3, 3], axis=1)
    assert sag.max() > 5e-3
    assert 1e-6 < apart.max() < 0.01 * sag.max()


def test_a_robot_file_keeps_how_loads_are_taken(soft: Robot, tmp_path: Path) -> None:
    robot = first_order(soft)
    robot.save(tmp_path / "robot.yaml")
    again = fastcal.load_robot(tmp_path / "robot.yaml")
    assert not again.at_equilibrium
    q = fastcal.random_poses(soft, 20, seed=2)
    assert np.array_equal(again.forward(q, payload=300.0), robot.forward(q, payload=300.0))
    assert "equilibrium" not in read_spec("kuka_kr500_3")  # the default is not written
    (tmp_path / "bad.yaml").write_text((tmp_path / "robot.yaml").read_text().replace("false", "perhaps"))
    with pytest.raises(fastcal.ParseError, match="equilibrium: expected true or false, got 'perhaps'"):
        fastcal.load_robot(tmp_path / "bad.yaml")
    assert not Robot(fastcal.convert(robot, "poe", drop_effects=True).spec).at_equilibrium


def test_calibrate_takes_loads_to_first_order_where_asked(soft: Robot) -> None:
    nominal = fastcal.load_robot("kuka_kr500_3")
    truth = first_order(soft)
    data = fastcal.simulate(
        truth, fastcal.random_poses(truth, 120, seed=5), payload=np.tile([0.0, 250.0, 500.0], 40), noise=1e-6, seed=6
    )
    effects = "geometry,joint_compliance@joint2,joint_compliance@joint3"
    same = fastcal.calibrate(nominal, data, effects=effects, equilibrium=False)
    other = fastcal.calibrate(nominal, data, effects=effects)
    assert not same.model.at_equilibrium
    assert other.model.at_equilibrium
    assert same.sigma == pytest.approx(1e-6, rel=0.2)
    assert other.sigma > 1.5e-6  # the wrong kind of load shows as noise
