# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The normal equations of a fold, where only one block's curvature changes."""

import numpy as np

from fastcal.calibration.smoothing import FOLDS, LinearProblem, _Search


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
