# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Huber's weights on whole rows, for the searches on the linearized problem."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray, IntArray

HUBER = 1.5  # rows whose error is larger than this many typical ones pull with less than their square


def huber(u: FloatArray, corner: float = HUBER) -> FloatArray:
    """Huber's weight min(1, corner / u) of sizes u over the typical one."""
    return np.asarray(np.minimum(1.0, corner / np.maximum(u, np.finfo(float).tiny)))


def huber_weights(left: FloatArray, row: IntArray) -> FloatArray:
    """(m,) `huber` of each number's row: its size the RMS of its numbers `left` (m,), the typical one the median."""
    count = np.bincount(row)
    size = np.sqrt(np.bincount(row, left**2) / np.maximum(count, 1))
    typical = np.median(size[count > 0])
    return huber(size / max(float(typical), np.finfo(float).tiny))[row]
