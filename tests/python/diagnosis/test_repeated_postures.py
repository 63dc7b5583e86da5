# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Postures under several payloads: what is wrong with a posture is in all of its rows, and makes no cause of an arm."""

import os
from dataclasses import replace

import numpy as np

from fastcal import Robot, diagnose, perturbed, simulate
from fastcal.measurements.dataset import Dataset

from .rules.small_arm import SIGMA, arm

POSTURES, LOADS = 24, 6
YIELDING = {"effect": "joint_compliance", "owner": "joint2", "parameters": {"compliance_rad_nm": 8e-6}}


def rows(seed: int, off: float, effects: list[dict[str, object]]) -> Dataset:
    """Rows of postures that are off by `off` [m] a coordinate, each in its own way under all payloads."""
    random = np.random.default_rng(seed)
    q = np.repeat(random.uniform(-2.5, 2.5, (POSTURES, 3)), LOADS, axis=0)
    poses = Dataset.from_arrays(q, payload=np.tile(np.linspace(0.0, 10.0, LOADS), POSTURES))
    true = Robot(dict(perturbed(arm(), seed=seed, length=5e-4, angle=5e-4).spec) | {"effects": effects})
    data = simulate(true, poses, noise=SIGMA, seed=seed)
    assert data.position is not None
    return replace(data, position=data.position + np.repeat(random.normal(0.0, off, (POSTURES, 3)), LOADS, axis=0))


def test_errors_of_postures_are_no_cause_in_the_model() -> None:
    for seed in (1, 2, 3) if os.environ.get("FASTCAL_TEST_FULL") == "1" else (1,):
        assert not [f.label for f in diagnose(arm(), rows(seed, 3e-4, [])).effects if f.in_model]


def test_what_yields_is_found_beside_them() -> None:
    found = diagnose(arm(), rows(2, 1e-4, [YIELDING]))
    (name,) = [f for f in found.effects if f.in_model]
    assert name.owner == "joint2"
    assert "compliance" in name.effect  # straight or bent: errors of postures bend it
