# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Inverse kinematics against the forward model, whose own oracles are elsewhere; what can't be reached says so."""

import copy
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal import InvalidInput, Robot, inverse_kinematics, load_robot, random_poses
from fastcal.robots import serial

Array = NDArray[np.float64]


def turned_by(R: Array) -> Array:
    """Angles (N,) of rotations (N, 3, 3); exact near 0."""
    axis = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    return np.asarray(np.arctan2(np.linalg.norm(axis, axis=1) / 2, (np.trace(R, axis1=1, axis2=2) - 1) / 2))


def left(model: Robot, q: Array, targets: Array, **conditions: Any) -> tuple[float, float]:
    """The largest distance [m] and angle [rad] between where a model stands and its targets."""
    T = model.forward(q, **conditions)
    apart = np.linalg.norm(T[:, :3, 3] - targets[:, :3, 3], axis=1).max()
    return float(apart), float(turned_by(T[:, :3, :3].transpose(0, 2, 1) @ targets[:, :3, :3]).max())


def within(model: Robot, q: Array) -> bool:
    return bool(((q >= model.limits[:, 0]) & (q <= model.limits[:, 1])).all())


def compliant(name: str) -> Robot:
    """A shipped arm that gives way by millimetres in every joint, and is built a little wrong."""
    spec = copy.deepcopy(fastcal.perturbed(load_robot(name), seed=3).spec)
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": f"joint{i}", "parameters": {"compliance_rad_nm": c}}
        for i, c in enumerate([2e-7, 8e-7, 9e-7, 2e-6, 3e-6, 4e-6], start=1)
    ]
    return Robot(spec)


def least_singular_value(robot: Robot, q: Array) -> Array:
    """(N,) of the Jacobian, lengths over the reach."""
    J = robot.joint_jacobian(q)
    J[:, :3] /= robot.reach
    J[:, :, [kind == "prismatic" for kind in robot.joint_types]] *= robot.reach
    return np.asarray(np.linalg.svd(J, compute_uv=False)[:, -1])


@pytest.mark.parametrize("name", serial())
def test_what_an_arm_reaches_is_found_within_its_limits(name: str) -> None:
    robot = load_robot(name)
    targets = robot.forward(random_poses(robot, 300, seed=1))
    found = inverse_kinematics(robot, targets, random_poses(robot, 300, seed=2))
    assert found.reached.all()
    assert within(robot, found.q)
    assert max(left(robot, found.q, targets)) < 2e-9


@pytest.mark.parametrize("name", ["staubli_rx160l", "siasun_sr210d"])
def test_an_arm_that_gives_way_is_commanded_where_it_will_stand(name: str) -> None:
    nominal, model = load_robot(name), compliant(name)
    q = random_poses(nominal, 300, seed=1) * 0.95
    q = q[least_singular_value(nominal, q) > 0.02]
    assert len(q) > 150
    targets = nominal.forward(q)
    found = inverse_kinematics(model, targets, q, payload=5.0)
    assert set(found.status) == {"reached"}
    assert max(left(model, found.q, targets, payload=5.0)) < 2e-9
    assert np.abs(model.forward(q, payload=5.0) - targets)[:, :3, 3].max() > 1e-3


@pytest.mark.parametrize("name", ["spray_7dof", "ur10"])
def test_the_joint_jacobian_is_the_derivative(name: str) -> None:
    robot, step = load_robot(name), 1e-6
    q = random_poses(robot, 20, seed=1)
    J = robot.joint_jacobian(q)
    for i in range(robot.joint_count):
        e = step * np.eye(robot.joint_count)[i]
        ahead, behind = robot.forward(q + e), robot.forward(q - e)
        turn = (ahead - behind)[:, :3, :3] @ robot.forward(q)[:, :3, :3].transpose(0, 2, 1) / (2 * step)
        assert np.abs((ahead - behind)[:, :3, 3] / (2 * step) - J[:, :3, i]).max() < 1e-8
        assert np.abs(turn[:, [2, 0, 1], [1, 2, 0]] - J[:, 3:, i]).max() < 1e-8


def test_the_result_does_not_depend_on_threads() -> None:
    robot = load_robot("lbr_iiwa14")
    targets = robot.forward(random_poses(robot, 400, seed=1))
    one, two = (inverse_kinematics(robot, targets, threads=threads) for threads in (1, 2))
    assert (one.q == two.q).all()
    assert (one.iterations == two.iterations).all()


def test_every_kind_of_target_gets_its_status_and_a_sentence() -> None:
    robot = load_robot("staubli_rx160l")
    inside = robot.forward([0.3, 0.4, 0.5, 0.6, 0.7, 0.8])[0]
    straight = robot.forward([0.3, 0.4, 0.5, 0.6, 0.0, 0.8])[0]
    far = inside.copy()
    far[:3, 3] *= 10
    missing = inside.copy()
    missing[0, 3] = np.nan
    mirror = inside.copy()
    mirror[:3, :3] *= -1
    found = inverse_kinematics(robot, [inside, straight, far, missing, mirror], [0.3, 0.4, 0.5, 0.6, 0.05, 0.8])
    assert found.status.tolist() == ["reached", "singular", "unreachable", "bad_target", "bad_target"]
    assert found.reached.tolist() == [True, True, False, False, False]
    assert np.isfinite(found.q).all()
    assert np.isnan(found.position_error[3:]).all()
    assert len({found.message(row) for row in range(4)}) == 4
    assert f"{found.position_error[2] * 1000:.3g} mm" in found.message(2)


