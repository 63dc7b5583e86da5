# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Slack in a pin of a closed loop: where the load presses it, by differences, found again, and named."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fastcal import _core, calibrate, diagnose, load_robot, perturbed, predict, random_poses, simulate
from fastcal.effects.entries import effect_owners
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

GAP = 4e-4  # [m]
NOISE = 3e-5


def with_slack(robot: Robot, joint: str, gap: float = GAP) -> Robot:
    return robot.with_(effects=[{"effect": "pin_slack", "owner": joint, "parameters": {"gap_mm": 1e3 * gap}}])


def payloads(count: int) -> np.ndarray:
    return np.tile([0.0, 60.0, 120.0], count)[:count]


def measured(joint: str, seed: int, count: int = 90) -> Dataset:
    nominal = load_robot("palletizer")
    real = with_slack(perturbed(nominal, seed=seed), joint)
    return simulate(
        real, random_poses(real, count, seed=seed + 10), noise=NOISE, seed=seed + 20, payload=payloads(count)
    )


def test_only_pins_that_turn_have_it() -> None:
    assert effect_owners("pin_slack", load_robot("palletizer").core) == ["joint4", "joint5", "joint6"]
    assert effect_owners("pin_slack", load_robot("ur5").core) == []
    with pytest.raises(InvalidInput, match="a passive joint that turns, got 'joint1'"):
        _core.make_effect("pin_slack", load_robot("palletizer").core, "joint1", {})
    with pytest.raises(InvalidInput, match="has no option 'side'"):
        _core.make_effect("pin_slack", load_robot("palletizer").core, "joint4", {"side": 1.0})


def test_the_link_lies_against_the_side_where_its_load_presses() -> None:
    robot = load_robot("palletizer")
    q = robot.assemble(random_poses(robot, 20, seed=1)).q
    payload = np.tile([0.0, 100.0], 10)
    model = robot.error_model
    loads = np.asarray(model.loads(robot.conditions(q, payload=payload), model.start))[:, 2 * 4 + 1]
    side = loads[:, :2] / np.hypot(loads[:, :1], np.hypot(loads[:, 1:2], 1.0)) / 2
    rows = Dataset.from_arrays(q, payload=payload, extra={"fx": side[:, 0], "fy": side[:, 1]})
    shifted = [
        {"effect": "regressor", "owner": "joint5", "column": f"f{axis}", "axis": axis}
        | {"parameters": {f"f{axis}_{axis}_mm": 1e3 * GAP}}
        for axis in "xy"
    ]
    moved, expected = (
        predict(of, rows).position - predict(robot, rows).position
        for of in (with_slack(robot, "joint5"), robot.with_(effects=shifted))
    )
    assert np.abs(moved).max() > 0.1 * GAP
    assert moved == pytest.approx(expected, abs=1e-2 * GAP)  # the shift itself changes the loads


def test_its_derivative_is_that_of_differences() -> None:
    robot = load_robot("palletizer")
    rows = Dataset.from_arrays(robot.assemble(random_poses(robot, 10, seed=2)).q, payload=np.full(10, 50.0))
    model = with_slack(robot, "joint4").error_model
    J = np.asarray(model.parameter_jacobian(robot.conditions(rows.q, payload=50.0), model.start, 3))[:, :, -1]
    there, here = (predict(with_slack(robot, "joint4", GAP + step), rows).position for step in (1e-5, -1e-5))
    change = (there - here) / 2e-5
    assert np.abs(change).max() > 0.1
    assert pytest.approx(change, abs=1e-4 * np.abs(change).max()) == J


@pytest.mark.parametrize("joint", ["joint4", "joint5", "joint6"])
def test_a_gap_is_found_again(joint: str) -> None:
    found = calibrate(load_robot("palletizer"), measured(joint, seed=1), effects=["geometry", f"pin_slack@{joint}"])
    (gap,) = (p for p in found.parameters if p.name == "gap_mm")
    assert gap.std is not None
    assert gap.value == pytest.approx(1e3 * GAP, abs=4 * gap.std)
    assert gap.std < 0.4 * 1e3 * GAP


@pytest.mark.parametrize("joint", ["joint5", "joint6"])
def test_diagnose_names_it(joint: str) -> None:
    found = diagnose(load_robot("palletizer"), measured(joint, seed=2))
    named: list[Any] = [(finding.effect, finding.owner) for finding in found.effects]
    assert ("pin_slack", joint) in [*named, *(other for finding in found.effects for other in finding.equivalents)]
