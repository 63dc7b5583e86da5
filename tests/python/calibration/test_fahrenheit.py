# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Temperatures that look like degrees Fahrenheit are told: of all rows, of some, and none of an arm that warms up."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal import load_robot, simulate
from fastcal.calibration.inspection import check_columns
from fastcal.measurements.dataset import Dataset
from fastcal.units import from_si, to_si

ARM = load_robot("pmc6va030")
ROWS = 40
ROOM = np.linspace(19.0, 26.0, ROWS)  # [degC]


def notes(temperature: NDArray[np.float64]) -> list[str]:
    """What is said of these numbers in the column temperature_c."""
    q = np.random.default_rng(1).uniform(-1.5, 1.5, (ROWS, 6))
    rows = simulate(ARM, Dataset.from_arrays(q), noise=5e-5, seed=1)
    return check_columns(ARM, replace(rows, temperature=to_si(temperature, "c")))


def test_a_degree_fahrenheit_is_what_others_say() -> None:
    freezing, boiling = to_si(32.0, "f"), to_si(212.0, "f")
    assert (freezing, boiling) == pytest.approx((273.15, 373.15), rel=1e-15)


def test_all_rows_in_fahrenheit() -> None:
    (said,) = notes(from_si(to_si(ROOM, "c"), "f"))
    assert "temperature_c is between 66.2 and 78.8: if these are degrees Fahrenheit" in said


def test_some_rows_in_fahrenheit() -> None:
    mixed = np.where(np.arange(ROWS) % 4 == 1, ROOM * 1.8 + 32.0, ROOM)
    assert notes(mixed) == [
        "temperature_c of 10 rows (1, 5, 9 ...) looks like degrees Fahrenheit beside that of the others"
    ]


@pytest.mark.parametrize(
    "temperature",
    [ROOM, np.linspace(20.0, 65.0, ROWS), np.where(np.arange(ROWS) < 5, 5.0, 115.0)],
    ids=["room", "warms up", "too hot"],
)
def test_degrees_celsius_are_believed(temperature: NDArray[np.float64]) -> None:
    assert notes(temperature) == []
