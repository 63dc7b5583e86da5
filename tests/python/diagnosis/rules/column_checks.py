# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns under suspicion: which readings are tried, and what one must do to be believed."""

from types import SimpleNamespace
from unittest import mock

import numpy as np

from fastcal.diagnosis import suspect_columns

from .mutants import falls_with


def leaves_half(beyond: float, plain: float) -> bool:
    """Of 200 degrees of freedom chi square may be 100 beyond them by noise."""
    fits = (SimpleNamespace(converged=True, freedom=200.0, remaining=200.0 + more) for more in (beyond, plain))
    return suspect_columns._leaves_half(*fits)


@falls_with(READING_DEVIATIONS=0.0)
@falls_with(READING_DEVIATIONS=1e9)
@falls_with(READING_SHARE=0.0)
@falls_with(READING_SHARE=1e9)
def a_reading_leaves_noise_and_half_of_the_rest() -> None:
    assert leaves_half(60.0, 400.0)
    assert not leaves_half(120.0, 1000.0)
    assert not leaves_half(60.0, 100.0)


def readings(*payloads: float) -> str:
    data = SimpleNamespace(payload=np.tile(payloads, 6), time=None)
    return " ".join(reading.words for reading in suspect_columns._readings(data))


@falls_with(MAX_PAYLOADS=1)
@falls_with(MAX_PAYLOADS=100)
def two_of_a_few_payloads_may_be_exchanged() -> None:
    assert "with 3 and 8 kg exchanged" in readings(3.0, 8.0)
    assert "exchanged" not in readings(1.0, 2.0, 4.0, 7.0, 11.0)


@falls_with(LOAD_FALLS=())
def a_load_may_be_used_up() -> None:
    assert "falls by 50% from the first row to the last" in readings(3.0)


def rows_that_do_not_carry(
    share: float, *, misses: bool = True, another: bool = True
) -> suspect_columns.Reading | None:
    """A share of the rows says 0 kg, and the others, of 5 and 10 kg, are fitted to the noise without these alone."""
    payload = np.where(np.arange(100) < 100 * share, 0.0, np.where(np.arange(100) % 2 == 0, 5.0, 10.0))
    problem = mock.Mock()
    problem.data.payload = payload
    problem.used = np.ones(100, dtype=bool)
    problem.with_rows = lambda used: used
    at = SimpleNamespace(problem=problem, remaining=400.0, freedom=200.0)

    def fit(used: np.ndarray, names: object, start: object) -> SimpleNamespace:
        is_right = not used[payload == 0].any()
        return SimpleNamespace(converged=True, freedom=200.0, remaining=200.0 if is_right else 900.0)

    plain, best = SimpleNamespace(fit=at, names=()), SimpleNamespace(fit=at)
    with (
        mock.patch.object(suspect_columns, "fit", fit),
        mock.patch.object(suspect_columns, "_misses", return_value=misses),
        mock.patch.object(suspect_columns, "_carry_another", return_value=another),
    ):
        return suspect_columns._labels(plain, best)


@falls_with(MIN_PAYLOAD_SHARE=0.0)
@falls_with(MIN_PAYLOAD_SHARE=0.5)
@falls_with(MAX_PAYLOADS=1)
@falls_with(CLEARLY_LESS=0.1)
def rows_of_one_payload_may_not_carry_it() -> None:
    found = rows_that_do_not_carry(0.4)
    assert found is not None
    assert found.without is not None
    assert len(found.without) == 40
    assert rows_that_do_not_carry(0.1) is None
    assert rows_that_do_not_carry(0.4, misses=False) is None
    assert rows_that_do_not_carry(0.4, another=False) is None


@falls_with(CLEARLY_LESS=0.1)
@falls_with(CLEARLY_LESS=1.0)
def these_rows_must_be_missed_by_more_than_noise() -> None:
    def misses(square: float) -> bool:
        near = SimpleNamespace(row=np.arange(50), r=np.full(50, np.sqrt(square)), J=np.zeros((50, 2)))
        problem = SimpleNamespace(rows=np.arange(50), noise=SimpleNamespace(factor=1.0))
        every = SimpleNamespace(problem=problem, near=near)
        rest = SimpleNamespace(on_every_row=every, free=[0, 1], covariance=np.eye(2))
        return suspect_columns._misses(rest, np.ones(50, dtype=bool), 1.0)

    assert misses(2.0)
    assert not misses(1.1)
