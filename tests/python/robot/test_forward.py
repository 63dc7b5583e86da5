# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Forward kinematics of every shipped arm in all four kinds of file, against numpy written from the definitions.

The C++ tests compare random chains of each kind with KDL; here the road from the file's own numbers is tested.
"""

import copy
import gc
import pickle
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Dataset, InvalidInput, _core, inverse_kinematics, random_poses
from fastcal.conversion import convert
from fastcal.io.robot_file import load_robot
from fastcal.robot.robot import Robot, Spec
from fastcal.robots import serial

KINDS = ("dh", "mdh", "poe", "urdf")
POSES = 10_000

Array = NDArray[np.float64]


def turn(axis: Array | list[float], angle: Array) -> Array:
    """(N, 4, 4) turns by angle (N,) about an axis through the origin: Rodrigues."""
    x, y, z = np.asarray(axis, dtype=float)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    T = np.tile(np.eye(4), (len(angle), 1, 1))
    T[:, :3, :3] += np.sin(angle)[:, None, None] * K + (1 - np.cos(angle))[:, None, None] * (K @ K)
    return T


def shift(vector: Array | list[float], length: Array) -> Array:
    """(N, 4, 4) shifts by length (N,) times a vector."""
    T = np.tile(np.eye(4), (len(length), 1, 1))
    T[:, :3, 3] = length[:, None] * np.asarray(vector, dtype=float)
    return T


def fixed(frame: Spec) -> Array:
    """(4, 4) of {xyz_mm, rpy_deg}: R = Rz Ry Rx."""
    one = np.ones(1)
    roll, pitch, yaw = np.radians(frame["rpy_deg"])
    R = turn([0, 0, 1], yaw * one) @ turn([0, 1, 0], pitch * one) @ turn([1, 0, 0], roll * one)
    return np.asarray((shift(np.asarray(frame["xyz_mm"]) / 1000, one) @ R)[0])


def expected(spec: Spec, q: Array) -> Array:
    """(N, 4, 4) of the tool in the measuring frame, as formats.md says: q (N, n) in rad or m."""
    one = np.ones(len(q))
    x, y, z = np.eye(3)
    T = fixed(spec["base"]) @ np.tile(np.eye(4), (len(q), 1, 1))
    for i, joint in enumerate(spec["joints"]):
        revolute = joint["type"] == "revolute"
        kind = spec["kinematics"]
        if kind in ("dh", "mdh"):
            theta, alpha, beta = np.radians([joint["theta_deg"], joint["alpha_deg"], joint["beta_deg"]])
            d, a = joint["d_mm"] / 1000, joint["a_mm"] / 1000
            along = turn(z, theta + revolute * q[:, i]) @ shift(z, d + (not revolute) * q[:, i])
            across = shift(x, a * one) @ turn(x, alpha * one)
            T = T @ (along @ across if kind == "dh" else across @ along) @ turn(y, beta * one)
        elif kind == "poe":
            if revolute:
                omega = np.asarray(joint["omega"], dtype=float)
                at = joint["point_mm"] if "point_mm" in joint else np.cross(omega, joint["v_mm"])
                point = np.asarray(at, dtype=float) / 1000
                angle = q[:, i] + np.radians(joint.get("theta_deg", 0.0))
                T = T @ shift(point, one) @ turn(omega, angle) @ shift(-point, one)
            else:
                T = T @ shift(joint["v_mm"] if "v_mm" in joint else joint["v"], q[:, i] + joint.get("d_mm", 0.0) / 1000)
        else:
            move = turn(joint["axis"], q[:, i]) if revolute else shift(joint["axis"], q[:, i])
            T = T @ fixed(joint["origin"]) @ move
    end = "home" if spec["kinematics"] == "poe" else "flange"
    return np.asarray(T @ (fixed(spec[end]) if end in spec else np.eye(4)) @ fixed(spec["tool"]))


def postures(robot: Robot, count: int, seed: int) -> Array:
    low, high = np.clip(robot.limits, -np.pi, np.pi).T
    return np.random.default_rng(seed).uniform(low, high, (count, robot.joint_count))


def placed(name: str, kind: str) -> Robot:
    """A shipped arm as another kind of file, standing askew under a tool of its own."""
    spec = convert(load_robot(name), kind).spec
    spec["base"] = {"xyz_mm": [1200.0, -350.0, 80.0], "rpy_deg": [12.0, -34.0, 156.0]}
    spec["tool"] = {"xyz_mm": [31.0, -7.0, 160.0], "rpy_deg": [-20.0, 45.0, 70.0]}
    return Robot(spec)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", serial())
def test_forward_kinematics_is_that_of_the_files_definition(name: str, kind: str) -> None:
    robot = placed(name, kind)
    q = postures(robot, POSES, 1)
    assert np.abs(robot.forward(q) - expected(robot.spec, q)).max() < 1e-12


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", serial())
def test_every_kind_of_file_is_the_same_arm(name: str, kind: str) -> None:
    robot = load_robot(name)
    other = Robot(convert(robot, kind).spec)
    q = postures(robot, POSES, 2)
    assert np.abs(other.forward(q) - expected(robot.spec, q)).max() < 1e-12


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", serial())
def test_every_jacobian_column_is_the_derivative(name: str, kind: str) -> None:
    robot = placed(name, kind)
    model = robot.error_model
    rng = np.random.default_rng(3)
    theta = model.start + rng.normal(0, 0.01, len(model.start))
    samples = _core.Samples(postures(robot, 50, 3))
    J = model.parameter_jacobian(samples, theta, 6)
    R = model.predict(samples, theta)[:, :3, :3]
    h = 1e-3
    for k, column in enumerate(robot.parameter_names):
        moved = [model.predict(samples, theta + step * h * np.eye(len(theta))[k])[:, :3] for step in (1, -1, 2, -2)]
        slope = (8 * (moved[0] - moved[1]) - (moved[2] - moved[3])) / (12 * h)
        W = slope[:, :, :3] @ R.transpose(0, 2, 1)
        w = np.column_stack([W[:, 2, 1] - W[:, 1, 2], W[:, 0, 2] - W[:, 2, 0], W[:, 1, 0] - W[:, 0, 1]]) / 2
        wanted = np.hstack([slope[:, :, 3], w])
        error = np.linalg.norm(J[:, :, k] - wanted, axis=1)
        assert np.all(error <= 1e-7 * np.linalg.norm(wanted, axis=1) + 1e-11), column


def test_batches_into_a_given_array_and_over_threads_are_the_same_bits() -> None:
    robot = placed("spray_7dof", "mdh")
    q = postures(robot, 1000, 4)
    poses, J = robot.forward(q), robot.parameter_jacobian(q)
    out, out_J = np.empty_like(poses), np.empty_like(J)
    assert robot.forward(q, threads=3, out=out) is out
    assert robot.parameter_jacobian(q, threads=3, out=out_J) is out_J
    np.testing.assert_array_equal(out, poses)
    np.testing.assert_array_equal(out_J, J)
    np.testing.assert_array_equal(robot.forward(q[17])[0], poses[17])
    np.testing.assert_array_equal(robot.forward(np.asfortranarray(q)), poses)
    np.testing.assert_array_equal(robot.forward(q[::2]), poses[::2])


def test_a_robot_goes_to_another_process_as_its_file() -> None:
    wave = {"order": 2.0, "amplitude_rad": 3e-4, "phase_rad": 0.5}
    entry = {"effect": "gear_harmonic", "owner": "joint2", "parameters": wave}
    robot = Robot(dict(load_robot("ur10").spec) | {"effects": [entry]})
    q = np.random.default_rng(0).uniform(-1, 1, (5, 6))
    again = pickle.loads(pickle.dumps(robot))  # noqa: S301 - what was written a moment ago
    assert not {"spec", "core", "error_model"} & set(vars(again))  # a thousand of a fleet cost nothing until asked for
    np.testing.assert_array_equal(again.forward(q), robot.forward(q))
    for other in (again, copy.copy(robot), copy.deepcopy(robot)):
        assert other.spec == robot.spec
        other.spec["joints"][0]["d_mm"] = 1.0  # its own
        assert robot.spec["joints"][0]["d_mm"] != 1.0


def test_results_larger_than_the_caches_are_those_of_parts() -> None:
    """They are written another way, to whatever address numpy gave."""
    robot = load_robot("ur5")
    rows = 33_333  # the last chunk is not full; 4.3 and 34 MB
    q = np.random.default_rng(1).uniform(-3, 3, (rows, 6))
    poses = np.empty(16 * rows + 1)[1:].reshape(rows, 4, 4)  # 8 bytes off any line
    robot.forward(q, out=poses)
    J = robot.parameter_jacobian(q)
    for part in (slice(0, 120), slice(119, 3000), slice(30_000, rows)):
        np.testing.assert_array_equal(poses[part], robot.forward(q[part]))
        np.testing.assert_array_equal(J[part], robot.parameter_jacobian(q[part]))


def test_joint_positions_are_read_where_they_lie_and_kept_as_long_as_they_are_read() -> None:
    robot = load_robot("ur5")
    q = random_poses(robot, 40, seed=2)
    expected = robot.forward(q)
    samples = robot.conditions(q)
    held = sys.getrefcount(q)
    again = robot.conditions(q)
    assert sys.getrefcount(q) == held + 1
    del again
    assert sys.getrefcount(q) == held
    other = robot.conditions(q[::-1])  # not in C order: a copy, whose owner the samples are
    gc.collect()
    model = robot.error_model
    assert np.array_equal(model.predict(samples, model.start), expected)
    assert np.array_equal(model.predict(other, model.start), expected[::-1])


def test_a_position_that_is_not_finite_is_refused_wherever_it_is() -> None:
    robot = load_robot("ur5")
    for row in (0, 118, 399):
        q = random_poses(robot, 400, seed=2)
        q[row, 5] = np.inf
        for call in (robot.forward, robot.parameter_jacobian):
            with pytest.raises(InvalidInput, match="q must be finite"):
                call(q)


RAGGED = "in rows of one length"


@pytest.mark.parametrize(
    ("value", "sentence"),
    [(np.zeros((2, 6), complex), "complex128"), ("home", "<U4"), (np.zeros((2, 6), bool), "bool"), ([[0], []], RAGGED)],
)
def test_what_is_no_real_number_is_refused_and_never_cast(value: Any, sentence: str) -> None:
    """A cast would drop imaginary parts, read text as numbers and truth values as 0 and 1."""
    robot = load_robot("ur5")
    q, T = np.zeros((2, 6)), np.tile(np.eye(4), (2, 1, 1))
    calls: dict[str, Callable[[], object]] = {
        "q": lambda: robot.forward(value),
        "seed": lambda: inverse_kinematics(robot, T, seed=value),
        "targets": lambda: inverse_kinematics(robot, value),
        "payload": lambda: robot.forward(q, payload=value),
    }
    for name, call in calls.items():
        with pytest.raises(InvalidInput, match=f"{name} must hold real numbers.* {sentence}"):
            call()
    with pytest.raises(InvalidInput, match="q must hold real numbers"):
        Dataset.from_arrays(value)
    with pytest.raises(InvalidInput, match=r"payload must be one number, or have shape \(2,\), got \(3,\)"):
        robot.forward(q, payload=[1.0, 2.0, 3.0])
    np.testing.assert_array_equal(robot.forward(q.astype(object)), robot.forward(q))
