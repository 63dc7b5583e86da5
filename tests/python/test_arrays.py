# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Singular values where LAPACK's usual routine gives up."""

from __future__ import annotations

from typing import NoReturn

import numpy as np
import pytest

from fastcal.arrays import thin_svd


def gives_up(*_: object, **__: object) -> NoReturn:
    raise np.linalg.LinAlgError("SVD did not converge")


@pytest.mark.parametrize("is_tall", [True, False])
@pytest.mark.parametrize("fails", [True, False])
def test_a_matrix_of_low_rank(is_tall: bool, fails: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(1)
    A = random.normal(size=(40, 3)) @ random.normal(size=(3, 7))
    A = A if is_tall else A.T
    expected = np.linalg.svd(A, compute_uv=False)
    if fails:
        monkeypatch.setattr(np.linalg, "svd", gives_up)
    U, s, Vt = thin_svd(A)
    assert (U.shape, s.shape, Vt.shape) == ((A.shape[0], 7), (7,), (7, A.shape[1]))
    np.testing.assert_allclose(s, expected, atol=1e-12)
    np.testing.assert_allclose(U * s @ Vt, A, atol=1e-12)


def test_a_matrix_that_is_not_finite_is_refused_as_numpy_does() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        thin_svd(np.array([[1.0, np.nan], [0.0, 1.0]]))
