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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.gamma_tail import gamma_tail

Array = NDArray[np.float64]

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

    x: Array
    median: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class Trend:
    """How much of the residual a variable explains: `share` of rank variance, `p_value` of seeing it by chance."""

    share: float
    p_value: float

    def is_flagged(self, tested_count: int) -> bool:
        """True where the trend is large enough to matter and too sure for chance among `tested_count` variables."""
        return self.share >= FLAG_SHARE and self.p_value * tested_count < FLAG_P_VALUE


NO_TREND = Trend(share=0.0, p_value=1.0)


def bin_rows(x: Array, bin_count: int = BIN_COUNT) -> list[NDArray[np.intp]]:
    """Rows of x (N,) in bins of about equal count, in the order of x; equal x share a bin, thin bins are left out."""
    bin_count = min(bin_count, max(1, len(x) // ROWS_PER_BIN))
    edges = np.unique(np.quantile(x, np.linspace(0.0, 1.0, bin_count + 1))) if len(x) else np.zeros(0)
    if len(edges) < 2:
        return []
    distinct = np.unique(x)
    starts = distinct[1:] if len(distinct) <= bin_count else edges[1:-1]
    bins = np.searchsorted(starts, x, side="right")
    return [rows for k in range(int(bins.max()) + 1) if len(rows := np.flatnonzero(bins == k)) >= ROWS_PER_BIN]


def binned_median(x: Array, y: Array) -> BinnedMedian:
    """Median of y (N,) in bins of x (N,); rows where either is NaN are left out."""
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    bins = bin_rows(x)
    median = np.array([np.median(y[rows]) for rows in bins])
    spread = np.array([_MAD_TO_SIGMA * np.median(np.abs(y[rows] - m)) for rows, m in zip(bins, median, strict=True)])
    error = _COVERAGE * _MEDIAN_ERROR * spread / np.sqrt([len(rows) for rows in bins])
    centre = np.array([np.median(x[rows]) for rows in bins])
    return BinnedMedian(centre, median, median - error, median + error)


def kruskal_wallis(groups: list[Array]) -> float:
    """H of Kruskal and Wallis (1952) with their correction for ties; SciPy's own takes half a second to import."""
    _, places, counts = np.unique(np.concatenate(groups), return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2)[places]
    n = len(ranks)
    sums = [part.sum() ** 2 / len(part) for part in np.split(ranks, np.cumsum([len(group) for group in groups])[:-1])]
    ties = 1 - float(np.sum(counts.astype(float) ** 3 - counts)) / (n**3 - n)
    return float((12 / (n * (n + 1)) * np.sum(sums) - 3 * (n + 1)) / ties)


def trend(x: Array, residual: Array) -> Trend:
    """Score of x (N,) against the columns of residual (N, m); NaN in either leaves that one number out.

    The share is the mean over the columns, each weighted with its robust variance: it speaks of the whole error.
    """
    statistic, freedom = 0.0, 0
    shares, variances = [], []
    for y in residual.T:
        known = np.isfinite(x) & np.isfinite(y)
        y = y[known]
        bins = bin_rows(x[known])
        row_count = sum(len(rows) for rows in bins)
        if len(bins) < 2 or row_count <= len(bins) or np.ptp(y) == 0.0:
            continue
        h = kruskal_wallis([y[rows] for rows in bins])
        statistic, freedom = statistic + h, freedom + len(bins) - 1
        shares.append(max(0.0, (h - len(bins) + 1) / (row_count - len(bins))))
        variances.append(float(np.median(np.abs(y - np.median(y)))) ** 2)
    if freedom == 0:
        return NO_TREND
    weights = variances if sum(variances) > 0.0 else None
    return Trend(float(np.average(shares, weights=weights)), gamma_tail(freedom / 2, statistic / 2))
