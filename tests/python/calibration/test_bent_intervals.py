# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Intervals of a fit that bends: their ends are those of the profile, searched for by scipy."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import optimize, stats

from fastcal.arrays import FloatArray
from fastcal.calibration.bent_intervals import reaches

X = np.linspace(0, 4, 12)


def curve(theta: FloatArray) -> FloatArray:
    return np.asarray(theta[0] * np.exp(-theta[1] * X) + theta[2])


def slopes(theta: FloatArray) -> FloatArray:
    falls = np.exp(-theta[1] * X)
    return np.column_stack([falls, -theta[0] * X * falls, np.ones_like(X)])


def fitted(y: FloatArray) -> tuple[Any, Any]:
    """A decay a exp(-b x) + c fitted to y, as `reaches` takes it."""
    least = optimize.least_squares(lambda t: curve(t) - y, [2.0, 0.5, 0.3], xtol=1e-14, ftol=1e-14, gtol=1e-14)
    near = SimpleNamespace(
        J=slopes(least.x), residual=curve(least.x) - y, free=[0, 1, 2], kept=np.ones(len(X), dtype=bool),
        theta=least.x, noise=[], place=np.arange(len(X)),
    )  # fmt: skip
    return near, SimpleNamespace(linearize=lambda t, _: SimpleNamespace(J=slopes(t), r=curve(t) - y))


def profile_end(near: Any, y: FloatArray, k: int, sign: float) -> float:
    """Where the least square of the other parameters has grown by F t^2 / (m - p), over half a straight interval."""
    freedom, square = len(X) - 3, float(near.residual @ near.residual)
    t = float(stats.t.ppf(0.975, freedom))
    half = t * np.sqrt(np.linalg.inv(near.J.T @ near.J)[k, k] * square / freedom)
    others = [i for i in range(3) if i != k]

    def beyond(size: float) -> float:
        def left(values: FloatArray) -> FloatArray:
            theta = near.theta.copy()
            theta[k] += sign * size * half
            theta[others] = values
            return curve(theta) - y

        return float(2 * optimize.least_squares(left, near.theta[others]).cost - square * (1 + t**2 / freedom))

    return float(optimize.brentq(beyond, 0.2, 6.0))


def test_the_ends_are_those_of_the_profile() -> None:
    y = curve(np.array([2.0, 0.5, 0.3])) + 0.15 * np.random.default_rng(1).standard_normal(len(X))
    near, problem = fitted(y)
    found = reaches(near, problem)
    for k in range(3):
        assert found[k] == pytest.approx([profile_end(near, y, k, -1.0), profile_end(near, y, k, 1.0)], abs=1e-3)
    assert found[0, 1] > 1.3  # a straight interval is too short there
    assert found[2, 1] < 0.8


def test_a_straight_fit_has_its_own_intervals() -> None:
    y = np.random.default_rng(2).standard_normal(len(X))
    A = np.column_stack([np.ones_like(X), X])
    near = SimpleNamespace(
        J=A, residual=A @ np.linalg.lstsq(A, y)[0] - y, free=[0, 1], kept=np.ones(len(X), dtype=bool),
        theta=np.linalg.lstsq(A, y)[0], noise=[], place=np.arange(len(X)),
    )  # fmt: skip
    problem: Any = SimpleNamespace(linearize=lambda t, _: SimpleNamespace(J=A, r=A @ t - y))
    assert reaches(near, problem) == pytest.approx(np.ones((2, 2)), abs=1e-9)  # type: ignore[arg-type]


def test_what_the_rows_do_not_object_to_has_no_end() -> None:
    y = curve(np.array([2.0, 0.5, 0.3])) + 1.0 * np.random.default_rng(5).standard_normal(len(X))
    found = reaches(*fitted(y))
    assert np.isinf(found).any()
    assert not np.isnan(found).any()
