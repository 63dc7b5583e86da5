# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does what remains depend on a variable? Medians in bins to look at, a rank test to sort by.

Bins hold equally many rows. Their medians m carry the 95 % band m +- 1.96 sqrt(pi / 2) s / sqrt(k), with k rows in the
bin and s = 1.4826 MAD: the standard error of a median of normal noise. The score of a variable is the Kruskal-Wallis
test of the bins (Kruskal and Wallis 1952), H summed over the components with its degrees of freedom, and as its size
the share of the variance of ranks that the bins explain, adjusted for the number of bins: (H - K + 1) / (N - K)
(Tomczak and Tomczak 2014). Ranks, so that a gross point neither makes nor hides a trend.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.calibration.gamma_tail import gamma_tail
from fastcal.calibration.some_rows import some_rows

MOST_ROWS = 50_000  # that trends are looked for in: a share of 3 % of the variance is beyond doubt with far fewer
BIN_COUNT = 16
ROWS_PER_BIN = 10
FLAG_SHARE = 0.03
FLAG_P_VALUE = 0.01

_MAD_TO_SIGMA = 1.4826
_MEDIAN_ERROR = np.sqrt(np.pi / 2)
_COVERAGE = 1.96


@dataclass(frozen=True)
class BinnedMedian:
    """Medians of y in bins of x; all (K,), `low` and `high` bound the 95 % band of each median."""

    x: FloatArray
    median: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class Trend:
    """How much of the residual a variable explains: `share` of rank variance, `p_value` of seeing it by chance."""

    share: float
    p_value: float

    def is_flagged(self, tested_count: int) -> bool:
        """True where the trend is large enough to matter and too sure for chance among `tested_count` variables."""
        return self.share >= FLAG_SHARE and self.p_value * tested_count < FLAG_P_VALUE


NO_TREND = Trend(share=0.0, p_value=1.0)


def judged_rows(row_count: int) -> NDArray[np.intp]:
    """(K,) rows that trends are looked for in: all of them, of more than MOST_ROWS about that many."""
    return some_rows(row_count, MOST_ROWS)


