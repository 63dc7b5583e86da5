# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cobot in numpy, written from docs/conventions.md alone: what is wrong with its joints is put in by hand.

Axes 2, 3 and 4 are parallel, as on the arms with which the diagnosis was attacked.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Dataset, Robot, load_robot

FloatArray = NDArray[np.float64]

SIGMA = 4e-5  # [m]
# d [m], a [m], alpha [rad] of each row, as the maker of the UR10 publishes them.
DH = np.array(
    [
        [0.1273, 0.0, np.pi / 2],
        [0.0, -0.612, 0.0],
        [0.0, -0.5723, 0.0],
        [0.163941, 0.0, np.pi / 2],
        [0.1157, 0.0, -np.pi / 2],
        [0.0922, 0.0, 0.0],
    ]
)
TOOL = np.array([0.05, 0.03, 0.11])  # [m]
OFF = 5e-4  # of a workshop [m, rad]


def robot() -> Robot:
    """The arm as its maker means it."""
    return Robot(dict(load_robot("ur10").spec) | {"tool": {"xyz_mm": (1e3 * TOOL).tolist(), "rpy_deg": [0, 0, 0]}})


def postures(count: int, seed: int) -> FloatArray:
    """(N, 6) joint positions [rad]."""
    return np.random.default_rng(seed).uniform(-2.2, 2.2, (count, 6))


def directions(count: int, seed: int) -> FloatArray:
    """(N, 6) of approach."""
    return np.random.default_rng(seed).choice([-1.0, 1.0], (count, 6))


def points(q: FloatArray, seed: int, growth: FloatArray | float = 0.0) -> FloatArray:
    """(N, 3) places of the target of one arm, built as `seed` has it, at joint positions q (N, 6), in metres.

    T = T_1 ... T_6 tool, T_i = Rz(theta + q) Tz(d) Tx(a) Rx(alpha); d and a times 1 + growth (N,).
    """
    random = np.random.default_rng(seed)
    dh, theta = DH + OFF * random.standard_normal(DH.shape), OFF * random.standard_normal(6)
    x, y, z = (np.full(len(q), c) for c in TOOL + OFF * random.standard_normal(3))
    for (d, a, alpha), zero, angle in zip(dh[::-1], theta[::-1], q.T[::-1], strict=True):
        x = x + a * (1 + growth)
        y, z = y * np.cos(alpha) - z * np.sin(alpha), y * np.sin(alpha) + z * np.cos(alpha) + d * (1 + growth)
        c, s = np.cos(zero + angle), np.sin(zero + angle)
        x, y = c * x - s * y, s * x + c * y
    return np.column_stack([x, y, z])


def measured(q: FloatArray, place: FloatArray, seed: int, **columns: Any) -> Dataset:
    """Rows of commands q (N, 6) that were seen at places (N, 3), each coordinate with noise of SIGMA."""
    noise = SIGMA * np.random.default_rng([seed, 1]).standard_normal(place.shape)
    return Dataset.from_arrays(q, robot=robot(), position=place + noise, **columns)


def shifted(q: FloatArray, shift: Mapping[int, FloatArray]) -> FloatArray:
    """Joint positions q (N, 6) with joints (from 1) off by `shift` [rad]."""
    there = q.copy()
    for joint, off in shift.items():
        there[:, joint - 1] += off
    return there


def in_full(*cases: Any) -> list[Any]:
    """Parameters of a test that only ./test --full takes."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.full) for case in cases]
