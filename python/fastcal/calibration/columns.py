# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of linear problems."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def column_lengths(A: FloatArray) -> FloatArray:
    """(p,) length of each column of A (m, p), as `numpy.linalg.norm` has it, which makes a copy of A on the way."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", A, A)))


def unit_columns(A: FloatArray) -> FloatArray:
    """The columns of A (m, p) that are not 0, each at length 1."""
    length = column_lengths(A)
    kept = length > 0
    if kept.all():
        return np.asarray(A / length)
    out = np.take(A, np.flatnonzero(kept), axis=1)
    out /= length[kept]
    return out


def unit_products(normal: FloatArray) -> FloatArray:
    """The products of `unit_columns` of A, `normal` (p, p) those of A."""
    length = np.sqrt(np.diag(normal))
    kept = np.flatnonzero(length > 0)
    part = normal if len(kept) == len(normal) else normal[np.ix_(kept, kept)]
    return np.asarray(part / np.outer(length[kept], length[kept]))
