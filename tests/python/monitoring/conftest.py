# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm that was calibrated, and what may happen to it afterwards."""

import copy
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

import fastcal
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

NOISE = 3e-5
MOVED = {"xyz_mm": [1500.0, -700.0, 250.0], "rpy_deg": [1.0, -2.0, 120.0]}
Measure = Callable[..., Dataset]


@dataclass(frozen=True)
class Calibrated:
    """The arm as it is, and its calibrated model."""

    true: Robot
    model: Robot

    def spec(self) -> dict:
        """A copy of what the arm is, before an instrument that was set up anew."""
        return copy.deepcopy(self.true.spec) | {"base": copy.deepcopy(MOVED)}

    def measured(self, spec: dict, count: int = 8, *, seed: int = 1, noise: float = NOISE) -> Dataset:
        """Poses of a check, measured of the arm `spec`."""
        poses = fastcal.check_poses(self.model, count)
        sent = Dataset.from_arrays(poses.q, payload=poses.payload, robot=self.model)
        return fastcal.simulate(Robot(spec), sent, noise=noise, seed=seed)


@pytest.fixture(scope="session")
def calibrated() -> Calibrated:
    """An RX160L whose joints 2 and 3 yield, calibrated from 60 poses."""
    nominal = fastcal.load_robot("staubli_rx160l")
    yielding = [
        {"effect": "joint_compliance", "owner": f"joint{joint}", "parameters": {"compliance_rad_nm": {"value": value}}}
        for joint, value in ((2, 2e-6), (3, 5e-6))
    ]
    true = Robot(fastcal.perturbed(nominal, seed=3).spec | {"effects": yielding})
    random = np.random.default_rng(0)
    sent = Dataset.from_arrays(
        fastcal.random_poses(nominal, 60, seed=1), payload=random.choice([0.0, 14.0], 60), robot=nominal
    )
    effects = ["geometry", "joint_compliance@joint2", "joint_compliance@joint3"]
    who = {"serial": "RX-0042", "date": "2026-01-15", "instrument": "tracker 7"}
    result = fastcal.calibrate(nominal, fastcal.simulate(true, sent, noise=NOISE, seed=5), effects=effects, who=who)
    assert result.status == "converged"
    return Calibrated(true, result.model)
