# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joints that repeat badly: errors that grow with reach, found by restricted likelihood and allowed for."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import calibrate, load_robot, perturbed, random_poses
from fastcal.calibration.joint_noise import (
    FREEDOM_SHARE,
    JointNoise,
    grows_with_reach,
    hats,
    joint_repeatability,
    likeliest,
    likeliest_noise,
)
from fastcal.measurements.dataset import Dataset

Array = NDArray[np.float64]


def model(seed: int = 1) -> tuple[Array, Array, NDArray[np.intp]]:
    """Columns (m, 8), levers (m, 4) and posture (m,) of 70 postures with two, three or six numbers."""
    rng = np.random.default_rng(seed)
    posture = np.repeat(np.arange(70), rng.choice([2, 3, 6], 70))
    reach = rng.uniform(0.2, 2.0, 70)
    return rng.normal(size=(len(posture), 8)), reach[posture, None] * rng.normal(size=(len(posture), 4)), posture


def dense(lever: Array, posture: NDArray[np.intp], k: float) -> Array:
    """C (m, m)."""
    return np.eye(len(lever)) + k**2 * np.equal.outer(posture, posture) * (lever @ lever.T)


def test_two_numbers_moved_alike_by_one_joint() -> None:
    """By hand: C = [[1 + k^2, k^2], [k^2, 1 + k^2]] has the eigenvalues 1 along (1, -1), 1 + 2 k^2 along (1, 1)."""
    noise = JointNoise.of(np.ones((2, 1)), np.zeros(2, dtype=np.intp))
    W = noise.whitened(np.eye(2), 2.0)
    np.testing.assert_allclose(W @ [1, -1], [1, -1], atol=1e-12)
    np.testing.assert_allclose(W @ [1, 1], [1 / 3, 1 / 3], atol=1e-12)
    assert noise.log_determinant(2.0) == pytest.approx(np.log(9.0))
    assert noise.traces(2.0) == pytest.approx((8.0, 80.0))  # of C: 1 + 9, of C^2: 1 + 81


def test_numbers_in_any_order_are_whitened_by_the_dense_matrix() -> None:
    _, lever, posture = model()
    C = dense(lever, posture, 0.7)
    W = JointNoise.of(lever, posture).whitened(np.eye(len(C)), 0.7)
    np.testing.assert_allclose(W @ C @ W.T, np.eye(len(C)), atol=1e-9)
    np.testing.assert_allclose(JointNoise.of(lever, posture).colored(np.eye(len(C)), 0.7), C, atol=1e-9)
    again = JointNoise.of(lever, posture).whitened(W, 0.2, begun=0.7)
    np.testing.assert_allclose(again @ dense(lever, posture, 0.2) @ again.T, np.eye(len(C)), atol=1e-9)
    order = np.random.default_rng(0).permutation(len(C))
    mixed = JointNoise.of(lever[order], posture[order]).whitened(np.eye(len(C)), 0.7)
    np.testing.assert_allclose(mixed, W[np.ix_(order, order)], atol=1e-9)
    unmeasured = np.where(posture == 3, -1, posture)
    alone = JointNoise.of(lever, unmeasured).whitened(np.eye(len(C)), 0.7)
    np.testing.assert_array_equal(alone[posture == 3], np.eye(len(C))[posture == 3])


def restricted(X: Array, r: Array, C: Array) -> float:
    """-2 log of the restricted likelihood, but for a constant, from the dense matrices."""
    inverse = np.linalg.inv(C)
    A = X.T @ inverse @ X
    P = inverse - inverse @ X @ np.linalg.inv(A) @ X.T @ inverse
    return float(np.linalg.slogdet(C)[1] + np.linalg.slogdet(A)[1] + (len(r) - X.shape[1]) * np.log(r @ P @ r))


def test_the_likeliest_is_that_of_the_dense_matrices() -> None:
    X, lever, posture = model()
    rng = np.random.default_rng(3)
    r = np.linalg.cholesky(dense(lever, posture, 0.5)) @ rng.normal(size=len(X)) + X @ rng.normal(size=8)
    found, gain = likeliest(X, r, JointNoise.of(lever, posture), 0.1)
    sizes = np.exp(np.linspace(np.log(0.2), np.log(1.2), 200))
    every = np.array([restricted(X, r, dense(lever, posture, k)) for k in sizes])
    assert found == pytest.approx(sizes[np.argmin(every)], rel=0.05)
    assert gain == pytest.approx(restricted(X, r, np.eye(len(X))) - every.min(), abs=0.1)


def test_white_noise_hardly_ever_grows_with_reach_nor_does_one_with_heavy_tails() -> None:
    X, lever, posture = model()
    Q = np.linalg.qr(X)[0]
    rng = np.random.default_rng(4)
    for tails in (False, True):
        far = []
        for _ in range(400):
            e = rng.standard_t(3, len(X)) if tails else rng.normal(size=len(X))
            far.append(grows_with_reach(lever, e - Q @ (Q.T @ e), hats(Q, posture))[0])
        assert abs(np.mean(far)) < 0.2
        assert np.mean(np.array(far) > 3.0) < 0.02


