# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Commanding the compensated joints brings a true arm's tool to its targets as well as the model predicts it.

The arms of the hidden-effect sets, with the true values of their effects, on a geometry that is off by chance, and with
tooth errors that no model knows. They are measured at the sets' poses and conditions, calibrated, compensated.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.calibration.simulation import perturbed, simulate
from fastcal.measurements.conditions import condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.robot.controller_robot import nominal_robot
from fastcal.robot.robot import Robot

# Set: what is asked of the calibration, and what stands in the true arm's file beside the values.
SETS: dict[str, tuple[str, list[dict[str, Any]]]] = {
    "11_backlash": ("backlash@joint3", [{"owner": "joint3"}]),
    "20_two": (
        "joint_compliance@joint3,gear_harmonic@joint1:order=2",
        [{"owner": "joint3"}, {"owner": "joint1", "order": 2}],
    ),
    "21_two": (
        "thermal_expansion@robot,reduction_ratio@joint1",
        [{"owner": "robot", "t0_c": 20.99}, {"owner": "joint1"}],
    ),
    "23_redundant": (
        "joint_compliance@joint2,gear_harmonic@joint4:order=2",
        [{"owner": "joint2"}, {"owner": "joint4", "order": 2}],
    ),
}
SLACK = 1.05


def true_arm(nominal: Robot, hidden: list[dict[str, Any]], more: list[dict[str, Any]]) -> Robot:
    """The nominal robot with the hidden effects, small unknown ones, and other sizes."""
    effects = [
        {"effect": truth["effect"], "parameters": truth["parameters"], **rest}
        for truth, rest in zip(hidden, more, strict=True)
    ]
    teeth = {"amplitude_rad": 3e-5, "phase_rad": 0.7}
    effects += [{"effect": "gear_harmonic", "owner": f"joint{i}", "order": 7, "parameters": teeth} for i in (2, 3, 5)]
    return perturbed(Robot(nominal.spec | {"effects": effects}), seed=17)


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))


@pytest.mark.parametrize("name", SETS)
def test_the_true_tool_gets_there_within_the_prediction_error(name: str, shared_data: Path) -> None:
    folder = shared_data / "hidden_effects" / name
    truth = json.loads((folder / "truth.json").read_text())
    nominal = fastcal.load_robot(folder / "robot.yaml")
    asked, more = SETS[name]
    arm = true_arm(nominal, truth["effects"], more)
    poses, test = (fastcal.load_measurements(folder / f"{file}.csv", nominal) for file in ("measurements", "test"))
    measured = simulate(arm, poses, noise=5e-5, repeatability=5e-6, seed=3)
    model = fastcal.calibrate(nominal, measured, effects=f"geometry,{asked}").model

    before, conditions = nominal_robot(model), columns(test)
    error = rms((model.forward(test.q, **conditions) - arm.forward(test.q, **conditions))[:, :3, 3])
    targets = before.forward(test.q)
    found = fastcal.compensate(model, targets, seed=test.q, **conditions)
    there = found.reached
    assert there.mean() > 0.95
    got = arm.forward(found.q, **conditions)[there]
    left = rms((got - targets[there])[:, :3, 3])
    without = rms((arm.forward(test.q, **conditions) - targets)[there][:, :3, 3])

    assert left <= SLACK * error
    assert left < 0.2 * without


def columns(data: Dataset) -> dict[str, Any]:
    return {name: value for name, value in condition_columns(data).items() if value is not None}
