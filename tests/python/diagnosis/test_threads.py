# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""No bit of a diagnosis depends on the number of threads."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from fastcal import load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.measurements.dataset import Dataset

SIGMA = 4e-5  # [m]


@cache
def rows() -> Dataset:
    """Joint 1 errs by a square wave of its position, which is no name: curves are fitted beside everything else."""
    arm = load_robot("pmc6va030")
    data = simulate(perturbed(arm, seed=1), random_poses(arm, 300, seed=1), noise=SIGMA, seed=1)
    assert data.position is not None
    turn = 1e-3 * np.sign(np.sin(2.6 * data.q[:, 0] + 0.4))
    x, y, z = data.position.T
    return replace(data, position=np.column_stack([x - turn * y, y + turn * x, z]))


def found(threads: int) -> Diagnosis:
    return diagnose(load_robot("pmc6va030"), rows(), sigma=SIGMA, threads=threads)


@cache
def alone() -> Diagnosis:
    return found(1)


def test_curves_are_among_what_is_compared() -> None:
    assert "joint_profile" in {f.effect for f in alone().effects}


@pytest.mark.parametrize("threads", [2, 3, 8])
def test_a_diagnosis_is_the_same_bit_for_bit(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    shared = []
    share_out = ThreadPoolExecutor.submit

    def counted(pool: ThreadPoolExecutor, work: Any, /, *items: Any, **more: Any) -> Any:
        shared.append(pool)
        return share_out(pool, work, *items, **more)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", counted)
    again = found(threads)
    assert len(shared) > 100
    assert again.to_json_dict() == alone().to_json_dict()
    assert again.model.spec == alone().model.spec
    assert again.final is not None
    assert alone().final is not None
    np.testing.assert_array_equal(again.final.fit.theta, alone().final.fit.theta)
