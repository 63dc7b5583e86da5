# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Simulated measurements have the noise, the region and the errors that were asked for."""

import math

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.transform import Rotation

from fastcal import InvalidInput, Robot, calibrate, load_robot, perturbed, predict, random_poses, simulate
from fastcal.conversion import convert
from fastcal.measurements.dataset import Dataset

KINDS = ("dh", "mdh", "poe", "urdf")


def arm(kind: str = "dh") -> Robot:
    return Robot(convert(load_robot("staubli_rx160l"), kind).spec)


def within(sample: np.ndarray, sigma: float) -> bool:
    """Whether the sum of squares is that of N(0, sigma^2): inside the middle 99.9 % of chi-squared."""
    low, high = stats.chi2.ppf([0.0005, 0.9995], sample.size)
    return bool(low < np.sum((sample / sigma) ** 2) < high)


def test_the_noise_has_the_deviation_that_was_asked_for() -> None:
    robot = arm()
    q = random_poses(robot, 400, seed=1)
    data = simulate(robot, q, noise=2e-4, noise_rotation=3e-4, seed=4)
    T = robot.forward(q)
    assert within(data.position - T[:, :3, 3], 2e-4)
    turned = Rotation.from_quat(data.rotation, scalar_first=True) * Rotation.from_matrix(T[:, :3, :3]).inv()
    assert within(turned.as_rotvec(), 3e-4)
    np.testing.assert_array_equal(data.q, q)


def test_repeatability_moves_the_joints_and_not_what_was_commanded() -> None:
    """About a joint at distance r from the point, an error e of that joint alone moves the point by r e."""
    robot = arm()
    q = np.tile(random_poses(robot, 1, seed=2), (500, 1))
    data = simulate(robot, q, repeatability=[1e-4, 0, 0, 0, 0, 0], seed=4)
    point = robot.forward(q[:1])[0, :3, 3]
    radius = math.hypot(point[0], point[1])
    np.testing.assert_array_equal(data.q, q)
    assert within(np.linalg.norm((data.position - point)[:, :2], axis=1), 1e-4 * radius)
    assert np.ptp(data.position[:, 2]) < 1e-12


def test_conditions_of_the_poses_are_kept_and_count() -> None:
    spec = load_robot("staubli_rx160l").spec
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 1e-6}},
    ]
    robot = Robot(spec)
    q = np.tile(random_poses(robot, 1, seed=3), (2, 1))
    sent = Dataset.from_arrays(q, payload=[0.0, 10.0], temperature=[293.0, 294.0])
    data = simulate(robot, sent)
    np.testing.assert_array_equal(data.payload, sent.payload)
    np.testing.assert_array_equal(data.temperature, sent.temperature)
    np.testing.assert_array_equal(data.position, predict(robot, sent).position)
    assert np.linalg.norm(data.position[1] - data.position[0]) > 1e-5


@pytest.mark.parametrize("name", ["ur5", "spray_7dof"])
def test_random_poses_keep_to_limits_and_region(name: str) -> None:
    robot = load_robot(name)
    everywhere = robot.forward(random_poses(robot, 300))[:, :3, 3]
    region = np.quantile(everywhere, [0.3, 0.8], axis=0)
    q = random_poses(robot, 250, region=region, seed=9)
    assert q.shape == (250, robot.joint_count)
    assert ((q >= robot.limits[:, 0]) & (q <= robot.limits[:, 1])).all()
    point = robot.forward(q)[:, :3, 3]
    assert ((point >= region[0]) & (point <= region[1])).all()
    np.testing.assert_array_equal(q, random_poses(robot, 250, region=region, seed=9))


def test_a_region_out_of_reach_is_refused() -> None:
    with pytest.raises(InvalidInput, match="the tool gets into the region in 0 of"):
        random_poses(arm(), 10, region=[[50, 50, 50], [51, 51, 51]])
    with pytest.raises(InvalidInput, match="a lower and an upper corner"):
        random_poses(arm(), 10, region=[[1, 1, 1], [0, 0, 0]])


