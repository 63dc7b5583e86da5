# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Moves of the instrument, of the base or of the target by more than an arm's errors are told by their rows."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal.measurements.dataset import Dataset
from fastcal.measurements.frame_fit import point_bounds
from fastcal.measurements.plausibility import plausible
from fastcal.robot.given import as_robot

Array = NDArray[np.float64]

ARM = as_robot("kuka_kr6_r900")
TOOL = np.array([0.02, 0.01, 0.1])


def postures(count: int, seed: int) -> Array:
    low, high = ARM.limits.T
    return np.random.default_rng(seed).uniform(0.6 * low, 0.6 * high, (count, 6))


def seen(q: Array, tool: Array = TOOL, seed: int = 0) -> Array:
    """Points of the nominal arm with errors of half a millimetre."""
    T = ARM.forward(q)
    return np.asarray(T[:, :3, 3] + T[:, :3, :3] @ tool + np.random.default_rng(seed).normal(0, 3e-4, (len(q), 3)))


def moved(p: Array, size: float, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return np.asarray(Rotation.from_rotvec(rng.normal(0, min(size, 1), 3)).apply(p) + rng.normal(0, size, 3))


@pytest.mark.parametrize("size", [0.05, 0.4, 3.0])
@pytest.mark.parametrize("firsts", [(25,), (40, 70), (30, 60), (20, 45, 66)])
@pytest.mark.parametrize("back", [False, True])
def test_moves_are_told_by_their_rows(size: float, firsts: tuple[int, ...], back: bool) -> None:
    q = postures(90, 1)
    p = seen(q)
    for k, (first, end) in enumerate(zip(firsts, [*firsts[1:], 90], strict=True)):
        if not (back and k % 2):
            p[first:end] = moved(p[first:end], size, 100 + k)
    found = plausible(Dataset.from_arrays(q, position=p), ARM, ARM.forward)
    assert found is not None
    assert found.refused
    assert [int(row) for row in re.findall(r"\d+", found.meant)] == list(firsts)
    assert ("once back" in found.meant) == (back and len(firsts) > 1)
    assert float(found.better.removesuffix(" mm")) < 1.0


def test_a_target_that_was_moved_on_the_flange_is_told_as_well() -> None:
    q = postures(80, 2)
    p = seen(q)
    p[45:] = seen(q[45:], TOOL + np.array([0.05, -0.08, 0.03]))
    found = plausible(Dataset.from_arrays(q, position=p), ARM, ARM.forward)
    assert found is not None
    assert "before row 45 " in found.meant


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_said_of_gross_rows_nor_of_an_arm_with_large_errors(seed: int) -> None:
    q, rng = postures(80, seed), np.random.default_rng(seed)
    p = seen(q + rng.normal(0, 4e-3, 6), seed=seed)
    gross = rng.choice(80, 12, replace=False)
    p[gross] += rng.normal(0, 0.3, (12, 3))
    found = plausible(Dataset.from_arrays(q, position=p), ARM, ARM.forward)
    assert found is None or "moved" not in found.meant


def test_few_rows_elsewhere_are_told_and_set_aside() -> None:
    q = postures(90, 3)
    p = seen(q)
    p[84:] = moved(p[84:], 0.4, 7)
    found = plausible(Dataset.from_arrays(q, position=p), ARM, ARM.forward)
    assert found is not None
    assert "before row 84 " in found.meant
    assert not found.refused


@pytest.mark.parametrize("kind", ["in space", "in a plane", "on a line", "at a point"])
def test_the_bounds_of_many_sets_of_points_are_those_of_each(kind: str) -> None:
    q = postures(60, 3)
    T, p = ARM.forward(q), seen(q)
    p[:, {"in space": 3, "in a plane": 2, "on a line": 1, "at a point": 0}[kind] :] = 0.3
    p[:10] = seen(q[:10])  # sets of points of other kinds among them
    runs = np.arange(0, 47, 7)[:, np.newaxis] + np.arange(14)
    one_by_one = [float(point_bounds(T[run][np.newaxis], p[run])[0]) for run in runs]
    np.testing.assert_allclose(point_bounds(T[runs], p[runs]), one_by_one, rtol=1e-9, atol=1e-12)
    if kind == "in space":  # half a millimetre of a spread of a metre
        assert max(one_by_one) < 2e-3
