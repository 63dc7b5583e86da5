# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm with an error that its model does not have, measured, and a network trained on it once for all."""

from pathlib import Path

import numpy as np
import pytest

import fastcal
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

NOISE = 2e-5


@pytest.fixture(scope="session")
def arm() -> Robot:
    return fastcal.load_robot("staubli_rx160l")


@pytest.fixture(scope="session")
def true_arm(arm: Robot) -> Robot:
    """Half a milliradian of periodic error in joints 1 to 3, which the nominal model knows nothing of."""
    harmonics = [
        {
            "effect": "gear_harmonic",
            "owner": f"joint{joint}",
            "order": order,
            "parameters": {"amplitude_rad": {"value": 5e-4}, "phase_rad": {"value": 0.4 * joint}},
        }
        for joint, order in ((1, 2), (2, 3), (3, 2))
    ]
    return Robot(arm.spec | {"effects": harmonics})


def measured(true: Robot, arm: Robot, count: int, seed: int) -> Dataset:
    random = np.random.default_rng(seed)
    q = random.uniform(-1.2, 1.2, (count, arm.joint_count))
    return fastcal.simulate(true, q, noise=NOISE, seed=seed, payload=random.choice([0.0, 5.0, 10.0], count))


@pytest.fixture(scope="session")
def data(arm: Robot, true_arm: Robot) -> Dataset:
    return measured(true_arm, arm, 240, 1)


@pytest.fixture(scope="session")
def unseen(arm: Robot, true_arm: Robot) -> Dataset:
    return measured(true_arm, arm, 150, 2)


@pytest.fixture(scope="session")
def trained(arm: Robot, data: Dataset) -> "fastcal.networks.TrainingResult":
    pytest.importorskip("torch")
    from fastcal.networks import train

    return train(arm, data, rivals=["knn", "boosting"], folds=3)


@pytest.fixture(scope="session")
def saved(trained: "fastcal.networks.TrainingResult", tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model file with its network beside it; only to be read."""
    path = tmp_path_factory.mktemp("trained") / "model.yaml"
    trained.model.save(path)
    return path
