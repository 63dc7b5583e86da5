# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which joint to hold, and which posture to take: against pinocchio, closed forms, and neighbours in the null space."""

import copy
from pathlib import Path

import numpy as np
import pinocchio
import pytest

from fastcal import (
    InvalidInput,
    Robot,
    _core,
    arm_angles,
    choose_posture,
    convert,
    inertia_load,
    inverse_kinematics,
    load_robot,
    random_poses,
)
from fastcal.io.urdf_file import urdf_text


@pytest.mark.parametrize("name", ["lbr_iiwa14", "spray_7dof"])
def test_the_mass_matrix_is_that_of_pinocchio(name: str, tmp_path: Path) -> None:
    spec = copy.deepcopy(load_robot(name).spec)
    for i, joint in enumerate(spec["joints"]):
        joint["link"]["inertia_kg_m2"] = [0.3 + 0.1 * i, 0.5, 0.4, 0.02, -0.03, 0.01 * i]
    robot = Robot(spec)
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text(convert(robot, "urdf").spec), encoding="utf-8")
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    q = random_poses(robot, 20, seed=1)
    M = _core.mass_matrix(robot.core, q)
    for row in range(len(q)):
        upper = np.triu(pinocchio.crba(model, data, q[row]))
        assert np.abs(M[row] - (upper + upper.T - np.diag(np.diag(upper)))).max() < 1e-9 * np.abs(upper).max()


def test_the_inertia_load_of_a_telescope_is_its_closed_form() -> None:
    """A post that turns, and a mass m slid out by x: the post feels m (r + x)^2, the slope is 2 m (r + x)."""
    mass, offset, low, high = 7.0, 0.4, 0.1, 0.9
    joints = [
        {"type": "revolute", "theta_deg": 0, "d_mm": 0, "a_mm": 0, "alpha_deg": 0, "min_deg": -90, "max_deg": 90},
        {"type": "prismatic", "theta_deg": 0, "d_mm": 1e3 * offset, "a_mm": 0, "alpha_deg": 90, "beta_deg": 0}
        | {"min_mm": 1e3 * low, "max_mm": 1e3 * high, "link": {"mass_kg": mass, "com_mm": [0, 0, 0]}},
    ]
    joints[0]["beta_deg"] = 0
    spec = copy.deepcopy(load_robot("lbr_iiwa14").spec) | {"joints": joints, "kinematics": "mdh"}
    spec["tool"] = {"xyz_mm": [0.0, 0.0, 0.0], "rpy_deg": [0.0, 0.0, 0.0]}
    found = inertia_load(Robot(spec), points=64, scrambles=4)
    assert found.load[1] == pytest.approx(mass * (offset + found.position[1]) ** 2, rel=1e-12)
    assert found.slope[1] == pytest.approx(mass * (2 * offset + low + high), rel=1e-9)
    assert found.slope[0] == pytest.approx(0, abs=1e-9)
    assert found.sensitivity[1] == pytest.approx(1, rel=1e-12)
    assert found.sensitivity[0] == pytest.approx(offset + (low + high) / 2, abs=5 * found.sensitivity_error[0] + 1e-3)
    assert found.joint == 2


def test_the_spray_arm_holds_its_telescope_whatever_the_seed() -> None:
    found = [inertia_load(load_robot("spray_7dof"), points=64, scrambles=4, seed=seed) for seed in range(3)]
    assert {result.joint for result in found} == {6}
    assert all(result.is_singled_out for result in found)
    for result in found[1:]:
        apart = np.abs(result.index - found[0].index)
        assert (apart <= 6 * np.hypot(result.index_error, found[0].index_error) + 1e-9).all()


@pytest.mark.parametrize("prefer", ["limits", "manipulability", "deflection", "motion", "arm_angle"])
def test_no_posture_nearby_is_liked_better(prefer: str) -> None:
    spec = copy.deepcopy(load_robot("lbr_iiwa14").spec)
    spec["effects"] = [
        {"effect": "joint_compliance", "owner": f"joint{i}", "parameters": {"compliance_rad_nm": 1e-5}}
        for i in range(1, 8)
    ]
    robot, bare = Robot(spec), load_robot("lbr_iiwa14")
    middle = robot.limits.mean(axis=1)
    q = middle + 0.4 * (random_poses(bare, 12, seed=8) - middle)
    targets = bare.forward(q)
    best = choose_posture(robot, targets, q, prefer=prefer, arm_angle=0.4)
    assert best.reached.all()
    assert np.abs(robot.forward(best.q) - targets).max() < 2e-9

    def cost(at: np.ndarray) -> np.ndarray:
        if prefer == "limits":
            return np.asarray(((2 * (at - middle) / np.ptp(robot.limits, axis=1)) ** 2).sum(axis=1))
        if prefer == "motion":
            return np.asarray(((at - q) ** 2).sum(axis=1))
        if prefer == "arm_angle":
            return np.abs(arm_angles(bare, at) - 0.4)
        if prefer == "deflection":
            return np.asarray(np.linalg.norm((robot.forward(at) - bare.forward(at))[:, :3, 3], axis=1))
        J = bare.joint_jacobian(at)
        J[:, :3] /= bare.reach
        return np.asarray(-np.linalg.det(J @ J.transpose(0, 2, 1)))

    at_best = cost(best.q)
    for shift in (-0.02, 0.02):
        push = best.q.copy()
        push[:, 2] += shift
        other = inverse_kinematics(robot, targets, push, restarts=0)
        free = ((np.abs(best.q - robot.limits[:, :1].T) > 1e-6) & (np.abs(best.q - robot.limits[:, 1:].T) > 1e-6)).all(
            1
        )
        moved = other.reached & free & (np.abs(other.q - best.q).max(axis=1) > 1e-3)
        assert moved.sum() >= 8
        assert (cost(other.q)[moved] >= at_best[moved] - 1e-6 * np.abs(at_best[moved]) - 1e-12).all()


def test_what_cannot_be_chosen_is_refused() -> None:
    with pytest.raises(InvalidInput, match="ur5 has 6 joints: a pose leaves it no posture to choose"):
        choose_posture(load_robot("ur5"), np.eye(4))
    with pytest.raises(InvalidInput, match=r"prefer takes limits, .* got 'speed'"):
        choose_posture(load_robot("lbr_iiwa14"), np.eye(4), prefer="speed")
    with pytest.raises(InvalidInput, match="spray_7dof has other joints"):
        arm_angles(load_robot("spray_7dof"), np.zeros(7))
    with pytest.raises(InvalidInput, match="points must be a power of 2, got 100"):
        inertia_load(load_robot("spray_7dof"), points=100)
