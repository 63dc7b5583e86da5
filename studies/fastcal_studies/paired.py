# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Is one method better than another, over random splits of the same rows?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

CONFIDENCE = 0.95


@dataclass(frozen=True)
class Paired:
    """A difference over J splits: its mean, the interval that holds it with CONFIDENCE, p of no difference, and J."""

    mean: float
    low: float
    high: float
    p: float
    splits: int

    @property
    def is_certain(self) -> bool:
        """Is 0 outside the interval?"""
        return self.low > 0 or self.high < 0


def paired(first: Sequence[float], second: Sequence[float], learnt: int, unseen: int) -> Paired:
    """The difference `first` less `second`, by the corrected resampled t test (C. Nadeau, Y. Bengio 2003).

        t = d / sqrt((1 / J + unseen / learnt) s^2),  J - 1 degrees of freedom

    Random splits share rows, so their differences (mean d, variance s^2) are not independent: the plain t test, with
    1 / J alone, is sure too soon.

    Args:
        first: A number of one method, one a split.
        second: The same of another method on the same splits.
        learnt: Rows that each split learns.
        unseen: Rows that it holds back.
    """
    d = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
    count = len(d)
    mean = float(d.mean())
    if count < 2:
        return Paired(mean, float("-inf"), float("inf"), 1.0, count)
    scale = float(np.sqrt((1 / count + unseen / learnt) * d.var(ddof=1)))
    if scale == 0:
        return Paired(mean, mean, mean, 1.0 if mean == 0 else 0.0, count)
    reach = scale * float(stats.t.ppf((1 + CONFIDENCE) / 2, count - 1))
    p = 2 * float(stats.t.sf(abs(mean) / scale, count - 1))
    return Paired(mean, mean - reach, mean + reach, p, count)
