# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The position-distance method of the RX160L paper, on its arm: geometry that is off cancels between payloads."""

import copy
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.payload_pairs import from_payload_pairs, same_posture
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

# Table 3 of the paper, which is in N mm/rad: critical torque [N m], compliance below and above [rad/(N m)].
TABLE_3 = {
    2: (118.236, 1e3 / 2.34e9, 1e3 / 2.65e9),
    3: (75.625, 1e3 / 9.73e8, 1e3 / 1.19e9),
    5: (15.382, 1e3 / 8.07e6, 1e3 / 9.73e6),
}
PAYLOADS = (0.4, 1.95, 3.95, 5.95, 7.95, 9.95)


def paper_arm() -> Robot:
    """The RX160L with table 3 for the payload's torque alone, its geometry off by a workshop's errors."""
    spec = copy.deepcopy(fastcal.perturbed(fastcal.load_robot("staubli_rx160l"), seed=3).spec)
    spec["payload"] = {"com_mm": [30.0, 10.0, 120.0]}
    spec["effects"] = [
        {
            "effect": "joint_compliance_nonlinear",
            "owner": f"joint{joint}",
            "torque": "payload",
            "parameters": {"low_rad_nm": low, "high_rad_nm": high, "critical_nm": critical},
        }
        for joint, (critical, low, high) in TABLE_3.items()
    ]
    spec["effects"].append(
        {"effect": "joint_compliance", "owner": "joint4", "parameters": {"compliance_rad_nm": 1e3 / 8.52e7}}
    )
    return Robot(spec)


def measured(robot: Robot, postures: int = 50, noise: float = 1e-6) -> Dataset:
    q = np.repeat(fastcal.random_poses(robot, postures, seed=8), len(PAYLOADS), axis=0)
    return fastcal.simulate(robot, q, payload=np.tile(PAYLOADS, postures), noise=noise, seed=9)


def nominal() -> Robot:
    spec = copy.deepcopy(fastcal.load_robot("staubli_rx160l").spec)
    spec["payload"] = {"com_mm": [30.0, 10.0, 120.0]}
    return Robot(spec)


EFFECTS = [f"joint_compliance_nonlinear@joint{joint}:torque=payload" for joint in TABLE_3] + ["joint_compliance@joint4"]


def deviations(result: Any, truth: Robot) -> np.ndarray:
    """(P,) errors of the parameters in their own standard deviations."""
    true = [
        value["value"] if isinstance(value, dict) else value
        for e in truth.spec["effects"]
        for value in e["parameters"].values()
    ]
    return np.array([(p.value - value) / p.std for p, value in zip(result.parameters, true, strict=True)])


def test_table_3_of_the_paper_is_found_though_the_geometry_is_off() -> None:
    truth = paper_arm()
    data = measured(truth, noise=1e-6)
    result = from_payload_pairs(nominal(), data, effects=EFFECTS)
    assert result.posture_count == 50
    assert result.row_count == 300
    assert result.sigma == pytest.approx(1e-6, rel=0.15)
    z = deviations(result, truth)
    assert np.abs(z).max() < 3.5
    assert np.mean(z**2) == pytest.approx(1, abs=1.4)  # chi-squared of 10, at 99.9 %
    critical = [p.value for p in result.parameters if p.name == "critical_nm"]
    assert critical == pytest.approx([118.236, 75.625, 15.382], rel=0.1)
    # The whole arm is off by half a millimetre; what the payloads do is left at the noise.
    before, after = (np.sqrt(np.mean(np.sum(r**2, axis=1))) for r in (result.before, result.after))
    assert before > 1e-4
    assert after == pytest.approx(np.sqrt(3 * 5 / 6) * 1e-6, rel=0.15)


def test_the_paper_model_predicts_other_payloads() -> None:
    truth = paper_arm()
    result = from_payload_pairs(nominal(), measured(truth, noise=1e-6), effects=EFFECTS)
    q = fastcal.random_poses(truth, 40, seed=77)
    move = truth.forward(q, payload=7.0)[:, :3, 3] - truth.forward(q, payload=1.0)[:, :3, 3]
    there = result.model.forward(q, payload=7.0)[:, :3, 3] - result.model.forward(q, payload=1.0)[:, :3, 3]
    assert np.sqrt(np.mean(np.sum(move**2, axis=1))) > 1e-4
    assert np.sqrt(np.mean(np.sum((there - move) ** 2, axis=1))) < 3e-6


def test_rows_of_one_posture_belong_together_wherever_they_stand() -> None:
    q = np.array([[0.1, 0.2], [0.3, 0.4], [0.1, 0.2 + 1e-9], [0.3, 0.4], [0.5, 0.6], [0.5, 0.6]])
    load = np.array([[0.0], [1.0], [2.0], [1.0], [0.0], [3.0]])
    assert same_posture(q, load, np.ones(6, dtype=bool)).tolist() == [0, -1, 0, -1, 1, 1]
    assert same_posture(q, load, np.array([1, 1, 0, 1, 1, 1], dtype=bool)).tolist() == [-1, -1, -1, -1, 0, 0]


def test_what_payloads_cannot_determine_is_reported() -> None:
    data = measured(paper_arm(), postures=10)
    with pytest.raises(fastcal.InvalidInput, match="geometry cancels"):
        from_payload_pairs(nominal(), data, effects="geometry,joint_compliance@joint2")
    with pytest.raises(fastcal.InvalidInput, match="do not determine joint1 compliance"):
        from_payload_pairs(nominal(), data, effects="joint_compliance@joint1,joint_compliance@joint2")
    with pytest.raises(fastcal.InvalidInput, match="no posture was measured with two payloads"):
        from_payload_pairs(nominal(), data.select(np.arange(0, len(data), len(PAYLOADS))))
