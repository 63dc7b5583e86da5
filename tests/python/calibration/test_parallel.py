# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pieces of work side by side, and products of tall matrices that are shared out in parts of their rows."""

import threading
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from threadpoolctl import threadpool_info, threadpool_limits

from fastcal.calibration import tall
from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.columns import column_lengths, unit_columns, without_nil
from fastcal.calibration.parallel import each, one_blas_thread, workers
from fastcal.calibration.simulation import simulate
from fastcal.io.robot_file import load_robot

FloatArray = NDArray[np.float64]


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_results_come_in_the_order_of_the_items(threads: int) -> None:
    first = threading.Event()

    def work(item: int) -> int:
        if item == 0 and threads > 1:
            first.wait(5.0)  # ends after the others
        elif item > 0:
            first.set()
        return item * item

    with workers(threads):
        assert each(work, range(5)) == [0, 1, 4, 9, 16]


def test_one_thread_does_all_where_there_are_no_workers() -> None:
    own, both = threading.get_ident(), threading.Barrier(2, timeout=5.0)

    def together(_: int) -> int:
        both.wait()
        return threading.get_ident()

    assert each(lambda _: threading.get_ident(), range(3)) == [own] * 3
    with workers(2):
        pair = each(together, range(2))
    assert own in pair
    assert len(set(pair)) == 2
    assert each(lambda _: threading.get_ident(), range(3)) == [own] * 3


def test_a_single_item_is_worked_out_by_the_caller_who_shares_its_pieces_out() -> None:
    both = threading.Barrier(2, timeout=5.0)

    def together(_: int) -> int:
        both.wait()
        return threading.get_ident()

    with workers(2):
        (pair,) = each(lambda _: each(together, range(2)), iter([0]))
    assert len(set(pair)) == 2


def test_a_piece_of_work_shares_nothing_out() -> None:
    """Else all threads could wait for pieces that none is left to do."""

    def within(_: int) -> bool:
        own = threading.get_ident()
        return set(each(lambda _: threading.get_ident(), range(3))) == {own}

    with workers(2):
        assert all(each(within, range(4)))


@pytest.mark.parametrize("threads", [1, 2])
def test_the_first_error_is_raised(threads: int) -> None:
    def work(item: int) -> None:
        if item > 1:
            raise ValueError(str(item))

    with pytest.raises(ValueError, match="2"), workers(threads):
        each(work, range(4))


def tall_matrix(p: int, seed: int) -> FloatArray:
    return np.random.default_rng(seed).standard_normal((3001, p))


A, B = tall_matrix(230, 0), tall_matrix(90, 1)
L = np.linalg.cholesky(A.T @ A)
WIDE, MOST, ORDER = tall_matrix(620, 2), np.arange(5, 615), np.random.default_rng(3).permutation(3001)
PRODUCTS: dict[str, tuple[Callable[[], FloatArray], FloatArray]] = {
    "gram": (lambda: tall.gram(A), A.T @ A),
    "gram, column by column": (lambda: tall.gram(np.asfortranarray(A)), A.T @ A),
    "inner": (lambda: tall.inner(A, B), A.T @ B),
    "inner with a vector": (lambda: tall.inner(WIDE, WIDE[:, 0]), WIDE.T @ WIDE[:, 0]),
    "times": (lambda: tall.times(A, B[:230]), A @ B[:230]),
    "times a vector": (lambda: tall.times(WIDE, WIDE[0]), WIDE @ WIDE[0]),
    "taken": (lambda: tall.taken(WIDE, ORDER), WIDE[ORDER]),
    "taken, columns": (lambda: tall.taken(WIDE, MOST, axis=1), WIDE[:, MOST]),
    "column_lengths": (lambda: column_lengths(WIDE), np.linalg.norm(WIDE, axis=0)),
    "unit_columns": (lambda: unit_columns(WIDE), WIDE / np.linalg.norm(WIDE, axis=0)),
    "over": (lambda: tall.over(A, L), np.linalg.solve(L, A.T).T),
}


@pytest.mark.parametrize("name", PRODUCTS)
def test_products_are_those_of_whole_matrices_on_any_number_of_threads(name: str) -> None:
    product, expected = PRODUCTS[name]
    assert len(tall.parts(len(A), A.shape[1] * B.shape[1])) > 1
    assert len(tall.moved(len(WIDE), len(MOST))) > 1
    with workers(1):
        alone = product()
    np.testing.assert_allclose(alone, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    for threads in (2, 3, 8):
        with workers(threads):
            np.testing.assert_array_equal(product(), alone)


def test_single_precision_is_that_of_each_number() -> None:
    with workers(2):
        np.testing.assert_array_equal(tall.single(WIDE), WIDE.astype(np.float32))


def test_columns_of_several_matrices_stand_side_by_side_without_those_that_are_nil() -> None:
    nil = np.zeros((3, 1))
    first, second = np.diag([3.0, 4.0, 5.0]), np.hstack([nil, np.full((3, 1), 2.0), nil])
    expected = np.hstack([np.eye(3), np.full((3, 1), 1 / np.sqrt(3))])
    np.testing.assert_allclose(unit_columns(first, second), expected, rtol=1e-15)
    assert unit_columns(nil).shape == (3, 0)
    np.testing.assert_array_equal(without_nil(second), np.full((3, 1), 2.0))
    assert without_nil(first) is first


def test_few_rows_are_not_shared_out() -> None:
    assert tall.parts(100, 60.0**2) == [slice(0, 100)]
    assert tall.parts(0, 1e9) == [slice(0, 0)]
    np.testing.assert_array_equal(tall.gram(A[:0]), np.zeros((230, 230)))


def _threads_of_blas() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_calibrate_keeps_blas_to_one_thread_and_gives_the_others_back() -> None:
    robot = load_robot("ur5")
    data = simulate(robot, np.random.default_rng(0).uniform(-2, 2, (40, 6)), noise=5e-5)
    seen: list[set[int]] = []
    with threadpool_limits(2, user_api="blas"):
        calibrate(robot, data, progress=lambda _: seen.append(_threads_of_blas()))
        with one_blas_thread(), one_blas_thread():
            seen.append(_threads_of_blas())
        assert _threads_of_blas() == {2}
    assert len(seen) > 1
    assert all(threads == {1} for threads in seen)
