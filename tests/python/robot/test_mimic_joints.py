# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joints that another joint drives: a lifting column of two stages with one motor, and a parallelogram's elbow."""

from pathlib import Path

import numpy as np
import pytest

from fastcal import (
    PoseSolver,
    calibrate,
    choose_posture,
    compensate,
    inverse_kinematics,
    load_measurements,
    load_robot,
    simulate,
)
from fastcal.conversion import convert
from fastcal.design import design_poses
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers import write_template
from fastcal.io.robot_file import read_spec, write_spec
from fastcal.measurements.dataset import Dataset
from fastcal.robot import se3
from fastcal.robot.robot import Robot

LIMIT = '<limit lower="{}" upper="{}" effort="1" velocity="1"/>'
STAGES = (  # name, kind, origin, axis, limits, mimic
    ("column", "prismatic", "0 0 0.5", "0 0 1", (0, 0.3), ""),
    ("second", "prismatic", "0.01 0 0.2", "0 0 1", (0, 0.3), '<mimic joint="column"/>'),
    ("shoulder", "revolute", "0.2 0 0.1", "0 1 0", (-2, 2), ""),
    ("elbow", "revolute", "0.6 0 0", "0 1 0", (-4, 4), '<mimic joint="shoulder" multiplier="-1" offset="0.3"/>'),
    ("wrist", "revolute", "0.5 0 0", "0 0 1", (-3, 3), ""),
    ("tilt", "revolute", "0.1 0 0.1", "1 0 0", (-3, 3), ""),
)


def urdf(robot: str, joints: tuple[tuple[str, str, str, str, tuple[float, float], str], ...]) -> str:
    text, parent = f'<robot name="{robot}"><link name="base"/>', "base"
    for name, kind, xyz, axis, limits, mimic in joints:
        text += f'<link name="{name}_link"/><joint name="{name}" type="{kind}"><origin xyz="{xyz}"/>'
        text += f'<parent link="{parent}"/><child link="{name}_link"/><axis xyz="{axis}"/>'
        text += f"{LIMIT.format(*limits)}{mimic}</joint>"
        parent = f"{name}_link"
    return text + "</robot>"


@pytest.fixture
def lift(tmp_path: Path) -> Path:
    (tmp_path / "lift.urdf").write_text(urdf("lift", STAGES))
    return tmp_path / "lift.urdf"


def by_hand(free: np.ndarray) -> np.ndarray:
    """(4, 4) of the tip for the column, shoulder, wrist and tilt."""
    column, shoulder, wrist, tilt = free
    T = se3.pose(position=[0.21, 0, 0.8 + 2 * column]) @ se3.pose(se3.rotation_y(shoulder))
    T = T @ se3.pose(position=[0.6, 0, 0]) @ se3.pose(se3.rotation_y(0.3 - shoulder))
    T = T @ se3.pose(position=[0.5, 0, 0]) @ se3.pose(se3.rotation_z(wrist))
    return T @ se3.pose(position=[0.1, 0, 0.1]) @ se3.pose(se3.rotation_x(tilt))


def postures(count: int) -> np.ndarray:
    """Joint positions with nonsense for the driven joints, which nothing may read."""
    free = np.random.default_rng(0).uniform([0, -2, -3, -3], [0.3, 2, 3, 3], (count, 4))
    return np.insert(free, (1, 2), 99.0, axis=1)


def test_a_driven_joint_follows_whatever_its_column_says(lift: Path) -> None:
    robot = load_robot(lift)
    q = postures(20)
    T = robot.forward(q)
    for row, pose in zip(q[:, [0, 2, 4, 5]], T, strict=True):
        np.testing.assert_allclose(pose, by_hand(row), atol=1e-14)
    follow = robot.follow(q)
    np.testing.assert_array_equal(follow[:, 1], q[:, 0])
    np.testing.assert_allclose(follow[:, 3], 0.3 - q[:, 2], atol=1e-15)
    assert q[0, 1] == 99.0  # the caller's array is the caller's


@pytest.mark.parametrize("kind", ["dh", "mdh", "poe", "urdf"])
def test_driven_joints_go_through_every_kind_of_file(lift: Path, kind: str, tmp_path: Path) -> None:
    spec = convert(load_robot(lift), kind).spec
    write_spec(spec, tmp_path / "arm.yaml")
    q = postures(20)
    expected = load_robot(lift).forward(q)
    np.testing.assert_allclose(load_robot(tmp_path / "arm.yaml").forward(q), expected, atol=1e-12)
    fresh = convert(spec, "urdf").spec
    fresh.pop("source", None)
    write_spec(fresh, tmp_path / "fresh.urdf")
    np.testing.assert_allclose(load_robot(tmp_path / "fresh.urdf").forward(q), expected, atol=1e-12)


