# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joints that another joint drives: a lifting column of two stages with one motor, and a parallelogram's elbow."""

from pathlib import Path

import numpy as np
import pytest

from fastcal import calibrate, inverse_kinematics, load_measurements, load_robot, simulate
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


@pytest.fixture
def lift(tmp_path: Path) -> Path:
    text = '<robot name="lift"><link name="base"/>'
    parent = "base"
    for name, kind, xyz, axis, limits, mimic in STAGES:
        text += f'<link name="{name}_link"/><joint name="{name}" type="{kind}"><origin xyz="{xyz}"/>'
        text += f'<parent link="{parent}"/><child link="{name}_link"/><axis xyz="{axis}"/>'
        text += f"{LIMIT.format(*limits)}{mimic}</joint>"
        parent = f"{name}_link"
    (tmp_path / "lift.urdf").write_text(text + "</robot>")
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
    with pytest.raises(InvalidInput, match="joint 2 of lift follows joint 1"):
        inverse_kinematics(robot, np.eye(4))


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
def test_a_mimic_that_can_not_be_meant_is_refused(entry, sentence) -> None:
    spec = read_spec("ur5")
    spec["joints"][3]["mimic"] = {"joint": 5}
    spec["joints"][0]["mimic"] = entry
    with pytest.raises(ParseError, match=sentence):
        read_spec(spec)
