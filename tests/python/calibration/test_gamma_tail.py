# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The tail of the gamma law against SciPy's."""

import math

import numpy as np
import pytest
from scipy import special

from fastcal.calibration.gamma_tail import gamma_tail


def test_the_tail_is_scipys_on_both_sides_of_the_mean() -> None:
    random = np.random.default_rng(0)
    a = 10 ** random.uniform(-1, 4, 2000)
    x = a * 10 ** random.uniform(-2, 1, 2000)
    found = [gamma_tail(*pair) for pair in zip(a, x, strict=True)]
    np.testing.assert_allclose(found, special.gammaincc(a, x), rtol=1e-10, atol=1e-12)


def test_a_small_tail_keeps_its_digits() -> None:
    assert gamma_tail(3.0, 200.0) == pytest.approx(float(special.gammaincc(3.0, 200.0)), rel=1e-12)


@pytest.mark.parametrize(("x", "tail"), [(0.0, 1.0), (math.inf, 0.0)])
def test_the_ends(x: float, tail: float) -> None:
    assert gamma_tail(2.5, x) == tail


def test_what_is_no_number_stays_none() -> None:
    assert math.isnan(gamma_tail(2.5, math.nan))