def test_a_column_with_one_motor_is_calibrated_without_columns_of_its_slaves(lift: Path, tmp_path: Path) -> None:
    robot = load_robot(lift)
    spec = Robot(robot.spec).spec
    spec["joints"][2]["origin"]["xyz_mm"][0] += 0.8
    spec["joints"][3]["origin"]["rpy_deg"][0] += 0.05
    true = Robot(spec)
    q = postures(60)
    data = simulate(true, Dataset.from_arrays(true.follow(q)), noise=2e-5, seed=1)
    names = {"q1_m": q[:, 0], "q3_rad": q[:, 2], "q5_rad": q[:, 4], "q6_rad": q[:, 5]}
    names |= dict(zip(("x_m", "y_m", "z_m"), data.position.T, strict=True))
    lines = [",".join(names), *(",".join(f"{x:.12g}" for x in row) for row in zip(*names.values(), strict=True))]
    (tmp_path / "data.csv").write_text("\n".join(lines))
    measured = load_measurements(tmp_path / "data.csv", robot)
    np.testing.assert_allclose(measured.q, true.follow(q), atol=1e-11)
    found = calibrate(robot, measured)
    assert found.status == "converged"
    assert found.train.after.rms < 5e-5
    assert np.abs(found.model.forward(q) - true.forward(q))[:, :3, 3].max() < 5e-5


def test_what_is_written_for_a_driven_arm(lift: Path, tmp_path: Path) -> None:
    robot = load_robot(lift)
    write_template(tmp_path / "empty.csv", robot)
    assert (tmp_path / "empty.csv").read_text().startswith("q1_mm,q3_deg,q5_deg,q6_deg,x_mm")
    poses = design_poses(robot, 8)
    np.testing.assert_allclose(poses.q, robot.follow(poses.q), atol=0)


PALLETIZER = (  # six motors; the fourth joint keeps the hand level, as a parallelogram does
    ("turn", "revolute", "0 0 0.8", "0 0 1", (-3, 3), ""),
    ("lower", "revolute", "0.3 0 0", "0 1 0", (-1.5, 1.5), ""),
    ("upper", "revolute", "0 0 1.1", "0 1 0", (-2, 2), ""),
    ("level", "revolute", "1.2 0 0.1", "0 1 0", (-4, 4), '<mimic joint="lower" multiplier="-1" offset="0.1"/>'),
    ("roll", "revolute", "0.1 0 0", "1 0 0", (-3, 3), ""),
    ("tilt", "revolute", "0.1 0 0", "0 1 0", (-2, 2), ""),
    ("spin", "revolute", "0 0 -0.2", "0 0 1", (-3, 3), ""),
)


@pytest.fixture
def palletizer(tmp_path: Path) -> Robot:
    (tmp_path / "palletizer.urdf").write_text(urdf("palletizer", PALLETIZER))
    return load_robot(tmp_path / "palletizer.urdf")


def built(robot: Robot) -> Robot:
    """The arm that there is: origins off, and a lower arm that yields."""
    spec = Robot(robot.spec).spec
    for joint, (axis, by) in zip(spec["joints"], ((0, 0.4), (2, -0.5), (1, 0.3), (0, 0.6), (2, 0.2)), strict=False):
        joint["origin"]["xyz_mm"][axis] += by
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": {"value": 2e-6}}}
    ]
    return Robot(spec)


def test_inverse_kinematics_moves_the_motors_and_the_driven_joint_follows(palletizer: Robot) -> None:
    model = built(palletizer)
    low, high = palletizer.limits.T
    q = palletizer.follow(np.random.default_rng(1).uniform(0.7 * low, 0.7 * high, (30, 7)))
    targets = model.forward(q, payload=20.0)
    near = inverse_kinematics(model, targets, q + 0.05, restarts=0, payload=20.0)
    assert near.reached.all()
    np.testing.assert_allclose(near.q, q, atol=1e-6)
    assert np.abs(near.q[:, 3] - (0.1 - near.q[:, 1])).max() < 1e-14
    assert np.abs(model.forward(near.q, payload=20.0) - targets).max() < 2e-9
    anywhere = inverse_kinematics(model, targets[:6], payload=np.full(6, 20.0))
    assert anywhere.reached.all()
    assert ((anywhere.q >= low) & (anywhere.q <= high)).all()
    again = inverse_kinematics(model, targets[:6], payload=20.0)
    np.testing.assert_array_equal(again.q, anywhere.q)  # the same input, the same output
    command, status = PoseSolver(model, payload=20.0).inverse(targets[0], q[0] + 0.05)
    assert status == "reached"
    np.testing.assert_allclose(command, near.q[0], atol=1e-8)


