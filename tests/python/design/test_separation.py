# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses that tell causes apart: D and its gains by numpy's least squares, and the chosen poses by trying all."""

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from fastcal.design import separating_poses
from fastcal.errors import InvalidInput

Array = NDArray[np.float64]


def left_over(common: Array, causes: list[Array], expected: list[Array], i: int, j: int) -> float:
    """D_ij of rows (n, columns): what least squares on [A, C_j] leaves of C_i b_i."""
    u = causes[i] @ expected[i]
    X = np.hstack([common, causes[j]])
    return float(np.sum((u - X @ np.linalg.lstsq(X, u, rcond=1e-12)[0]) ** 2))


def problem(n: int, k: int = 3, seed: int = 0) -> tuple[Array, list[Array], list[Array]]:
    random = np.random.default_rng(seed)
    common = random.standard_normal((n, k, 5))
    common[:, :, 4] = common[:, :, 3]  # a direction that nothing can tell
    first = random.standard_normal((n, k, 2))
    second = first[:, :, :1] + 0.2 * random.standard_normal((n, k, 1))  # nearly the same
    return common, [first, second], [np.diag([0.7, 0.3]), np.array([[0.5]])]


def test_separations_before_and_after_are_what_least_squares_leaves() -> None:
    common, causes, expected = problem(40)
    earlier = slice(0, 10)
    rows = [block[earlier].reshape(30, -1) for block in (common, *causes)]
    stacked = np.hstack(rows)
    found = separating_poses(common[10:], [c[10:] for c in causes], expected, 4, prior=stacked.T @ stacked, threads=2)
    taken = [*range(10), *(10 + c for c in found.chosen)]
    for i, j in ((0, 1), (1, 0)):
        assert found.before[i, j] == pytest.approx(left_over(rows[0], rows[1:], expected, i, j), rel=1e-6)
        all_rows = [block[taken].reshape(len(taken) * 3, -1) for block in (common, *causes)]
        assert found.after[i, j] == pytest.approx(left_over(all_rows[0], all_rows[1:], expected, i, j), rel=1e-6)
    assert len(set(found.chosen)) == 4


def test_one_more_pose_is_the_best_of_all() -> None:
    common, causes, expected = problem(30, seed=1)
    stacked = np.hstack([block[:8].reshape(24, -1) for block in (common, *causes)])
    chosen = separating_poses(common[8:], [c[8:] for c in causes], expected, 1, prior=stacked.T @ stacked).chosen

    def worth(candidate: int) -> float:
        taken = [*range(8), 8 + candidate]
        rows = [block[taken].reshape(27, -1) for block in (common, *causes)]
        return float(np.prod([1 + left_over(rows[0], rows[1:], expected, i, 1 - i) for i in (0, 1)]))

    assert chosen == [int(np.argmax([worth(c) for c in range(22)]))]


def test_from_nothing_greedy_is_close_to_the_best_of_all_sets() -> None:
    common, causes, expected = problem(12, seed=2)
    found = separating_poses(common, causes, expected, 6)

    def worth(taken: tuple[int, ...]) -> float:
        rows = [block[list(taken)].reshape(len(taken) * 3, -1) for block in (common, *causes)]
        return float(np.prod([1 + left_over(rows[0], rows[1:], expected, i, 1 - i) for i in (0, 1)]))

    every = [worth(taken) for taken in itertools.combinations(range(12), 6)]
    assert worth(tuple(found.chosen)) >= np.quantile(every, 0.9)
    assert found.before.max() == 0


def test_it_stops_where_the_power_is_reached_and_power_is_that_of_the_test() -> None:
    common, causes, _ = problem(200, seed=3)
    found = separating_poses(common, causes, [np.ones(2), np.array([2.0])], 100, until_power=0.9, level=0.05)
    assert len(found.chosen) < 100
    assert np.nanmin(found.power_after) >= 0.9
    limit = stats.chi2.isf(0.05, 1)
    assert found.power_after[1, 0] == pytest.approx(1 - stats.ncx2.cdf(limit, 1, found.after[1, 0]), rel=1e-9)
    with pytest.raises(InvalidInput, match="until_power"):
        separating_poses(common, causes, [np.ones(2), np.ones(1)], 5, until_power=1.0)


def test_causes_with_the_same_effect_are_never_separated() -> None:
    common, causes, _ = problem(50, seed=4)
    twins = [causes[1], 2 * causes[1]]
    found = separating_poses(common, twins, [np.ones(1), np.ones(1)], 20)
    assert found.after.max() < 1e-6
    assert np.nanmax(found.power_after) == pytest.approx(0.01, abs=1e-4)


def test_shapes_that_do_not_fit_are_refused() -> None:
    common, causes, expected = problem(10)
    with pytest.raises(InvalidInput, match="one N and k"):
        separating_poses(common[:9], causes, expected, 1)
    with pytest.raises(InvalidInput, match="cause 1 must have"):
        separating_poses(common, causes, [expected[0], np.ones(3)], 1)
    with pytest.raises(InvalidInput, match="earlier information"):
        separating_poses(common, causes, expected, 1, prior=np.eye(3))
