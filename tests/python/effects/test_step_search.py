# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The moment of a step, on linear problems whose answer is known."""

import numpy as np
import pytest

from fastcal.calibration.change_point import find_step, gains
from fastcal.calibration.row_weights import HUBER, huber_weights


def problem(at: int, size: float, outliers: int = 0) -> tuple[np.ndarray, ...]:
    """100 rows of three numbers, eight other parameters, a step of six from row `at` on; noise 1."""
    random = np.random.default_rng(at)
    row = np.repeat(np.arange(100), 3)
    time = np.arange(100.0) * 10
    others, step = random.normal(0, 1, (300, 8)), random.normal(0, 1, (300, 6))
    residual = others @ random.normal(0, 5, 8) + (step @ np.full(6, size)) * (row >= at) + random.normal(0, 1, 300)
    wrong = random.choice(100, outliers, replace=False)
    residual[np.isin(row, wrong)] += random.normal(0, 60, 3 * outliers)
    return others, step, residual, row, time


@pytest.mark.parametrize("at", [3, 40, 41, 97])
def test_the_step_lies_between_its_two_rows(at: int) -> None:
    others, step, residual, row, time = problem(at, 4.0)
    assert find_step(others, step, residual, row, time) == (10 * at - 5, 10)


def test_rows_need_no_order() -> None:
    others, step, residual, row, time = problem(40, 4.0)
    mixed = np.random.default_rng(1).permutation(len(row))
    assert find_step(others[mixed], step[mixed], residual[mixed], row[mixed], time) == (395, 10)


def test_outliers_do_not_move_it() -> None:
    others, step, residual, row, time = problem(60, 4.0, outliers=6)
    assert find_step(others, step, residual, row, time) == (595, 10)


def test_a_direction_that_others_have_too_is_no_obstacle() -> None:
    others, step, residual, row, time = problem(40, 4.0)
    both = np.hstack([others, others[:, :2], np.zeros((300, 1))])
    assert find_step(both, step, residual, row, time) == (395, 10)


def test_one_moment_has_no_step() -> None:
    others, step, residual, row, _ = problem(40, 4.0)
    assert find_step(others, step, residual, row, np.full(100, 7.0)) == (7.0, 0.0)


def test_weights_are_hubers_on_whole_rows() -> None:
    row = np.repeat(np.arange(5), 2)
    left = np.repeat([1.0, -1.0, 1.0, 1.0, 30.0], 2)
    assert huber_weights(left, row) == pytest.approx([1] * 8 + [HUBER / 30] * 2)


def test_what_others_explain_wholly_gains_nothing() -> None:
    """Only rounding is left of such columns; scaled to unit length it was infinite, and the eigenvalues failed."""
    own = np.ones((1, 2, 2))
    for excess in (-1e-16, 0.0, 1e-15):
        coupling = np.full((1, 2, 1), 1 + excess)
        assert gains(own, coupling, np.full((1, 2), 1e-9)).tolist() == [0.0]


def test_a_motion_that_moves_nothing_gains_nothing() -> None:
    assert gains(np.zeros((1, 2, 2)), np.zeros((1, 2, 3)), np.zeros((1, 2))).tolist() == [0.0]


def test_the_gain_is_that_of_least_squares() -> None:
    others, step, residual, _, _ = problem(40, 4.0)
    Q, _ = np.linalg.qr(others)
    clean = residual - Q @ (Q.T @ residual)
    both = np.hstack([others, step])
    left = residual - both @ np.linalg.lstsq(both, residual, rcond=None)[0]
    (gain,) = gains((step.T @ step)[np.newaxis], (step.T @ Q)[np.newaxis], (step.T @ clean)[np.newaxis])
    assert gain == pytest.approx(clean @ clean - left @ left, rel=1e-10)
