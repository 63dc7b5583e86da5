# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tail probabilities of the distributions of score statistics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import special

from fastcal.arrays import FloatArray


def p_values(statistic: FloatArray, rank: NDArray[np.int32], freedom: float) -> FloatArray:
    """P(T_i or larger) of chi square with these ranks, of F where the noise was estimated; 1 where the rank is 0."""
    k = np.maximum(rank, 1)
    tail = special.chdtrc(k, statistic) if np.isinf(freedom) else special.fdtrc(k, freedom, statistic / k)
    return np.where(rank > 0, tail, 1.0)
