# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Correlated errors of successive rows: noticed, reported, and allowed for in tests and standard deviations."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, diagnose, load_robot, perturbed, random_poses, simulate
from fastcal.diagnosis import Diagnosis
from fastcal.diagnosis.fits import fit
from fastcal.diagnosis.memory import _of_neighbours, log_determinant, without_memory
from fastcal.diagnosis.problem import Noise, prepared_problem
from fastcal.diagnosis.row_projections import Effect
from fastcal.measurements.dataset import Dataset

from .rules import small_arm

FloatArray = NDArray[np.float64]

SIGMA = 5e-5  # [m]
ROWS = 150
RHO = 0.85


@cache
def arm() -> Robot:
    return load_robot("ur10e")


def slow_noise(rho: float, seed: int) -> FloatArray:
    """(ROWS, 3) of standard deviation SIGMA."""
    e = np.random.default_rng(seed).standard_normal((ROWS, 3))
    for k in range(1, ROWS):
        e[k] = rho * e[k - 1] + np.sqrt(1 - rho**2) * e[k]
    return SIGMA * e


def rows(rho: float, gap: float = 0.0, seed: int = 1) -> Dataset:
    """A warming arm without a cause, or with backlash; its rows are not in the order in which they were measured."""
    random = np.random.default_rng(seed)
    time = np.cumsum(random.uniform(20.0, 40.0, ROWS))
    warm = 293.15 + 8 * (1 - np.exp(-2 * time / time[-1]))
    approach = random.choice([-1.0, 1.0], (ROWS, 6))
    q = random_poses(arm(), ROWS, seed=seed)
    poses = Dataset.from_arrays(q, robot=arm(), time=time, temperature=warm, approach=approach)
    slack = {"effect": "backlash", "owner": "joint2", "parameters": {"gap_rad": gap}}
    true = Robot(dict(perturbed(arm(), seed=seed).spec) | {"effects": [slack] if gap else []})
    points = simulate(true, poses, noise=1e-12, seed=seed).position
    assert points is not None
    seen = replace(poses, position=points + slow_noise(rho, seed))
    return seen.select(random.permutation(ROWS))


@cache
def correlated() -> Diagnosis:
    return diagnose(arm(), rows(RHO))


def test_slow_noise_is_noticed_and_is_no_cause() -> None:
    found = correlated()
    assert found.verdict == "none"
    assert abs(found.search.problem.noise.memory - RHO) < 0.12
    (written,) = re.findall(r"rows are correlated \(([-.0-9]+)\)", found.sigma_note)
    assert abs(float(written) - RHO) < 0.12
    assert "but errors of successive rows are strongly correlated" in found.sentence


def test_white_noise_has_no_memory() -> None:
    found = diagnose(arm(), rows(0.0))
    assert found.search.problem.noise.memory == 0
    assert "correlated" not in found.sigma_note


def test_a_cause_is_found_beside_slow_noise() -> None:
    """The band about its curve is as wide as its size is unsure."""
    said = diagnose(arm(), rows(RHO, gap=2e-4))
    (found,) = said.effects
    assert found.label == "backlash@joint2"
    size = found.parameters["gap_rad"]
    assert size.std is not None
    assert abs(size.value - 2e-4) < 4 * size.std
    at = said.state.fit
    drawn = Effect.fitted(at, at.place(at.added[0]))
    np.testing.assert_allclose(np.sqrt(drawn.covariance), size.std, rtol=1e-6)


def test_fits_are_generalized_least_squares() -> None:
    """Beside the dense correlation matrix, with rows that were not used between the others."""
    data = rows(RHO)
    problem = prepared_problem(arm(), data, [], Noise((SIGMA, 1e-4, SIGMA), memory=0.7), 1)
    used = problem.used.copy()
    used[[3, 4, 70]] = False
    problem = problem.with_rows(used)
    at = fit(problem, [])
    assert data.time is not None
    place = np.argsort(np.argsort(data.time))[np.flatnonzero(used)]
    row = at.near.row
    apart = np.abs(place[row][:, np.newaxis] - place[row])
    same = np.arange(len(row)) % 3
    Omega = np.where(same[:, np.newaxis] == same, 0.7**apart, 0.0)
    J = at.near.J[:, at.free]
    normal = J.T @ np.linalg.solve(Omega, J) + np.diag(at.prior[at.free] ** -2)
    scale = np.sqrt(np.diag(normal))
    covariance = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    np.testing.assert_allclose(np.diag(at.covariance), np.diag(covariance), rtol=1e-6)
    assert log_determinant(problem, row) == pytest.approx(np.linalg.slogdet(Omega)[1], rel=1e-9)
    r = without_memory(problem, at.near.r, row)
    np.testing.assert_allclose(r @ r, at.near.r @ np.linalg.solve(Omega, at.near.r), rtol=1e-9)


