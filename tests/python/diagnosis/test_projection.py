# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Score tests by matrix products against the core's own projection by a QR of the rows."""

from __future__ import annotations

import numpy as np
import pytest

from fastcal import _core
from fastcal.diagnosis.projection import basis, root, root_again, score_tests, score_tests_beside

SIZES = [4, 5, 1, 2]


@pytest.mark.parametrize("rows", [14, 400], ids=["more columns than rows", "a triangle"])
def test_the_tests_are_those_of_the_rows(rows: int) -> None:
    random = np.random.default_rng(3)
    A, C, r = random.normal(size=(rows, 6)), random.normal(size=(rows, 12)), random.normal(size=rows)
    A[:, 5] = 1e3 * (A[:, 0] - A[:, 1])  # dependent, in another unit
    C[:, 9] = A[:, 2]  # absorbed
    C[:, 10:] = C[:, :2]  # a twin: the columns have no full rank
    C[:, 3] = 0.0
    C *= np.logspace(-6, 6, 12)
    expected, found = _core.ScoreTests(A, C, r, SIZES), score_tests(basis(A), C, r, SIZES)
    assert found.null_rank == expected.null_rank == 5
    np.testing.assert_array_equal(found.scores.rank, expected.scores.rank)
    for name in ("surviving", "estimate"):
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=1e-6, atol=1e-12)
    rounding = 1e-12 * np.linalg.norm(C, axis=0)
    assert (np.abs(np.asarray(found.length) - expected.length) <= rounding + 1e-6 * np.asarray(expected.length)).all()
    np.testing.assert_allclose(found.scores.statistic, expected.scores.statistic, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(found.remaining, expected.remaining, rtol=1e-9)
    np.testing.assert_allclose(found.given([0]).statistic, expected.given([0]).statistic, rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(found.correlation([0, 1], [1, 3]), expected.correlation([0, 1], [1, 3]), rtol=1e-7)


def test_a_basis_holds_no_direction_that_rounding_makes() -> None:
    """Products of dependent columns are definite or not by chance."""
    for seed in range(60):
        random = np.random.default_rng(seed)
        A = random.normal(size=(400, 6))
        A[:, 5] = A[:, :5] @ random.normal(size=5)
        Q = basis(A)
        assert Q.shape == (400, 5), seed
        np.testing.assert_allclose(Q.T @ Q, np.eye(5), atol=1e-12)
        np.testing.assert_allclose(Q @ (Q.T @ A), A, atol=1e-11)


def test_products_of_the_columns_alone_give_the_same_tests() -> None:
    random = np.random.default_rng(7)
    A, C, r = random.normal(size=(400, 6)), random.normal(size=(400, 12)), random.normal(size=400)
    A[:, 5] = A[:, 4] + 1e-3 * A[:, 5]  # of condition 1e6 squared
    C[:, 4] = A[:, 5] + 1e-2 * C[:, 4]  # of which hardly anything is left
    C[:, 9] = A[:, 2]  # absorbed
    A *= np.logspace(-3, 3, 6)
    C *= np.logspace(-6, 6, 12)
    expected, found = _core.ScoreTests(A, C, r, SIZES), score_tests_beside(A, A.T @ A, C, r, SIZES)
    assert found is not None
    np.testing.assert_array_equal(found.scores.rank, expected.scores.rank)
    np.testing.assert_allclose(found.scores.statistic, expected.scores.statistic, rtol=1e-7)
    np.testing.assert_allclose(found.estimate, expected.estimate, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(found.remaining, expected.remaining, rtol=1e-10)


def test_products_are_refused_where_rounding_decides_and_where_rows_are_few() -> None:
    random = np.random.default_rng(8)
    A, C, r = random.normal(size=(400, 6)), random.normal(size=(400, 12)), random.normal(size=400)
    assert score_tests_beside(A[:14], A[:14].T @ A[:14], C[:14], r[:14], SIZES) is None
    A[:, 5] = A[:, 4] + 1e-5 * A[:, 5]
    assert score_tests_beside(A, A.T @ A, C, r, SIZES) is None


def test_columns_that_move_nothing_and_no_columns_say_nothing() -> None:
    random = np.random.default_rng(5)
    A, r = random.normal(size=(40, 3)), random.normal(size=40)
    for C, sizes in ((np.zeros((40, 2)), [2]), (np.zeros((40, 0)), [])):
        expected, found = _core.ScoreTests(A, C, r, sizes), score_tests(basis(A), C, r, sizes)
        np.testing.assert_array_equal(found.scores.rank, expected.scores.rank)
        np.testing.assert_allclose(found.remaining, expected.remaining)


def test_a_basis_spans_what_the_columns_do() -> None:
    random = np.random.default_rng(4)
    A = random.normal(size=(30, 4)) * [1e-9, 1.0, 1e6, 1.0]
    A[:, 3] = A[:, 1]
    Q = basis(A)
    assert Q.shape == (30, 3)
    np.testing.assert_allclose(Q.T @ Q, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(Q @ (Q.T @ A), A, rtol=1e-9, atol=1e-15)


def test_a_root_of_the_normal_matrix_is_refused_where_it_would_be_inexact() -> None:
    random = np.random.default_rng(6)
    A = np.linalg.qr(random.normal(size=(50, 4)))[0]
    L = root(A.T @ A)
    assert L is not None
    np.testing.assert_allclose(L, np.eye(4), atol=1e-14)
    A[:, 3] = A[:, 2] + 1e-4 * A[:, 3]  # of condition 1e8 squared
    assert root(A.T @ A) is None
    A[:, 3] = A[:, 2]
    assert root(A.T @ A) is None


def test_columns_that_are_nearly_alike_have_the_triangle_of_a_qr() -> None:
    random = np.random.default_rng(6)
    A = random.standard_normal((200, 8))
    A[:, 7] = A[:, 6] + 1e-5 * A[:, 7]
    A /= np.linalg.norm(A, axis=0)
    assert root(A.T @ A) is None
    L = root_again(A, np.ones(8), A.T @ A)
    assert L is not None
    R = np.linalg.qr(A)[1]
    np.testing.assert_allclose(L, (R * np.sign(np.diag(R))[:, np.newaxis]).T, rtol=0, atol=1e-14)
    A[:, 7] = A[:, 6]
    assert root_again(A, np.ones(8), A.T @ A) is None
