# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The normal equations of a fold, where only one block's curvature changes."""

import numpy as np

from fastcal.calibration.smoothing import _GRID, FOLDS, LinearProblem, _Search


def test_the_rest_eliminated_once_solves_as_all_at_once() -> None:
    random = np.random.default_rng(0)
    J = random.standard_normal((300, 25))
    blocks = [np.arange(5, 15), np.arange(15, 25)]
    penalties = [np.r_[0.0, np.linspace(1.0, 40.0, 9)]] * 2
    row = np.repeat(np.arange(100), 3)
    search = _Search(LinearProblem(J, random.standard_normal(300), row, blocks, penalties, np.full(25, 100.0)))
    begun = np.array([-1.0, -2.0])
    for fold in range(FOLDS):
        for block in range(2):
            solve = search._beside(block, begun, fold)
            for exponent in (-4.0, 0.5):
                log_s = begun.copy()
                log_s[block] = exponent
                expected = search._solve(*search._others[fold], log_s)
                np.testing.assert_allclose(solve(log_s), expected, rtol=0, atol=1e-12)


def test_of_a_common_curvature_every_other_one_shows_where_the_best_is() -> None:
    random = np.random.default_rng(1)
    J = random.standard_normal((300, 25))
    truth = np.r_[random.standard_normal(5), 0.03 * random.standard_normal(20)]
    problem = LinearProblem(
        J,
        J @ truth + 0.3 * random.standard_normal(300),
        np.repeat(np.arange(100), 3),
        [np.arange(5, 15), np.arange(15, 25)],
        [np.ones(10)] * 2,
        np.full(25, 100.0),
    )
    found, whole = _Search(problem).common(_GRID), _Search(problem)
    errors = {s: whole._error(np.full(2, s)) for s in _GRID}
    best = min(errors, key=errors.__getitem__)
    errors |= {s: whole._error(np.full(2, s)) for s in (best - 0.25, best + 0.25)}
    np.testing.assert_array_equal(found, np.full(2, min(errors, key=errors.__getitem__)))
    assert -3.0 < found[0] < 0.0


def test_columns_that_are_one_are_solved_whatever_the_noise_of_the_rows() -> None:
    # Rows without noise weigh so much that a weak pull is lost beside them.
    random = np.random.default_rng(2)
    J = 1e12 * random.standard_normal((300, 25))
    J[:, 4] = J[:, 3]
    truth = random.standard_normal(25)
    search = _Search(
        LinearProblem(J, J @ truth, np.repeat(np.arange(100), 3), [np.arange(5, 25)], [np.ones(20)], np.full(25, 100.0))
    )
    found = search._solve(search._A, search._g, np.array([1.0]))
    np.testing.assert_allclose(J @ found, J @ truth, rtol=0, atol=1e-6 * np.abs(J @ truth).max())
    assert np.isfinite(search.common(_GRID)).all()
