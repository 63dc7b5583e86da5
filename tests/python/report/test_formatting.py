# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from fastcal.report.formatting import (
    MISSING,
    alike,
    count,
    decimals_for,
    fixed,
    percent,
    plural,
    powered,
    rough,
    significant,
    with_uncertainty,
)

THIN = "\N{NARROW NO-BREAK SPACE}"


@pytest.mark.parametrize(
    ("std", "decimals"),
    [(0.0123, 3), (0.123, 2), (1.2, 1), (12.3, 0), (123.0, 0), (0.00998, 3), (0.00993, 4), (0.000999, 4), (0.0999, 2)],
)
def test_a_standard_deviation_has_two_significant_digits(std: float, decimals: int) -> None:
    assert decimals_for(std) == decimals


def test_values_have_the_decimals_of_their_deviation() -> None:
    assert with_uncertainty(0.0123, 127.3, 127.4667, -0.1) == ("0.012", "127.300", "127.467", "\N{MINUS SIGN}0.100")


def test_small_values_share_one_power_of_ten() -> None:
    assert with_uncertainty(2.2e-9, 0.0, 3.14159e-7) == (
        f"0.022{THIN}×{THIN}10⁻⁷",
        "0.000",
        f"3.142{THIN}×{THIN}10⁻⁷",
    )


def test_without_a_deviation_six_digits_stand() -> None:
    assert with_uncertainty(None, 127.3, 127.30001) == (MISSING, "127.300", "127.300")
    assert with_uncertainty(float("nan"), 0.0) == (MISSING, "0")


@pytest.mark.parametrize(
    ("number", "text"), [(-0.0004, "0.000"), (-0.4, "\N{MINUS SIGN}0.400"), (None, MISSING), (np.inf, MISSING)]
)
def test_fixed_has_no_negative_zero_and_a_true_minus(number: float | None, text: str) -> None:
    assert fixed(number, 3) == text


def test_texts_of_plain_numbers() -> None:
    assert [significant(x) for x in (0.10134, 1234.5, 0.09996, 0.0)] == ["0.101", "1234", "0.100", "0"]
    texts = [rough(x) for x in (0.0, 19.7, 15558.0, 999_999.0, -3_616_751_466.0)]
    gap = "\N{NARROW NO-BREAK SPACE}"
    assert texts == ["0", "20", "15558", f"1.0{gap}×{gap}10⁶", f"−3.6{gap}×{gap}10⁹"]
    assert [powered(x) for x in (11426.0, -3.2e-5)] == [f"1.14{gap}×{gap}10⁴", f"−3.20{gap}×{gap}10⁻⁵"]
    assert count(100_000) == f"100{THIN}000"
    assert [plural(1, "row"), plural(2, "row"), plural(0, "row")] == ["1 row", "2 rows", "0 rows"]
    assert [percent(0.2749), percent(0.0544), percent(0.0996)] == [f"27{THIN}%", f"5.4{THIN}%", f"10{THIN}%"]


@pytest.mark.parametrize(("like", "text"), [(0.1037, "0.613"), (0.078, "0.613"), (0.31, "0.61"), (0.0, "0.613")])
def test_alike_shows_both_numbers_of_a_pair_with_the_digits_of_the_smaller(like: float, text: str) -> None:
    assert alike(0.6126, like) == text