def test_a_path_keeps_the_way_that_it_began_with(palletizer: Robot) -> None:
    q = np.linspace([0.2, 0.3, 0.4, 0, 0.5, 0.6, -0.2], [0.6, 0.1, 0.7, 0, 0.2, 0.8, 0.4], 20)
    q = palletizer.follow(q)
    found = inverse_kinematics(palletizer, palletizer.forward(q), q[0] + 0.02, along_path=True)
    assert found.reached.all()
    np.testing.assert_allclose(found.q, q, atol=1e-7)


def test_what_a_driven_arm_cannot_reach_is_reported(palletizer: Robot) -> None:
    far, lost = np.eye(4), np.full((4, 4), np.nan)
    far[0, 3] = 20
    inside = palletizer.follow(np.array([[0.1, 0.2, 0.3, 0, 0.4, 0.5, 0.6]]))
    beyond = inside + np.array([0, 0, 0, 0, 0, 0, 0.6])
    narrow = palletizer.limits.copy()
    narrow[6] = -0.5, 0.8
    targets = np.concatenate([[far, lost], palletizer.forward(beyond)])
    found = inverse_kinematics(palletizer, targets, inside[0], limits=narrow, restarts=3)
    assert found.status.tolist() == ["unreachable", "bad_target", "limit"]
    assert found.q[2, 6] == pytest.approx(0.8)
    assert found.position_error[0] > 17
    np.testing.assert_array_equal(found.q[1], inside[0])
    for along_path in (False, True):  # where no target is a pose, too
        none = inverse_kinematics(palletizer, targets[1:2], inside[0], along_path=along_path)
        assert none.status.tolist() == ["bad_target"]
    narrow[3] = 2, 3  # the level joint would need the lower arm below its limits
    with pytest.raises(InvalidInput, match="joint 4 of palletizer follows joint 2, and no position of joint 2 keeps"):
        inverse_kinematics(palletizer, targets[:1], limits=narrow)
    with pytest.raises(InvalidInput, match="keeping a configuration needs a motor in every joint"):
        inverse_kinematics(palletizer, targets, inside[0], keep_configuration=True)
    with pytest.raises(InvalidInput, match="choosing a posture needs a motor in every joint"):
        choose_posture(palletizer, targets, inside[0])


@pytest.mark.parametrize("method", ["full", "one-step"])
def test_compensation_of_an_arm_with_a_driven_joint(palletizer: Robot, method: str) -> None:
    model = built(palletizer)
    q = palletizer.follow(np.linspace([0.2, 0.3, 0.4, 0, 0.5, 0.6, -0.2], [0.6, 0.1, 0.7, 0, 0.2, 0.8, 0.4], 6))
    wanted = palletizer.forward(q)
    found = compensate(model, wanted, nominal=palletizer, method=method, payload=20.0)
    before = np.linalg.norm((model.forward(q, payload=20.0) - wanted)[:, :3, 3], axis=1)
    after = np.linalg.norm((model.forward(found.q, payload=20.0) - wanted)[:, :3, 3], axis=1)
    assert before.min() > 3e-4
    assert after.max() < (1e-8 if method == "full" else 1e-5)
    np.testing.assert_allclose(found.q, palletizer.follow(found.q), atol=1e-14)


@pytest.mark.parametrize(
    ("entry", "sentence"),
    [
        ({"joint": 1}, r"joints\[0\].mimic: joint 1 is the joint itself"),
        ({"joint": 7}, "mimic.joint: expected a whole number from 1 to 6, got 7"),
        ({"joint": 2, "multiplier": "x"}, "mimic.multiplier: expected a finite number"),
        ({"joint": 2, "offset": 3}, "offset.*needs its unit"),
        ({"joint": 2, "ratio": 3}, "the key 'ratio' is not known"),
        ({"joint": 4}, "joint 4 is driven too"),
    ],
)
def test_an_invalid_mimic_is_refused(entry, sentence) -> None:
    spec = read_spec("ur5")
    spec["joints"][3]["mimic"] = {"joint": 5}
    spec["joints"][0]["mimic"] = entry
    with pytest.raises(ParseError, match=sentence):
        read_spec(spec)