def bins_of(x: FloatArray) -> NDArray[np.intp]:
    """(N,) the bin of each row of x (N,), in the order of x and of about equal count; -1 in thin bins.

    Equal x share a bin.
    """
    bin_count = min(BIN_COUNT, max(1, len(x) // ROWS_PER_BIN))
    ordered = np.sort(x)
    edges = np.unique(np.quantile(ordered, np.linspace(0.0, 1.0, bin_count + 1))) if len(x) else np.zeros(0)
    if len(edges) < 2:
        return np.full(len(x), -1)
    distinct = ordered[np.diff(ordered, prepend=-np.inf) > 0]
    starts = distinct[1:] if len(distinct) <= bin_count else edges[1:-1]
    bins = np.searchsorted(starts, x, side="right")
    is_full = np.bincount(bins) >= ROWS_PER_BIN
    return np.where(is_full, np.cumsum(is_full) - 1, -1)[bins]


def binned_medians(x: FloatArray, columns: FloatArray) -> list[BinnedMedian]:
    """Medians of each column (N, m) in bins of x (N,); rows where either is NaN are left out."""
    if np.isfinite(x).all() and np.isfinite(columns).all():
        bins = _rows_by_bin(x)
        centre = _medians(x, bins)
        return [_binned(centre, y, bins) for y in columns.T]
    return [binned_median(x, y) for y in columns.T]


def binned_median(x: FloatArray, y: FloatArray) -> BinnedMedian:
    """The same of one column (N,)."""
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    bins = _rows_by_bin(x)
    return _binned(_medians(x, bins), y, bins)


def _rows_by_bin(x: FloatArray) -> list[NDArray[np.intp]]:
    bins = bins_of(x).astype(np.int16)  # which numpy sorts by counting
    in_order = np.argsort(bins, kind="stable")
    return np.split(in_order, np.searchsorted(bins[in_order], np.arange(bins.max(initial=-1) + 1)))[1:]


def _medians(x: FloatArray, bins: list[NDArray[np.intp]]) -> FloatArray:
    return np.array([np.median(x[rows]) for rows in bins])


def _binned(centre: FloatArray, y: FloatArray, bins: list[NDArray[np.intp]]) -> BinnedMedian:
    parts = [y[rows] for rows in bins]
    median = np.array([np.median(part) for part in parts])
    spread = np.array([_MAD_TO_SIGMA * np.median(np.abs(part - m)) for part, m in zip(parts, median, strict=True)])
    error = _COVERAGE * _MEDIAN_ERROR * spread / np.sqrt([len(part) for part in parts])
    return BinnedMedian(centre, median, median - error, median + error)


class Ranks:
    """Ranks of numbers from 1, equal numbers sharing the mean of theirs, and what Kruskal and Wallis need of them."""

    def __init__(self, y: FloatArray) -> None:
        """Of finite y (N,)."""
        _, places, counts = np.unique(y, return_inverse=True, return_counts=True)
        n = len(y)
        self.ranks = (np.cumsum(counts) - (counts - 1) / 2)[places]
        self.ties = 1 - float(np.sum(counts.astype(float) ** 3 - counts)) / max(n**3 - n, 1)

    def kruskal_wallis(self, group: NDArray[np.intp]) -> float:
        """H of Kruskal and Wallis (1952), corrected for ties, of groups 0 ... K - 1 (N,), none of them empty.

        SciPy's own takes half a second to import.
        """
        n = len(self.ranks)
        sums = np.bincount(group, weights=self.ranks) ** 2 / np.bincount(group)
        return float((12 / (n * (n + 1)) * sums.sum() - 3 * (n + 1)) / self.ties)


def trends(variables: Mapping[str, FloatArray], residual: FloatArray) -> dict[str, Trend]:
    """Score of each variable (N,), by its name, against the columns of residual (N, m).

    NaN in a variable or a column leaves that one number out. The share is the mean over the columns, each weighted with
    its robust variance: it speaks of the whole error.
    """
    columns = [_Column(y) for y in residual.T]
    return {name: _trend(x, columns) for name, x in variables.items()}


class _Column:
    """The finite numbers of a column: their rows, and their ranks."""

    def __init__(self, y: FloatArray) -> None:
        self.is_known = np.isfinite(y)
        self.y = y[self.is_known]
        self.ranks = Ranks(self.y)
        self.variance = _variance(self.y)


def _variance(y: FloatArray) -> float:
    return float(np.median(np.abs(y - np.median(y)))) ** 2 if len(y) else 0.0


def _trend(x: FloatArray, columns: list[_Column]) -> Trend:
    statistic, freedom = 0.0, 0
    shares, variances = [], []
    of_all = bins_of(x) if np.isfinite(x).all() else None
    for column in columns:
        beside = x[column.is_known]
        known = np.isfinite(beside)
        y, variance = (column.y, column.variance) if known.all() else (column.y[known], _variance(column.y[known]))
        bins = of_all if of_all is not None and column.is_known.all() else bins_of(beside[known])
        binned = bins >= 0
        count, row_count = int(bins.max(initial=-1)) + 1, int(np.count_nonzero(binned))
        if count < 2 or row_count <= count or np.ptp(y) == 0.0:
            continue
        ranks = column.ranks if row_count == len(column.y) else Ranks(y[binned])
        h = ranks.kruskal_wallis(bins[binned])
        statistic, freedom = statistic + h, freedom + count - 1
        shares.append(max(0.0, (h - count + 1) / (row_count - count)))
        variances.append(variance)
    if freedom == 0:
        return NO_TREND
    weights = variances if sum(variances) > 0.0 else None
    return Trend(float(np.average(shares, weights=weights)), gamma_tail(freedom / 2, statistic / 2))
