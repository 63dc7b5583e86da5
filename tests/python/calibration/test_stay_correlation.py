# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows measured one after the other in one posture share what the arm misses there; the noise has no memory by that."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import Robot, calibrate, load_robot, perturbed, random_poses
from fastcal.calibration.postures import stays
from fastcal.calibration.serial_correlation import neighbour_correlation
from fastcal.calibration.stay_correlation import of_stays, stay_correlation, whitened
from fastcal.measurements.dataset import Dataset

Array = NDArray[np.float64]

TARGETS = np.array([[0.05, 0.0, 0.1], [-0.05, 0.04, 0.1], [0.0, -0.06, 0.12]])  # [m]


def model(seed: int = 1) -> tuple[Array, NDArray[np.int64], NDArray[np.intp]]:
    """Columns (m, 8), row (m,) and stay (N,) of stays of one to four rows with two numbers each."""
    rng = np.random.default_rng(seed)
    stay = np.repeat(np.arange(50), rng.integers(1, 5, 50))
    row = np.repeat(np.arange(len(stay)), 2)
    of_stay = rng.normal(size=(50, 2, 8))
    return of_stay[stay].reshape(-1, 8) + 0.3 * rng.normal(size=(len(row), 8)), row, stay


def test_what_rows_of_a_stay_share_follows_from_the_whole_matrices() -> None:
    J, row, stay = model()
    rng = np.random.default_rng(2)
    e = rng.normal(size=(len(stay), 2)) + rng.normal(size=(50, 2))[stay]
    M = np.eye(len(J)) - J @ np.linalg.pinv(J)
    left = M @ e.ravel()
    found = stay_correlation(J, left, row, stay)
    assert found is not None
    K = np.kron(np.equal.outer(stay, stay) ^ np.eye(len(stay), dtype=bool), np.eye(2))
    Omega = np.eye(len(J)) + found.rho * K
    of_noise = np.trace(K @ M @ Omega @ M) / np.trace(M @ Omega)
    assert of_noise == pytest.approx(left @ K @ left / (left @ left), rel=1e-9)
    trace, H = np.trace(M @ Omega), np.linalg.pinv(J)
    np.testing.assert_allclose(found.covariance, H @ Omega @ H.T * (left @ left) / trace, rtol=1e-9)
    assert found.freedom == pytest.approx(trace**2 / np.trace(M @ Omega @ M @ Omega), rel=1e-9)
    assert found.noise == pytest.approx(np.sqrt((len(J) - 8) / trace), rel=1e-9)


def test_errors_are_as_large_as_stated_and_white_noise_shares_nothing() -> None:
    J, row, stay = model()
    rng = np.random.default_rng(3)
    M, H = np.eye(len(J)) - J @ np.linalg.pinv(J), np.linalg.pinv(J)
    over, seen, remembered, false = [], 0, 0, 0
    for _ in range(200):
        e = (rng.normal(size=(len(stay), 2)) + rng.normal(size=(50, 2))[stay]).ravel()
        found = stay_correlation(J, M @ e, row, stay)
        remembered += neighbour_correlation(*of_stays(J, M @ e, row, stay), 50) is not None
        if found is not None:
            seen += 1
            over.append(H @ e / np.sqrt(np.diag(found.covariance)))
        false += stay_correlation(J, M @ rng.normal(size=len(J)), row, stay) is not None
    assert seen == 200
    assert remembered <= 3  # white stays are taken for a memory in one of a thousand
    assert false <= 3
    assert np.std(over) == pytest.approx(1.0, abs=0.06)


def test_whitened_numbers_of_a_stay_are_as_white_noise() -> None:
    _, row, stay = model()
    K = np.kron(np.equal.outer(stay, stay) ^ np.eye(len(stay), dtype=bool), np.eye(2))
    W = whitened(np.eye(len(row)), row, stay, 0.6)
    np.testing.assert_allclose(W @ (np.eye(len(row)) + 0.6 * K) @ W.T, np.eye(len(row)), atol=1e-12)


def several_targets(arm: Robot, repeatability: float, seed: int) -> Dataset:
    """Three targets at the tool of a geometrically wrong arm, whose joints come to a posture a little off [rad]."""
    rng = np.random.default_rng(seed)
    q = random_poses(arm, 60, seed=seed)
    pose = perturbed(arm, seed=seed).forward(q + rng.normal(size=q.shape) * repeatability)
    points = pose[:, np.newaxis, :3, 3] + np.einsum("nij,tj->nti", pose[:, :3, :3], TARGETS)
    points += rng.normal(size=points.shape) * 1e-5
    mount = ["a", "b", "c"] * 60
    return Dataset.from_arrays(np.repeat(q, 3, axis=0), position=points.reshape(-1, 3), mount=mount, robot=arm)


def test_targets_of_one_posture_are_no_noise_that_drifts() -> None:
    arm = load_robot("ur10e")
    notes = calibrate(arm, several_targets(arm, 5e-5, seed=4)).notes
    assert any("in one posture" in note for note in notes)
    assert not any("drifts" in note or "an effect is missing" in note for note in notes)
    still = calibrate(arm, several_targets(arm, 0.0, seed=4)).notes
    assert not any("alike" in note or "drifts" in note for note in still)


def test_a_stay_ends_where_a_joint_moves_or_the_load_changes() -> None:
    q = np.repeat(np.array([[0.0, 0.1], [0.2, 0.1], [0.0, 0.1]]), 2, axis=0)
    data = Dataset.from_arrays(q, position=np.zeros((6, 3)), payload=[0, 0, 1, 0.5, 0, 0])
    np.testing.assert_array_equal(stays(data), [0, 0, 1, 2, 3, 3])
    later = replace(data, time=np.array([0.0, 5.0, 1.0, 2.0, 3.0, 6.0]))
    np.testing.assert_array_equal(stays(later), [0, 3, 1, 2, 3, 3])