@pytest.mark.parametrize("kind", KINDS)
def test_a_perturbed_arm_is_off_by_about_what_was_asked_for(kind: str) -> None:
    """Six joints, each with shifts of 0.1 mm and turns of 0.1 mrad at up to 2 m: some tenths of a millimetre."""
    robot = arm(kind)
    other = perturbed(robot, length=1e-4, angle=1e-4, seed=3)
    assert other.spec["base"] == robot.spec["base"]
    assert other.spec["tool"] == robot.spec["tool"]
    q = random_poses(robot, 200)
    moved = np.linalg.norm(other.forward(q)[:, :3, 3] - robot.forward(q)[:, :3, 3], axis=1)
    assert 5e-5 < np.sqrt(np.mean(moved**2)) < 1.5e-3
    np.testing.assert_array_equal(other.forward(q), perturbed(robot, length=1e-4, angle=1e-4, seed=3).forward(q))
    np.testing.assert_allclose(perturbed(robot, length=0.0, angle=0.0).forward(q), robot.forward(q), atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"noise": -1.0}, "noise must be a standard deviation of at least 0, got -1.0"),
        ({"noise": math.nan}, "noise must be a standard deviation of at least 0, got nan"),
        ({"repeatability": [1e-4, 0.0]}, r"repeatability must be one number or 6, got shape \(2,\)"),
        ({"noise_rotation": math.inf}, "noise_rotation must be a standard deviation"),
        ({"torque_per_ampere": 0.0}, "torque_per_ampere must be one number or 6, not 0, got 0.0"),
        ({"torque_per_ampere": [1.0, 2.0]}, r"torque_per_ampere must be one number or 6, not 0, got \[1.0, 2.0\]"),
        ({"torque_per_ampere": 1.0, "friction": -1.0}, "friction must be one number or 6, of at least 0, got -1.0"),
    ],
)
def test_invalid_noise_is_refused(options: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidInput, match=message):
        simulate(arm(), np.zeros((1, 6)), **options)


def test_currents_are_the_torques_of_the_weights() -> None:
    """Two arms stretched out: 10 kg at a metre and a payload of 5 at two, by hand; a slide carries forces."""
    link = {"mass_kg": 10.0, "com_mm": [0.0, 0.0, 0.0]}
    joints = [{"type": "revolute", "a_mm": 1000.0, "alpha_deg": 0.0, "d_mm": 0.0, "theta_deg": 0.0, "link": link}] * 2
    spec = {"name": "flat", "kinematics": "dh", "joints": joints, "gravity_m_s2": [0.0, -9.81, 0.0]}
    robot = Robot(spec)
    q = np.zeros((2, 2))
    data = simulate(robot, q, payload=[0.0, 5.0], torque_per_ampere=[100.0, -50.0])
    assert data.current is not None
    first = -9.81 * np.array([10 + 20, 10 + 20 + 5 * 2]) / 100
    second = -9.81 * np.array([10, 10 + 5]) / -50
    np.testing.assert_allclose(data.current, np.column_stack([first, second]), rtol=1e-12)
    assert simulate(robot, q).current is None
    came = Dataset.from_arrays(q, robot=robot, approach=[[1, -1], [-1, 1]])
    rubbed = simulate(robot, came, torque_per_ampere=2.0, friction=3.0).current
    still = simulate(robot, came, torque_per_ampere=2.0).current
    assert rubbed is not None
    np.testing.assert_allclose(rubbed - still, [[1.5, -1.5], [-1.5, 1.5]], rtol=1e-12)
    unknown = simulate(robot, q, torque_per_ampere=2.0, friction=3.0, seed=1).current
    assert unknown is not None
    np.testing.assert_allclose(np.abs(unknown - still), 1.5, rtol=1e-12)


def test_currents_identify_what_a_joint_yields_by_them() -> None:
    """c rad/N m at K N m/A are c K rad/A, found without masses."""
    spec = dict(load_robot("siasun_sr210d").spec)
    yielding = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 4e-7}}
    true = Robot(spec | {"effects": [yielding]})
    data = simulate(true, random_poses(true, 80, seed=1), noise=2e-5, torque_per_ampere=40.0)
    bare = Robot(spec | {"joints": [{key: v for key, v in j.items() if key != "link"} for j in spec["joints"]]})
    found = calibrate(bare, data, effects="geometry,current_compliance@joint2")
    (value,) = [p for p in found.parameters if p.name == "rad_a"]
    assert value.std is not None
    assert value.value == pytest.approx(4e-7 * 40, abs=4 * value.std)
    assert value.std < 0.05 * value.value
