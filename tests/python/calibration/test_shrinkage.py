# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Geometry that is held where poses are few for their noise: nearer to the truth, with intervals that cover."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special

from fastcal import Robot, load_robot, simulate
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.shrinkage import Shrinkage, errors_size
from fastcal.calibration.simulation import perturbed, random_poses
from fastcal.measurements.dataset import Dataset

ARM = load_robot("ur5")
Array = NDArray[np.float64]


def session(seed: int, *, exact: bool = False, poses: int = 20, noise: float = 2e-3) -> tuple[Robot, Dataset]:
    """An arm that is off, or exact, and a camera's few poses of it: 2 mm and 2 mrad of noise."""
    true = ARM if exact else perturbed(ARM, seed=seed)
    data = simulate(true, random_poses(ARM, poses, seed=seed), noise=noise, noise_rotation=noise, seed=seed)
    return true, data


def error(result: CalibrationResult, true: Robot, seed: int) -> float:
    """[m] RMS of new points."""
    q = random_poses(ARM, 100, seed=seed + 1000)
    return float(np.sqrt(np.mean((result.model.forward(q)[:, :3, 3] - true.forward(q)[:, :3, 3]) ** 2)))


@pytest.mark.parametrize("exact", [pytest.param(True, marks=pytest.mark.full), False])
def test_few_coarse_poses_lose_to_neither_a_free_fit_nor_base_and_tool_alone(exact: bool) -> None:
    errors = []
    for seed in range(10):
        true, data = session(seed, exact=exact)
        held, free, frames = (
            calibrate(ARM, data),
            calibrate(ARM, data, priors=False),
            calibrate(ARM, data, parameters=[]),
        )
        assert held.held.startswith("few measurements for the errors that remain")
        assert free.held == ""
        assert held.unidentifiable == free.unidentifiable  # told as of a free fit
        assert held.degrees_of_freedom > free.degrees_of_freedom
        errors.append([error(result, true, seed) for result in (held, free, frames)])
    held, free, frames = np.mean(errors, axis=0)
    assert held < 0.9 * free
    assert held < (1.1 if exact else 0.95) * frames


def test_rich_data_have_the_free_fit_to_the_last_digit() -> None:
    _, data = session(0, poses=100, noise=5e-5)
    first, free = calibrate(ARM, data), calibrate(ARM, data, priors=False)
    assert [p.value for p in first.parameters] == [p.value for p in free.parameters]
    assert np.array_equal(first.covariance, free.covariance)


def test_intervals_of_held_fits_cover() -> None:
    inside = []
    for seed in range(25):
        true, data = session(seed)
        result = calibrate(ARM, data)
        q = random_poses(ARM, 40, seed=seed + 500)
        off = np.abs(result.model.forward(q)[:, :3, 3] - true.forward(q)[:, :3, 3])
        t = special.stdtrit(result.degrees_of_freedom, 0.975)
        inside.append(np.mean(off <= t * result.model.position_deviation(q)))
    assert 0.91 < np.mean(inside) < 0.985


def test_the_size_of_the_errors_is_what_the_deviations_hold_beyond_their_noise() -> None:
    rng = np.random.default_rng(0)
    C = np.diag(rng.uniform(0.5, 2.0, 1500))
    off = rng.normal(0, np.sqrt(1.5**2 + np.diag(C)))
    size, spared = errors_size(off, C)
    assert size == pytest.approx(1.5, rel=0.13)  # tried are sizes a quarter apart
    assert spared == pytest.approx(np.sum(np.diag(C) / (np.diag(C) + size**2)))
    small, _ = errors_size(rng.normal(0, np.sqrt(np.diag(C))), C)
    assert small < 0.3


def test_the_covariance_is_that_of_many_fits_held_so() -> None:
    """One length of an arm beside a free base: both by hand, over drawn arms and drawn noise."""
    rng = np.random.default_rng(1)
    own = np.array([[0.9, 0.5], [0.5, 0.8]])
    held = Shrinkage(0.7, np.ones(1), np.zeros(2), np.array([np.inf, 0.7]), np.array([np.inf, 1.2]))
    found, noise, freedom = held.posterior(own, [0, 1], 1e9)
    assert (noise, freedom) == (pytest.approx(1.0), pytest.approx(1e9))
    assert held.spared == pytest.approx(1 / (1 + 0.7**2))
    eased = held.eased()
    assert (eased.size, eased.deviations[1], eased.off[1]) == pytest.approx((1.4, 1.4, 1.4))
    x = rng.normal(0, [0.0, 1.2], (200_000, 2))
    free = x + rng.multivariate_normal(np.zeros(2), own, len(x))
    K = own[:, 1] / (own[1, 1] + 0.7**2)  # what is taken back, by the conditional mean of a Gaussian
    off = free - np.outer(free[:, 1], K) - x
    assert found == pytest.approx(off.T @ off / len(x), abs=0.01)
