# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A fixed sample of very many rows, for decisions that do not need all of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SHOWN_ROWS = (
    30_000  # of very many: base and tool are aligned to them, and of a long data set they are looked at and drawn
)
_PART = 1_000_000  # rows that are looked at in one go: memory does not grow with their number
_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def some_rows(row_count: int, most: int) -> NDArray[np.intp]:
    """(K,) rows in their order: all of them, of more than `most` about that many.

    Row k is one of them where the fraction of k times the golden ratio is less than most / row_count: they lie evenly,
    and in no rhythm that poses measured in turn could have too.
    """
    if row_count <= most:
        return np.arange(row_count)
    share = most / row_count
    parts = (np.arange(first, min(row_count, first + _PART)) for first in range(0, row_count, _PART))
    return np.concatenate([rows[rows * _GOLDEN % 1.0 < share] for rows in parts])
