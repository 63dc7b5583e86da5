# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Some of very many rows, where those say as much as all: the same ones each time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SHOWN_ROWS = (
    30_000  # of very many: base and tool are aligned to them, and of a long data set they are looked at and drawn
)
_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def some_rows(row_count: int, most: int) -> NDArray[np.intp]:
    """(K,) rows in their order: all of them, of more than `most` about that many.

    Row k is one of them where the fraction of k times the golden ratio is less than most / row_count: they lie evenly,
    and in no rhythm that poses measured in turn could have too.
    """
    rows = np.arange(row_count)
    return rows if row_count <= most else rows[rows * _GOLDEN % 1.0 < most / row_count]
