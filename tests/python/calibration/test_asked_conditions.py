# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows that lie elsewhere: a payload, a temperature or a direction of approach is asked before anything has moved."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, load_robot, simulate
from fastcal.calibration.asked_conditions import criterion, share_a_condition
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.simulation import perturbed, random_poses
from fastcal.measurements.dataset import Dataset

ARM = load_robot("siasun_sr210d")
ROWS = 100
LATE = np.arange(ROWS) >= 50
COMPLIANCE = {"joint2": 4e-7, "joint3": 4e-7, "joint5": 1.5e-6}
GAP = {"joint1": 1e-3, "joint2": 1e-3, "joint3": 1e-3}


def arm(effect: str, parameter: str, values: dict[str, float], seed: int) -> Robot:
    entries = [{"effect": effect, "owner": owner, "parameters": {parameter: v}} for owner, v in values.items()]
    return Robot(perturbed(ARM, seed=seed).spec | {"effects": entries})


def calibrated(true: Robot, seed: int, *, move: float = 0.0, **conditions: Any) -> CalibrationResult:
    """Of ROWS poses, where from row 50 on the tracker stands `move` [m] away."""
    q = random_poses(ARM, ROWS, seed=seed)
    data = simulate(true, Dataset.from_arrays(q, **conditions), noise=3e-5, seed=seed)
    position = np.array(data.position)
    position[LATE] += move / np.sqrt(3)
    return calibrate(ARM, Dataset.from_arrays(q, position=position, robot=ARM, **conditions))


def loads(kind: str) -> NDArray[np.float64]:
    steps = {"step": LATE, "steps": np.arange(ROWS) // 34 / 2, "slowly": np.linspace(0, 1, ROWS)}
    return 210.0 * np.asarray({**steps, "in turn": np.arange(ROWS) % 3 == 0}[kind], dtype=float)


@pytest.mark.parametrize("kind", ["step", "steps", "slowly", "in turn"])
def test_a_load_is_no_move_however_it_comes(kind: str) -> None:
    result = calibrated(arm("joint_compliance", "compliance_rad_nm", COMPLIANCE, 1), 1, payload=loads(kind))
    said = " ".join(result.notes)
    assert result.status == "converged"
    assert "payload_kg, by joint_compliance: ask for it with --effects geometry,joint_compliance" in said
    assert "Only rows" not in said
    assert result.train.after is not None
    assert result.train.before is not None
    assert result.train.after.rms < result.train.before.rms


def test_asked_for_the_load_leaves_noise_and_no_sentence() -> None:
    true = arm("joint_compliance", "compliance_rad_nm", COMPLIANCE, 1)
    q = random_poses(ARM, ROWS, seed=1)
    data = simulate(true, Dataset.from_arrays(q, payload=loads("step")), noise=3e-5, seed=1)
    result = calibrate(ARM, data, effects="geometry,joint_compliance")
    assert result.train.after is not None
    assert result.train.after.rms < 1e-4
    assert not any("payload" in note or "moved" in note for note in result.notes)


def test_one_direction_of_approach_then_the_other_is_no_move() -> None:
    approach = np.where(LATE[:, np.newaxis], 1.0, -1.0) * np.ones((ROWS, 6))
    result = calibrated(arm("backlash", "gap_rad", GAP, 2), 2, approach=approach)
    (said,) = (note for note in result.notes if "from row" in note)
    assert "approach, by backlash, and nothing moved" in said
    assert said.endswith("all rows are used")
    assert len(result.outliers) < 10


def test_a_warm_afternoon_is_no_move() -> None:
    true = arm("thermal_offset", "rad_k", {"joint2": 1e-4, "joint3": -1e-4}, 3)
    temperature = 293.15 + 15.0 * LATE
    result = calibrated(true, 3, temperature=temperature)
    assert any("temperature_c, by thermal_offset" in note for note in result.notes)
    assert not any("Only rows" in note for note in result.notes)


def test_a_move_at_the_row_where_the_load_changes_is_still_a_move() -> None:
    """The arm is stiff: what a move of 5 mm does, no compliance can."""
    result = calibrated(perturbed(ARM, seed=4), 4, move=5e-3, payload=loads("step"))
    (said,) = (note for note in result.notes if "from row 50 on the points lie elsewhere" in note)
    assert "moved. Only rows 0 to 49 are used" in said
    assert not any("ask for it" in note for note in result.notes)
    assert set(result.outliers) == set(np.flatnonzero(LATE))


def test_a_move_beside_a_load_is_told_with_it() -> None:
    true = arm("joint_compliance", "compliance_rad_nm", {k: v / 4 for k, v in COMPLIANCE.items()}, 5)
    result = calibrated(true, 5, move=8e-3, payload=loads("in turn"))
    said = " ".join(result.notes)
    assert "tracker, the base or the target moved" in said
    assert "payload_kg, by joint_compliance" in said


def test_the_criterion_is_schwarzs() -> None:
    assert criterion(2.0, 100, 3) == pytest.approx(100 * np.log(2) + 3 * np.log(100))


def test_a_condition_is_told_by_the_value_that_parts_the_rows() -> None:
    payload = np.repeat([0.0, 5.0, 10.0], 20)
    data, judged = Dataset.from_arrays(np.zeros((60, 6)), payload=payload), np.ones(60, dtype=bool)
    assert share_a_condition(data, np.arange(41, 60), judged)  # but for a row
    assert share_a_condition(data, np.arange(20), judged)
    assert not share_a_condition(data, np.arange(0, 60, 3), judged)
    assert not share_a_condition(Dataset.from_arrays(np.zeros((60, 6))), np.arange(20), judged)
