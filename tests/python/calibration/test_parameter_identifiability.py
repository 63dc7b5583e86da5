# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Redundant errors: the spray-painting paper's five rules, its counts, and combinations that hold on other postures."""

import copy
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.errors import InvalidInput
from fastcal.io.robot_schema import check_spec
from fastcal.robot.robot import Robot

ROW = 3  # i of the rules: rows i - 1 and i stand here in the file, and row i + 1 holds a_i


def arm(prismatic: bool = False, **row: float) -> Robot:
    """Six MDH rows that have nothing special but what row i is given; base and tool are nothing special either."""
    random = np.random.default_rng(7)
    joints: list[dict[str, Any]] = []
    for i in range(1, 7):
        slides = prismatic and i == ROW
        joint: dict[str, Any] = {"type": "prismatic" if slides else "revolute"}
        joint |= {"min_mm": 0, "max_mm": 500} if slides else {"min_deg": -150, "max_deg": 150}
        joint |= dict(zip(("d_mm", "a_mm"), random.uniform(100, 500, 2).tolist(), strict=True))
        joint |= dict(zip(("theta_deg", "alpha_deg"), random.uniform(20, 80, 2).tolist(), strict=True))
        joints.append(joint | (row if i == ROW else {}))
    frame = {"xyz_mm": [300, 200, 100], "rpy_deg": [10, 20, 30]}
    return Robot(check_spec({"name": "arm", "kinematics": "mdh", "joints": joints, "base": frame, "tool": frame}))


def pairs(robot: Robot, q: Any = None, *, kinds: str = "alpha a theta d", beta: bool = False) -> dict[str, set[str]]:
    """Held parameters of rows i - 1 to i + 1 and what does the same, all other rows, base and tool known."""
    names = [f"joint{i} {kind}" for i in (ROW - 1, ROW, ROW + 1) for kind in kinds.split()]
    names += [f"joint{ROW - 1} beta"] if beta else []
    found = fastcal.redundancy(robot, q, measured="pose", parameters=names)
    assert {p.kind for p in found.parameters} <= {"independent", "correlated", "without_effect"}
    return {p.name: set(p.combination) for p in found.parameters if p.held}


def test_rule_1_neighbouring_axes_at_an_angle_have_no_redundant_errors() -> None:
    assert pairs(arm()) == {}


def test_rule_2_parallel_axes_share_d_and_beta_enters() -> None:
    """The beta that tilts axis i against axis i - 1 stands at the end of row i - 1."""
    robot = arm(alpha_deg=0)
    assert pairs(robot) == {f"joint{ROW - 1} d": {f"joint{ROW} d"}}
    assert set(pairs(robot, beta=True)) == {f"joint{ROW - 1} d"}  # beta is one of those that can be told


def test_beta_is_not_identifiable_between_axes_at_an_angle() -> None:
    betas = {f"joint{i} beta" for i in range(1, 7)}
    assert betas <= set(fastcal.redundancy(arm(), measured="pose").held)
    parallel = set(fastcal.redundancy(arm(alpha_deg=0), measured="pose").held)
    assert betas - parallel == {f"joint{ROW - 1} beta"}


def test_rule_3_one_axis_twice_shares_d_and_theta() -> None:
    assert pairs(arm(alpha_deg=0, a_mm=0)) == {
        f"joint{ROW - 1} d": {f"joint{ROW} d"},
        f"joint{ROW - 1} theta": {f"joint{ROW} theta"},
    }


def test_rule_4_a_slider_that_does_not_turn_shares_a() -> None:
    slider = arm(prismatic=True, theta_deg=0)
    assert pairs(slider, kinds="alpha a") == {f"joint{ROW} a": {f"joint{ROW + 1} a"}}
    # Beside the rule: where a slider's axis lies does nothing, so its d is what the neighbours' shifts make of it.
    assert set(pairs(slider)) == {f"joint{ROW} a", f"joint{ROW} d"}


def test_rule_5_a_slider_at_nothing_shares_a_and_alpha() -> None:
    robot = arm(prismatic=True, theta_deg=0, d_mm=0)
    q = np.random.default_rng(1).uniform(*robot.limits.T, (200, 6))
    q[:, ROW - 1] = 0.0
    assert pairs(robot, q, kinds="alpha a") == {
        f"joint{ROW} a": {f"joint{ROW + 1} a"},
        f"joint{ROW} alpha": {f"joint{ROW + 1} alpha"},
    }


@pytest.mark.parametrize(("measured", "rank"), [("pose", 30), ("position", 27)])
def test_the_spray_robot_has_30_identifiable_errors_and_27_from_points(measured: str, rank: int) -> None:
    robot = fastcal.load_robot("spray_7dof")
    found = fastcal.redundancy(robot, measured=measured, keep=["base"])
    assert (found.rank, len(found.kept), len(found.parameters)) == (rank, rank, 47)
    assert sum(name.startswith("base") for name in found.kept) == 6
    if measured == "pose":
        assert sum(not name.startswith("base") for name in found.kept) == 24


def test_a_combination_does_what_its_held_error_does_on_other_postures() -> None:
    robot = fastcal.load_robot("spray_7dof")
    found = fastcal.redundancy(robot, measured="position")
    q = fastcal.random_poses(robot, 20, seed=5)
    J = dict(zip(robot.parameter_names, np.moveaxis(robot.parameter_jacobian(q), 2, 0), strict=True))
    held = [p for p in found.parameters if p.held]
    assert len(held) == 47 - 27
    for p in held:
        assert (p.kind == "without_effect") == (not p.combination)
        combined = sum((c * J[name] for name, c in p.combination.items()), np.zeros_like(J[p.name]))
        assert np.abs(combined - J[p.name]).max() < 1e-8
        for name in p.combination:
            assert found[name].kind == "correlated"
            assert p.name in found[name].partners
    assert {p.name for p in held if p.kind == "without_effect"} == {"tool rx", "tool ry", "tool rz"}
    kept = np.concatenate([J[name].reshape(-1, 1) for name in found.kept], axis=1)
    assert np.linalg.matrix_rank(kept) == 27


def test_independent_errors_take_no_part_in_any_null_direction() -> None:
    robot = fastcal.load_robot("spray_7dof")
    found = fastcal.redundancy(robot, measured="pose")
    J = robot.parameter_jacobian(fastcal.random_poses(robot, 100, seed=9), rows=6).reshape(600, -1)
    J = np.linalg.qr(J, mode="r")
    for i, p in enumerate(found.parameters):
        alone = np.linalg.matrix_rank(np.delete(J, i, axis=1)) == found.rank - 1
        assert alone == (p.kind == "independent"), p.name


def test_deflection_and_other_effects_are_left_out() -> None:
    robot = fastcal.load_robot("spray_7dof")
    spec = copy.deepcopy(robot.spec)
    spec["effects"] = [{"effect": "beam_gravity", "owner": "structure", "parameters": {"scale": 1.0}}]
    assert str(fastcal.redundancy(Robot(spec))) == str(fastcal.redundancy(robot))
    assert "joint6 a: held, does what +1 joint7 a does" in str(fastcal.redundancy(robot))


def test_invalid_input_is_refused() -> None:
    robot = fastcal.load_robot("ur5")
    with pytest.raises(InvalidInput, match="measured must be one of position, pose, got 'points'"):
        fastcal.redundancy(robot, measured="points")
    with pytest.raises(InvalidInput, match="there is no parameter 'joint9 a'"):
        fastcal.redundancy(robot, parameters=["joint9 a"])