def test_what_it_makes_of_a_fit_follows_from_the_dense_matrices() -> None:
    X, lever, posture = model()
    rng = np.random.default_rng(5)
    r = np.linalg.cholesky(dense(lever, posture, 1.0)) @ rng.normal(size=len(X))
    curves = rng.normal(size=(70, 3))[posture]
    found = joint_repeatability(X, r, lever, curves, posture, np.arange(70), np.arange(70))
    assert found is not None
    assert not found.by_stay
    assert 0.7 < found.k < 1.3
    C, H = dense(lever, posture, found.over_noise), np.linalg.pinv(X)
    M = np.eye(len(X)) - X @ H
    trace, left = np.trace(M @ C), M @ r
    np.testing.assert_allclose(found.fit.covariance, H @ C @ H.T * (left @ left) / trace, rtol=1e-7)
    assert found.fit.freedom == pytest.approx(trace**2 / np.trace(M @ C @ M @ C), rel=1e-7)
    assert found.fit.noise**2 == pytest.approx(np.trace(C) / len(X) / trace * (len(X) - 8), rel=1e-7)
    assert found.k == pytest.approx(found.over_noise * np.sqrt(left @ left / trace), rel=1e-7)


def test_smooth_errors_of_joints_are_no_noise() -> None:
    """Each joint errs by a curve of the posture that the model lacks; with the curves beside it nothing is left."""
    X, lever, posture = model()
    rng = np.random.default_rng(6)
    curves = rng.normal(size=(70, 5))
    bent = np.einsum("mn,mn->m", lever, (curves @ rng.normal(size=(5, 4)))[posture])
    r = bent + 0.01 * rng.normal(size=len(X))
    assert FREEDOM_SHARE * (len(r) - 8) > 20
    each, others = np.arange(70), rng.normal(size=(70, 1))
    assert joint_repeatability(X, r, lever, curves[posture], posture, each, each) is None
    assert joint_repeatability(X, r, lever, others[posture], posture, each, each) is not None


def test_errors_that_come_again_whenever_a_posture_is_visited_are_no_noise() -> None:
    """35 postures, each visited twice, not one after the other: joints stand off anew each time, or always alike."""
    rng = np.random.default_rng(7)
    row, command = np.repeat(np.arange(70), 3), np.tile(np.arange(35), 2)
    lever = (rng.uniform(0.2, 2.0, 35)[:, None, None] * rng.normal(size=(35, 3, 4)))[command].reshape(-1, 4)
    X, none = rng.normal(size=(210, 8)), np.arange(70)
    anew = np.einsum("mn,mn->m", lever, rng.normal(size=(70, 4))[row])
    alike = np.einsum("mn,mn->m", lever, rng.normal(size=(35, 4))[command[row]])
    found = [likeliest_noise(X, e + 0.1 * rng.normal(size=210), lever, row, none, command, 1.0) for e in (anew, alike)]
    assert found[0] is not None
    assert found[1] is None
    shared = likeliest_noise(X, alike + 0.1 * rng.normal(size=210), lever, row, command, command, 1.0)
    assert shared is not None
    assert shared.by_stay


def stopping(repeatability: float, seed: int, targets: int = 1, poses: int = 120) -> Dataset:
    """Points of an arm off by 0.5 mm and 0.5 mrad whose joints stop a little off; 0.05 mm of noise."""
    arm, rng = load_robot("staubli_rx160l"), np.random.default_rng(seed)
    tips = np.array([[0.05, 0.0, 0.1], [-0.05, 0.04, 0.1], [0.0, -0.06, 0.12]])[:targets]
    q = random_poses(arm, poses, seed=seed)
    pose = perturbed(arm, seed=seed).forward(q + repeatability * rng.normal(size=q.shape))
    points = pose[:, np.newaxis, :3, 3] + np.einsum("nij,tj->nti", pose[:, :3, :3], tips)
    mount = [f"smr{k}" for k in range(targets)] * poses if targets > 1 else None
    seen = points + 5e-5 * rng.normal(size=points.shape)
    return Dataset.from_arrays(np.repeat(q, targets, axis=0), position=seen.reshape(-1, 3), mount=mount, robot=arm)


@pytest.mark.parametrize("targets", [1, 3])
def test_a_calibration_says_how_well_the_joints_repeat(targets: int) -> None:
    said = calibrate("staubli_rx160l", stopping(1e-4, 1, targets))
    (note,) = [note for note in said.notes if "repeat to about" in note]
    size = float(note.partition("repeat to about ")[2].partition(" mrad")[0])
    assert 0.07 < size < 0.14
    assert not said.caveats
    assert not any("repeat" in note for note in calibrate("staubli_rx160l", stopping(0.0, 2, targets)).notes)
