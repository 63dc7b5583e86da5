# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
import itertools

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from fastcal.calibration.some_rows import some_rows
from fastcal.report.residual_figures import drawn_note
from fastcal.report.trends import (
    BIN_COUNT,
    MOST_ROWS,
    NO_TREND,
    ROWS_PER_BIN,
    Ranks,
    Trend,
    binned_median,
    bins_of,
    judged_rows,
    trends,
)

Array = NDArray[np.float64]


def bin_rows(x: Array) -> list[NDArray[np.intp]]:
    bins = bins_of(x)
    return [np.flatnonzero(bins == k) for k in range(bins.max() + 1)]


def trend(x: Array, residual: Array) -> Trend:
    return trends({"x": x}, residual)["x"]


def test_bins_hold_equally_many_rows_in_the_order_of_x() -> None:
    x = np.random.default_rng(0).normal(size=1600) ** 3
    bins = bin_rows(x)
    assert [len(rows) for rows in bins] == [1600 // BIN_COUNT] * BIN_COUNT
    assert all(x[a].max() < x[b].min() for a, b in itertools.pairwise(bins))


def test_few_distinct_values_each_have_a_bin() -> None:
    x = np.repeat([0.0, 5.0, 10.0], [100, 40, ROWS_PER_BIN - 1])
    assert [sorted(set(x[rows])) for rows in bin_rows(x)] == [[0.0], [5.0]]


def test_median_follows_a_line_and_ignores_what_is_missing() -> None:
    x = np.linspace(0.0, 1.0, 800)
    y = 3.0 * x - 1.0
    y[::7] = np.nan
    bins = binned_median(x, y)
    np.testing.assert_allclose(bins.median, 3.0 * bins.x - 1.0, atol=1e-12)


def test_band_covers_the_true_median_in_95_percent_of_bins() -> None:
    random = np.random.default_rng(1)
    covered = []
    for _ in range(150):
        bins = binned_median(np.arange(1600.0), random.normal(0.3, 2.0, 1600))
        covered += list((bins.low <= 0.3) & (bins.high >= 0.3))
    # 2400 bins: binomial deviation 0.45 %; the band's s has an error of its own, which costs about 1 %
    assert np.mean(covered) == pytest.approx(0.945, abs=0.015)


def test_share_is_that_of_the_variance_of_the_planted_step() -> None:
    random = np.random.default_rng(2)
    x = np.repeat(np.arange(4.0), 5000)
    y = np.where(x >= 2, 1.0, -1.0) + random.normal(0, 1.0, len(x))
    found = trend(x, y[:, None])
    ranks = np.argsort(np.argsort(y)).astype(float)
    between = sum(5000 * (ranks[x == k].mean() - ranks.mean()) ** 2 for k in range(4))
    assert found.share == pytest.approx(between / ((ranks - ranks.mean()) ** 2).sum(), abs=5e-4)
    assert found.is_flagged(tested_count=10)


def test_score_depends_on_ranks_alone() -> None:
    random = np.random.default_rng(3)
    x, y = random.normal(size=(2, 500))
    y += np.sin(x)
    assert trend(x, y[:, None]).p_value == pytest.approx(trend(x**3, np.exp(y)[:, None]).p_value, rel=1e-9)


def test_noise_is_flagged_in_no_more_than_one_of_a_hundred_pages() -> None:
    random = np.random.default_rng(4)
    x = random.uniform(size=(8, 300))
    flagged = [
        any(trend(row, residual).is_flagged(len(x)) for row in x)
        for residual in (random.normal(size=(300, 3)) for _ in range(200))
    ]
    # at most 1 % of 200 pages on average; 8 or more would have a chance of 0.1 %
    assert sum(flagged) < 8


def test_gross_points_do_not_hide_a_trend() -> None:
    random = np.random.default_rng(5)
    x = random.uniform(-1, 1, 600)
    y = x + random.normal(0, 1, 600)
    clean = trend(x, y[:, None]).share
    y[::20] += 1e6
    assert trend(x, y[:, None]).share > 0.7 * clean


@pytest.mark.parametrize("rows", [0, 1, ROWS_PER_BIN])
def test_too_few_rows_have_no_trend(rows: int) -> None:
    x = np.arange(float(rows))
    assert trend(x, x[:, None]) == NO_TREND
    assert len(binned_median(x, x).x) in (0, 1)


def test_nothing_measured_has_no_trend() -> None:
    assert trend(np.arange(100.0), np.full((100, 3), np.nan)) == NO_TREND
    assert trend(np.arange(100.0), np.zeros((100, 3))) == NO_TREND


def test_the_rank_test_is_scipys_also_with_ties() -> None:
    random = np.random.default_rng(3)
    groups = [np.round(random.normal(shift, 1.0, size), 1) for shift, size in ((0.0, 30), (0.3, 45), (0.0, 12))]
    of = np.repeat(np.arange(3), [len(group) for group in groups])
    found = Ranks(np.concatenate(groups)).kruskal_wallis(of)
    assert found == pytest.approx(stats.kruskal(*groups).statistic, rel=1e-12)


def test_numbers_that_are_missing_or_in_thin_bins_are_left_out() -> None:
    random = np.random.default_rng(6)
    x, residual = random.normal(size=400), random.normal(size=(400, 2))
    residual[:, 0] += x
    whole = trends({"x": x}, residual[:, :1])["x"]
    padded = np.pad(residual, ((0, 60), (0, 0)), constant_values=np.nan), np.append(x, random.normal(size=60))
    assert trends({"x": padded[1]}, padded[0][:, :1])["x"] == whole
    unknown = trends({"x": np.append(x, np.full(60, np.nan))}, np.vstack([residual, random.normal(size=(60, 2))]))
    assert unknown["x"] == trend(x, residual)
    few = np.append(np.repeat([1.0, 2.0], 200), np.full(ROWS_PER_BIN - 1, 3.0))
    gross = np.append(residual[:, 0], np.full(ROWS_PER_BIN - 1, 1e3))
    assert trend(few, gross[:, None]).share == trend(few[:400], residual[:, :1]).share


def test_of_very_many_rows_some_are_judged_and_the_page_says_so() -> None:
    np.testing.assert_array_equal(judged_rows(MOST_ROWS), np.arange(MOST_ROWS))
    assert len(judged_rows(6 * MOST_ROWS)) == pytest.approx(MOST_ROWS, rel=1e-3)
    assert "use all rows. 250 of" in drawn_note(MOST_ROWS)
    assert " of 300\u202f000 rows; 250 of all rows" in drawn_note(300_000)


@pytest.mark.parametrize("period", [2, 6, 7, 8, 13, 34, 100])
def test_rows_of_every_pose_of_a_cycle_are_among_some(period: int) -> None:
    chosen = some_rows(100_000, 20_000)
    assert np.all(np.diff(chosen) > 0)
    shares = np.bincount(chosen % period) * period / len(chosen)
    np.testing.assert_allclose(shares, 1.0, atol=0.05)
