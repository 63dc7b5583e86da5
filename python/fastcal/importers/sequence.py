# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Two lists of the same things in the same order, some missing from either: which belongs to which."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray

_SKIP = 0.6  # cost of leaving out one entry; two of them cost more than the worst match
_ROUNDING = 1e-9


def matched(distance: FloatArray, gate: float) -> list[tuple[int, int]]:
    """The pairs (i, j), both rising, of least cost: (distance / gate)^2 a pair, 0.6 an entry left out.

    Args:
        distance: (M, N) how far entry i of the first list is from entry j of the second.
        gate: Entries farther apart are no pair.
    """
    rows, columns = distance.shape
    cost = np.where(distance <= gate, (distance / gate) ** 2, np.inf)
    steps = _SKIP * np.arange(columns + 1)
    best = steps.copy()
    taken = np.zeros((rows, columns + 1), dtype=np.int8)  # 1: a pair, 2: row i left out, 0: column j left out
    for i in range(rows):
        pair = np.concatenate([[np.inf], best[:-1] + cost[i]])
        skip = best + _SKIP
        here = np.minimum(pair, skip)
        # Leaving out columns: here[j'] + 0.6 (j - j') for the best j' <= j.
        after = np.minimum.accumulate(here - steps) + steps
        taken[i] = np.where(after < here - _ROUNDING, 0, np.where(pair <= skip, 1, 2))
        best = after
    pairs: list[tuple[int, int]] = []
    i, j = rows - 1, columns
    while i >= 0 and j > 0:
        if taken[i, j] == 1:
            pairs.append((i, j - 1))
            i, j = i - 1, j - 1
        elif taken[i, j] == 2:
            i -= 1
        else:
            j -= 1
    return pairs[::-1]