def test_along_a_path_slow_noise_and_a_cause_without_a_name_are_said_to_look_alike() -> None:
    """A joint with a bump in its way; the same rows in random order can tell."""
    turn = np.linspace(0, 2 * np.pi, 240)
    q = 2.2 * np.sin(np.outer(turn, [1.0, 2.0, 3.0]) + np.array([0.0, 0.7, 1.9]))
    bump = np.exp(-(((q[:, 1] - 0.8) / 0.15) ** 2))
    shift = np.outer(bump, [0.8, 0.0, 1.0])
    exact = simulate(perturbed(small_arm.arm(), seed=5), Dataset.from_arrays(q), noise=SIGMA, seed=5)
    assert exact.position is not None
    data = replace(exact, position=exact.position + 5e-4 * shift)
    order = np.random.default_rng(4).permutation(240)
    for rows, is_said in ((data, True), (data.select(order), False)):
        found = diagnose(small_arm.arm(), rows)
        assert found.unexplained is not None or any(one.effect == "joint_curve" for one in found.effects)
        assert any("successive poses lie near each other" in note for note in found.notes) == is_said


def test_rows_in_the_order_of_measuring_are_whitened_as_the_same_rows_in_any_other() -> None:
    data = rows(RHO)
    assert data.time is not None
    order = np.argsort(data.time)
    noise = Noise((SIGMA, 1e-4, SIGMA), memory=0.7)
    row = np.repeat(np.arange(ROWS), 3)
    mixed = prepared_problem(arm(), data, [], noise, 1)
    ordered = prepared_problem(arm(), data.select(order), [], noise, 1)
    values = np.random.default_rng(0).standard_normal((3 * ROWS, 4))
    numbers = (3 * order[:, np.newaxis] + np.arange(3)).ravel()
    expected = without_memory(mixed, values, row)[numbers]
    assert not np.allclose(expected, values[numbers])
    for by_row in (values[numbers], np.asfortranarray(values[numbers])):
        np.testing.assert_array_equal(without_memory(ordered, by_row, row), expected)
    np.testing.assert_array_equal(without_memory(ordered, values[numbers][:, 0], row), expected[:, 0])


def test_targets_of_one_posture_share_errors_and_the_noise_has_no_memory() -> None:
    """Two targets at an arm whose joints come back a little off: alike within a posture, not from one to the next."""
    rng = np.random.default_rng(4)
    q = random_poses(arm(), 80, seed=4)
    pose = perturbed(arm(), seed=4).forward(q + 5e-5 * rng.normal(size=q.shape))
    tips = np.array([[0.05, 0.0, 0.1], [-0.05, 0.04, 0.1]])
    points = pose[:, np.newaxis, :3, 3] + np.einsum("nij,tj->nti", pose[:, :3, :3], tips)
    points = (points + 1e-5 * rng.normal(size=points.shape)).reshape(-1, 3)
    seen = Dataset.from_arrays(np.repeat(q, 2, axis=0), position=points, mount=["a", "b"] * 80, robot=arm())
    found = diagnose(arm(), seen)
    noise = found.search.problem.noise
    assert noise.memory == noise.shared == 0
    assert noise.by_stay
    assert 4e-5 < noise.repeatability * noise.factor < 6.5e-5
    assert "rows measured in one posture share them" in found.sigma_note
    assert "successive" not in found.sigma_note
    assert found.verdict == "none"


@pytest.mark.parametrize(("any_two", "count"), [(0.5, 2), (0.5, 3), (0.3, 8), (0.9, 4)])
def test_neighbours_of_a_stay_are_so_alike_that_its_mean_varies_as_it_should(any_two: float, count: int) -> None:
    rho = _of_neighbours(any_two, count)
    chain = rho ** np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    assert chain.mean() == pytest.approx((1 + (count - 1) * any_two) / count, rel=1e-6)
