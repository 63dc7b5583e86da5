# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Regularized least squares against its normal equations, a pseudo-inverse, and cross-validation by its definition."""

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import regularized_least_squares
from fastcal.errors import InvalidInput

FloatArray = NDArray[np.float64]


def problem(seed: int = 0, weak: float = 1e-5) -> tuple[FloatArray, FloatArray, FloatArray]:
    """J (40, 6) whose last two columns are nearly one, a truth, and what was measured with noise 0.01."""
    random = np.random.default_rng(seed)
    J = random.standard_normal((40, 6))
    J[:, 5] = J[:, 4] + weak * random.standard_normal(40)
    x = random.standard_normal(6)
    return J, x, J @ x + 0.01 * random.standard_normal(40)


@pytest.mark.parametrize("strength", [0.0, 0.3, 20.0])
def test_levenberg_solves_the_damped_normal_equations(strength: float) -> None:
    J, _, r = problem(weak=1.0)
    sizes = np.array([1, 2, 0.5, 1, 3, 0.1])
    found = regularized_least_squares(J, r, strength=strength, sizes=sizes)
    N = J.T @ J + strength**2 * np.diag(1 / sizes**2)
    assert found.x == pytest.approx(np.linalg.solve(N, J.T @ r), rel=1e-9)
    assert found.used == pytest.approx(np.trace(J @ np.linalg.solve(N, J.T)), rel=1e-9)


def test_truncation_is_the_pseudo_inverse_of_the_first_singular_values() -> None:
    J, _, r = problem(weak=1.0)
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    found = regularized_least_squares(J, r, method="truncated", strength=4)
    assert found.x == pytest.approx(Vt[:4].T @ ((U.T @ r)[:4] / s[:4]), rel=1e-9)
    assert found.used == 4


@pytest.mark.parametrize("method", ["levenberg", "truncated"])
def test_cross_validation_takes_the_least_score(method: str) -> None:
    J, _, r = problem()
    best = regularized_least_squares(J, r, method=method)

    def score(strength: float) -> float:
        found = regularized_least_squares(J, r, method=method, strength=strength)
        return float(len(r) * ((r - J @ found.x) ** 2).sum() / (len(r) - found.used) ** 2)

    others = range(7) if method == "truncated" else best.strength * np.geomspace(1e-3, 1e3, 31)
    assert score(best.strength) <= min(score(float(at)) for at in others) * (1 + 1e-9)


@pytest.mark.parametrize(("method", "strength"), [("levenberg", 1.0), ("truncated", None)])
def test_nearly_redundant_parameters_no_longer_run_away(method: str, strength: float | None) -> None:
    plain, held = [], []
    for seed in range(10):
        J, x, r = problem(seed)
        plain.append(np.linalg.norm(np.linalg.lstsq(J, r, rcond=None)[0] - x))
        found = regularized_least_squares(J / 0.01, r / 0.01, method=method, strength=strength)
        held.append(np.linalg.norm(found.x - x))
    assert np.median(plain) > 50
    assert np.median(held) < 2  # the difference of the two, which no data tell, stays at 0


def test_what_is_wholly_redundant_gets_the_shortest_answer() -> None:
    J = np.array([[1.0, 1.0], [2.0, 2.0]])
    assert regularized_least_squares(J, [2.0, 4.0], strength=0.0).x == pytest.approx([1.0, 1.0])


def test_invalid_input_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"J must have shape \(m, P\) and r \(m,\)"):
        regularized_least_squares(np.ones((3, 2)), np.ones(2))
    with pytest.raises(InvalidInput, match="method must be one of levenberg, truncated, got 'ridge'"):
        regularized_least_squares(np.ones((3, 2)), np.ones(3), method="ridge")
    with pytest.raises(InvalidInput, match="strength must be a number that is not negative"):
        regularized_least_squares(np.ones((3, 2)), np.ones(3), strength=-1)
    with pytest.raises(InvalidInput, match="must be finite"):
        regularized_least_squares(np.full((3, 2), np.nan), np.ones(3))
