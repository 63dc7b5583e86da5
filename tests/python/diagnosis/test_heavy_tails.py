# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise with heavy tails: rows of the written model are weighed by how far they are off, and its deviations hold."""

from dataclasses import replace

import numpy as np

from fastcal import diagnose, predict
from fastcal.diagnosis.adaptation import robot_of
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.heavy_tails import weighed
from fastcal.measurements.dataset import Dataset

from .rules.small_arm import SIGMA, arm, measured, problem

Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def points(seed: int, nu: float, rows: int = 150) -> tuple[Dataset, Dataset]:
    """Rows with t noise of nu degrees of freedom and deviation SIGMA in each coordinate; and other, exact ones."""
    exact = measured([], seed=seed, rows=rows + 40, noise=0.0)
    random = np.random.default_rng([seed, 7])
    noise = random.standard_t(nu, (rows, 3)) / np.sqrt(nu / (nu - 2)) * SIGMA
    fitted, others = exact.select(np.arange(rows)), exact.select(np.arange(rows, rows + 40))
    return replace(fitted, position=fitted.position + noise), others


def fits(data: Dataset) -> tuple[Fit, Fit]:
    """By least squares, and with the weights that its residuals ask for."""
    given = problem(data)
    plain = fit(given, [])
    out = weighed(given, plain)
    return plain, plain if out is given else fit(out, [], plain)


def errors(found: Fit, others: Dataset) -> tuple[Array, Array]:
    """(40, 3) of the predicted points and their standard deviations [m]."""
    data = replace(others, payload=np.zeros(len(others)))
    asked = replace(found.problem, data=data, used=data.measured, weight=None)
    model, samples = asked.model(found.entries, asked.kept)
    J = asked.linearized(model, samples, found.theta).J[:, found.free] * SIGMA
    std = np.sqrt(np.einsum("ij,jk,ik->i", J, found.covariance, J)).reshape(-1, 3)
    return predict(robot_of(found, SIGMA), data).position - others.position, std


def test_heavy_tails_cost_little_and_the_deviations_hold() -> None:
    """Against least squares over 24 sets; of the errors over their deviations the mean square is 1."""
    gain, size = [], []
    for seed in range(100, 124):
        data, others = points(seed, 3.0)
        plain, robust = fits(data)
        before, _ = errors(plain, others)
        after, std = errors(robust, others)
        gain.append(np.sqrt(np.mean(after**2) / np.mean(before**2)))
        size.append(np.mean((after / std) ** 2))
    assert np.median(gain) < 0.9
    assert 0.7 < np.mean(size) < 1.4


def test_normal_noise_is_fitted_by_least_squares() -> None:
    """In at least 19 of 20 sets."""
    weights = [weighed(given, fit(given, [])).weight for given in (problem(points(s, 1e6)[0]) for s in range(200, 220))]
    assert sum(weight is not None for weight in weights) <= 1


def test_noise_with_a_memory_is_left_alone() -> None:
    given = problem(points(100, 3.0)[0])
    given = given.with_noise(replace(given.noise, memory=0.5))
    assert weighed(given, fit(given, [])) is given


def test_the_written_model_is_the_weighed_fit() -> None:
    data, others = points(101, 3.0)
    found = diagnose(arm(), data, sigma=SIGMA)
    assert found.verdict == "none"
    plain, robust = (np.sqrt(np.mean(errors(at, others)[0] ** 2)) for at in fits(data))
    written = np.sqrt(np.mean((predict(found.model, others).position - others.position) ** 2))
    assert abs(written / robust - 1) < 0.05 < abs(plain / robust - 1)
