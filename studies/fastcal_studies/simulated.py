# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the studies' arms have in common: errors that no model of fastcal has, a tracker, and what a model leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.simulation import simulate
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

WAVES = 3


@dataclass(frozen=True)
class Unmodelled:
    """Errors e(q, load) of the joints that no effect can express: waves over pairs of joints.

        e_i = size_i (1 + growth payload / heaviest) sum_k sin(n_ik . q + p_ik) / sqrt(WAVES)

    n_ik of two joints, orders 1 to 2: what a network is for.

    Attributes:
        sizes: Of each joint [rad].
        heaviest: Load [kg] at which they have grown by `growth`.
        seed: Of orders and phases.
    """

    sizes: Sequence[float]
    heaviest: float
    growth: float
    seed: int

    def __call__(self, q: FloatArray, payload: FloatArray) -> FloatArray:
        """(N, n) errors of the joints [rad] at q (N, n) [rad] under a payload (N,) [kg]."""
        random = np.random.default_rng((self.seed, 11))
        e = np.zeros_like(q)
        n = q.shape[1]
        for joint, size in enumerate(self.sizes):
            for _ in range(WAVES):
                orders = np.zeros(n)
                orders[random.permutation(n)[:2]] = random.integers(1, 3, 2) * random.choice([-1, 1], 2)
                e[:, joint] += size / WAVES**0.5 * np.sin(q @ orders + random.uniform(0, 2 * np.pi))
        return e * (1 + self.growth * payload / self.heaviest)[:, np.newaxis]


def measure(true: Robot, sent: Dataset, outside: Unmodelled, noise: float, seed: int) -> Dataset:
    """What a tracker with `noise` [m] a coordinate sees of the true arm at the commands and loads of `sent`."""
    moved = replace(sent, q=sent.q + outside(sent.q, sent.payload))
    return replace(simulate(true, moved, noise=noise, seed=seed), q=sent.q)


def left(model: Robot, data: Dataset) -> FloatArray:
    """(N, 3) measured less predicted point [m], in the axes of the model's base: what a network has to give."""
    return -evaluate(model, data).error_after @ pose(model.spec["base"])[:3, :3]


def joint_torques(robot: Robot, data: Dataset) -> FloatArray:
    """(N, n) moments of all weights about each joint's own axis at equilibrium [N m]."""
    model = robot.error_model
    loads = np.asarray(model.loads(robot.samples(data), model.start))
    return loads[:, 1:-1:2, 5]
