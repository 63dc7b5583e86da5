# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows that were held out of linear fits."""

import numpy as np
import pytest

from fastcal.surrogate.evidence import held_out_squares


@pytest.mark.parametrize("spare", [False, True])
def test_held_out_rows_are_those_of_least_squares(spare: bool) -> None:
    random = np.random.default_rng(0)
    A, C, r = random.standard_normal((60, 4)), random.standard_normal((60, 3)), random.standard_normal(60)
    if spare:  # a column of nothing has no triangle
        A = np.column_stack([A, np.zeros(60)])
    held = np.arange(60) < 15
    alone, both = held_out_squares(A, C, r, held)
    x = np.linalg.lstsq(A[~held], r[~held], rcond=1e-12)[0]
    np.testing.assert_allclose(alone, (r[held] - A[held] @ x) ** 2, rtol=1e-8)
    whole = np.hstack([A, C])
    shrunk = np.vstack([whole[~held], np.hstack([np.zeros((3, A.shape[1])), np.eye(3)])])
    x = np.linalg.lstsq(shrunk, np.append(r[~held], np.zeros(3)), rcond=1e-12)[0]
    np.testing.assert_allclose(both, (r[held] - whole[held] @ x) ** 2, rtol=1e-8)
