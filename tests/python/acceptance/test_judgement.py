# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Guard bands: what passes, what fails, and where the measurement can't decide."""

import math

import numpy as np
import pytest
from scipy import stats

from fastcal.acceptance.figures import Figure, jackknife
from fastcal.acceptance.judgement import judged, least_sure, overall, parsed_limits
from fastcal.budget import combined
from fastcal.errors import InvalidInput


def ap(value: float, u: float, freedom: float = math.inf):
    return judged(Figure("AP", "P1", "m", value), combined(u, freedom, []), parsed_limits({"ap_mm": 0.5}))


def test_a_guard_band_is_the_one_sided_quantile() -> None:
    """u = 10 um, nu = 9: t = 1.833, so 0.5 mm is kept up to 0.4817 mm and exceeded from 0.5183 mm."""
    guard = 1e-5 * stats.t.ppf(0.95, 9)
    assert ap(4e-4, 1e-5, 9).guard == pytest.approx(guard)
    assert guard == pytest.approx(1.8331e-5, rel=1e-4)
    for value, verdict in (
        (5e-4 - 1.01 * guard, "pass"),
        (5e-4 - 0.99 * guard, "cannot_tell"),
        (5e-4 + 0.99 * guard, "cannot_tell"),
        (5e-4 + 1.01 * guard, "fail"),
    ):
        assert ap(value, 1e-5, 9).verdict == verdict


def test_on_the_limit_the_odds_are_even() -> None:
    assert ap(5e-4, 1e-5).probability == pytest.approx(0.5)
    assert ap(5e-4, 0.0).verdict == "pass"
    assert ap(5.0001e-4, 0.0).verdict == "fail"


def test_a_signed_figure_may_miss_on_both_sides() -> None:
    """AD = 0 with u as large as the limit: within +-1 deviation, 68.27 %."""
    figure = Figure("AD", "P2-P4", "m", 0.0)
    found = judged(figure, combined(1e-4, math.inf, []), parsed_limits({"ad_mm": 0.1}))
    assert found.probability == pytest.approx(0.682689, abs=1e-6)
    assert judged(Figure("AD", "", "m", -3e-4), combined(1e-5, 9, []), {"AD": 1e-4}).verdict == "fail"


@pytest.mark.parametrize("values", [(1e-4, 3e-4, 2e-4), (6e-4, 9e-4, 7e-4), (4.9e-4, 5.1e-4, 1e-4), (0.0, 0.0, 1e-9)])
def test_the_figure_that_is_named_is_the_nearest_to_its_limit_or_farthest_beyond(values: tuple[float, ...]) -> None:
    """Where all pass, or all fail, with certainty, the first was named though others were nearer to the limit."""
    found = [ap(value, 1e-6) for value in values]
    other = judged(Figure("RP", "P1", "m", 1e-5), combined(1e-6, 9, []), {"RP": 1e-4})
    named = least_sure([*found, other])
    assert [each.figure.symbol for each in named] == ["AP", "RP"]
    assert named[0].figure.value == max(values)


def test_one_failure_fails_all_and_a_missing_figure_is_no_pass() -> None:
    good, open_, bad = ap(1e-4, 1e-6), ap(5e-4, 1e-6), ap(9e-4, 1e-6)
    assert overall([good, good], []) == "pass"
    assert overall([good, open_], []) == "cannot_tell"
    assert overall([good, open_, bad], []) == "fail"
    assert overall([good], ["rp_mm"]) == "cannot_tell"
    assert overall([judged(good.figure, good.uncertainty, {})], []) is None


@pytest.mark.parametrize(("name", "value"), [("ap", 1.0), ("ap_m", 1.0), ("ap_mm", 0.0), ("rp_mm", -1.0)])
def test_a_limit_has_a_known_name_and_is_above_zero(name: str, value: float) -> None:
    with pytest.raises(InvalidInput, match="limit"):
        parsed_limits({name: value})


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    visits = np.random.default_rng(1).normal(size=12)
    assert jackknife(lambda x: float(x.mean()), visits) == pytest.approx(visits.std(ddof=1) / math.sqrt(12), rel=1e-12)
