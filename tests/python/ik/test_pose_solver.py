# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One pose at a time is a row of the batch, with and without effects."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import fastcal
from fastcal.effects import registered

PAYLOAD = 8.0


def arm(kind: str) -> tuple[fastcal.Robot, dict[str, Any]]:
    """An arm and the conditions of its calls."""
    robot = fastcal.load_robot("staubli_rx160l")
    if kind == "bare":
        return robot, {}
    compliance = {"parameters": {"compliance_rad_nm": {"value": 3e-6}}}
    effects = [{"effect": "joint_compliance", "owner": f"joint{j}", **compliance} for j in (2, 3)]
    return fastcal.Robot(robot.spec | {"effects": effects}), {"payload": PAYLOAD}


@pytest.mark.parametrize("kind", ["bare", "compliant"])
def test_a_pose_is_a_row_of_the_batch(kind: str) -> None:
    robot, conditions = arm(kind)
    q = fastcal.random_poses(robot, 40, seed=1)
    seeds = q + np.random.default_rng(2).normal(0, 0.2, q.shape)
    targets = robot.forward(q, **conditions)
    targets[3, :3, 3] += 10  # out of reach
    targets[4, 0, 0] = np.nan
    solver = fastcal.PoseSolver(robot, **conditions)
    for row in range(len(q)):
        np.testing.assert_allclose(solver.forward(q[row]), robot.forward(q[row], **conditions)[0], atol=1e-14)
        alone = fastcal.inverse_kinematics(robot, targets[row], seeds[row], **conditions)
        found, status = solver.inverse(targets[row], seeds[row])
        assert status == alone.status[0]
        np.testing.assert_array_equal(found, alone.q[0])
        if status == "reached":
            np.testing.assert_allclose(robot.forward(found, **conditions)[0], targets[row], atol=3e-9)
    assert [solver.inverse(targets[row], seeds[row])[1] for row in (3, 4)] == ["unreachable", "bad_target"]


def test_options_are_those_of_the_batch() -> None:
    robot, _ = arm("bare")
    q = np.full(6, 0.3)
    target = robot.forward(q)[0]
    tight = np.tile([-0.1, 0.1], (6, 1))
    assert fastcal.PoseSolver(robot, limits=tight).inverse(target, np.zeros(6))[1] == "limit"
    found, _ = fastcal.PoseSolver(robot, hold=[2], restarts=0).inverse(target, np.zeros(6))
    assert found[1] == 0.0


def test_a_model_that_looks_at_its_own_command_goes_the_way_of_the_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registered, "_effects", {})

    def cable(states: registered.States) -> NDArray[np.float64]:
        xi = np.zeros((len(states.q), 6, 1))
        xi[:, 5, 0] = states.q[:, 3] * states.q[:, 5]
        return xi

    fastcal.register_effect("cable", owners=["joint4"], parameters=[("pull", "rad", 1e-4, "a turn")], basis=cable)
    robot = fastcal.load_robot("ur5")
    entry = {"effect": "cable", "owner": "joint4", "parameters": {"pull_rad": {"value": 2e-3}}}
    pulled = fastcal.Robot(robot.spec | {"effects": [entry]})
    q = np.array([0.2, -1.0, 1.2, -0.4, 0.9, 0.7])
    solver = fastcal.PoseSolver(pulled)
    target = solver.forward(q)
    np.testing.assert_array_equal(target, pulled.forward(q)[0])
    assert np.linalg.norm(target - robot.forward(q)[0]) > 1e-5
    found, status = solver.inverse(target, q + 0.05)
    assert status == "reached"
    np.testing.assert_allclose(pulled.forward(found)[0], target, atol=1e-8)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.inverse(np.eye(3), np.zeros(6)), "target must hold 16 numbers, got 9"),
        (lambda s: s.inverse(np.eye(4), np.zeros(5)), "seed must hold 6 numbers, got 5"),
        (lambda s: s.forward(np.zeros(7)), "q must hold 6 numbers, got 7"),
        (lambda s: fastcal.PoseSolver(s.model, limits=np.zeros((5, 2))), r"limits must be numbers of shape \(6, 2\)"),
        (lambda s: fastcal.PoseSolver(s.model, tolerance_m=0), "tolerance_m must be above 0"),
        (lambda s: fastcal.PoseSolver(s.model, hold=[7]), "hold takes numbers of joints from 1 to 6"),
    ],
)
def test_invalid_input_is_refused(call: Any, message: str) -> None:
    with pytest.raises(fastcal.InvalidInput, match=message):
        call(fastcal.PoseSolver(fastcal.load_robot("ur5")))