@pytest.mark.parametrize("name", ["staubli_rx160l", "ur5"])  # a wrist that meets in a point, and one that does not
@pytest.mark.parametrize("q5", [1e-8, -1e-6])
def test_next_to_a_singular_wrist_every_target_is_reached(name: str, q5: float) -> None:
    """There the tool turns in one direction by no more than q5, and which way depends on where the wrist's axes point:
    on an arm like the UR5 the posture that has it may be half a turn away."""
    robot = load_robot(name)
    q = random_poses(robot, 1000, seed=3)
    q[:, 4] = q5
    assert least_singular_value(robot, q).max() < 1e-5
    targets = robot.forward(q)
    for seeds in (q + np.random.default_rng(4).normal(0, 0.02, q.shape), random_poses(robot, 1000, seed=5)):
        found = inverse_kinematics(robot, targets, seeds)
        assert found.reached.all()
        assert within(robot, found.q)
        assert max(left(robot, found.q, targets)) < 1.5e-9
    near = inverse_kinematics(robot, targets, q + np.random.default_rng(4).normal(0, 0.02, q.shape), restarts=0)
    assert near.reached.mean() > 0.99
    assert near.iterations[near.reached].mean() < 10  # 4 far from singular postures; the restarts cost a thousand


def test_a_target_beyond_the_limits_is_distinguished_from_one_beyond_the_arm() -> None:
    robot = load_robot("staubli_rx160l")
    q = np.array([0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
    target = robot.forward(q)[0]
    box = np.stack([q - 0.2, q + 0.2], axis=1)
    box[2] = 0.55, 0.6
    found = inverse_kinematics(robot, target, q, limits=box)
    assert found.status[0] == "limit"
    assert ((found.q >= box[:, 0]) & (found.q <= box[:, 1])).all()
    assert left(robot, found.q, target[None])[0] == pytest.approx(found.position_error[0], abs=1e-12)
    assert "limits" in found.message(0)


def test_the_nearest_pose_of_a_target_out_of_reach_is_the_nearest() -> None:
    """An arm of two lengths in a plane and a point far off: it stretches towards it."""
    joint = {"type": "revolute", "theta_deg": 0, "d_mm": 0, "a_mm": 500, "alpha_deg": 0, "beta_deg": 0}
    spec = copy.deepcopy(load_robot("ur5").spec) | {"joints": [dict(joint), dict(joint)], "kinematics": "dh"}
    spec["tool"] = {"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]}
    robot = Robot(spec)
    target = robot.forward([0.7, 0.0])[0]
    target[:3, 3] *= 2
    found = inverse_kinematics(robot, target, [0.5, 0.4])
    assert found.status[0] == "unreachable"
    assert found.position_error[0] == pytest.approx(1.0, abs=1e-9)
    assert np.abs(found.q - [0.7, 0.0]).max() < 1e-6


def test_along_a_path_no_joint_jumps() -> None:
    robot = load_robot("spray_7dof")
    a, b = random_poses(robot, 2, seed=4)
    targets = robot.forward(a + np.linspace(0, 0.3, 80)[:, None] * (b - a))
    found = inverse_kinematics(robot, targets, a, along_path=True)
    assert set(found.status) == {"reached"}
    assert np.abs(np.diff(found.q, axis=0)).max() < 5 * 0.3 * np.abs(b - a).max() / 80


def test_a_joint_that_is_held_stays() -> None:
    robot = load_robot("spray_7dof")
    q = random_poses(robot, 200, seed=6)
    seed = random_poses(robot, 200, seed=7)
    seed[:, 5] = q[:, 5]
    found = inverse_kinematics(robot, robot.forward(q), seed, hold=[6])
    assert (found.q[:, 5] == q[:, 5]).all()
    assert found.reached.all()
    assert max(left(robot, found.q, robot.forward(q))) < 2e-9


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"targets": np.eye(3)}, r"targets must have shape \(N, 4, 4\), got \(3, 3\)"),
        ({"seed": [0.0]}, r"seed must have shape \(6,\) or \(1, 6\), got \(1,\)"),
        ({"seed": [np.nan] * 6}, "seed must be finite"),
        ({"limits": [[0, 1]]}, r"limits must be numbers of shape \(6, 2\), got \(1, 2\)"),
        ({"limits": [[1, 0]] * 6}, "a lower limit must not lie above the upper one"),
        ({"tolerance_m": 0}, "tolerance_m must be above 0, got 0"),
        ({"hold": [0]}, r"hold takes numbers of joints from 1 to 6, got \[0\]"),
        ({"restarts": -1}, "restarts must be at least 0, got -1"),
        ({"speed": 1}, "no condition is called 'speed'"),
    ],
)
def test_invalid_input_is_refused(change: dict[str, Any], words: str) -> None:
    robot = load_robot("ur5")
    with pytest.raises(InvalidInput, match=words):
        inverse_kinematics(robot, **({"targets": robot.forward(np.zeros(6))} | change))


def test_a_seed_that_reaches_is_found_from_another_station() -> None:
    """Where the instrument stood elsewhere, the arm without its effects is a metre away and out of its limits."""
    robot = load_robot("ur10")
    there = {"station2_x_mm": 950.0, "station2_y_mm": -450.0, "station2_rz_rad": 0.3}
    effect = {"effect": "station_offset", "owner": "base", "stations": ["A", "B"], "parameters": there}
    seen = Robot(robot.spec | {"effects": [effect]})
    q = random_poses(seen, 60, seed=3)
    for station in ("A", "B"):
        known = {"station": np.full(60, station)}
        found = inverse_kinematics(seen, seen.forward(q, **known), seed=q, restarts=0, **known)
        assert found.reached.all()
        np.testing.assert_allclose(found.q, q, atol=1e-6)
