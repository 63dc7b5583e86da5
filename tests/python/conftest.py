# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What many tests need."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from fastcal import simulate
from fastcal.calibration.simulation import random_poses
from fastcal.io.robot_file import load_robot
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The measurement sets beside the repository; without them a test is skipped, or fails where they are due."""
    folder = Path(__file__).resolve().parents[3] / "shared" / "data"
    if not folder.is_dir():
        missing = f"the measurement sets are not at {folder}"
        if os.environ.get("FASTCAL_DATA_REQUIRED") == "1":
            pytest.fail(missing)
        pytest.skip(missing)
    return folder


@pytest.fixture(scope="session")
def programs() -> dict[str, dict[str, bytes]]:
    """The files of a robot program in each language, by the language's name."""
    folder = Path(__file__).parent / "data" / "programs"
    names = {
        "RAPID": ["glue.mod"],
        "KRL": ["weld.src", "weld.dat"],
        "FANUC LS": ["PICK.LS"],
        "URScript": ["palletize.script"],
    }
    return {language: {name: (folder / name).read_bytes() for name in files} for language, files in names.items()}


@dataclass(frozen=True)
class HiddenBacklash:
    """A robot file whose arm has backlash that the file does not know, and its measurements."""

    robot: Robot
    data: Dataset
    test: Dataset
    gap: float
    sigma: float


@pytest.fixture(scope="session")
def hidden_backlash() -> HiddenBacklash:
    """PMC arm, joint 3 with 4e-4 rad of backlash, noise 0.04 mm; 90 poses and 30 others."""
    robot, gap, sigma = load_robot("pmc6va030"), 4e-4, 4e-5
    lost = {"effect": "backlash", "owner": "joint3", "parameters": {"gap_rad": {"value": gap, "std": None}}}
    true = Robot({**robot.spec, "effects": [lost]})
    sets = []
    for count, seed in ((90, 1), (30, 2)):
        side = np.where(np.random.default_rng(seed).random((count, robot.joint_count)) < 0.5, -1.0, 1.0)
        sent = Dataset.from_arrays(random_poses(robot, count, seed=seed), approach=side)
        sets.append(simulate(true, sent, noise=sigma, seed=seed))
    return HiddenBacklash(robot, *sets, gap, sigma)
