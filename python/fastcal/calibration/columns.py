# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns of linear problems."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.parallel import each
from fastcal.calibration.tall import moved, summed


def column_lengths(A: FloatArray) -> FloatArray:
    """(p,) length of each column of A (m, p), as `numpy.linalg.norm` has it, which makes a copy of A on the way."""
    return np.asarray(np.sqrt(summed(lambda rows: np.einsum("ij,ij->j", A[rows], A[rows]), moved(*A.shape))))


def unit_columns(*matrices: FloatArray) -> FloatArray:
    """(m, p) columns of the matrices (m, ...) side by side, each at length 1, without those that are 0; row by row."""
    lengths = [column_lengths(A) for A in matrices]
    kept = [np.flatnonzero(length) for length in lengths]
    first = np.cumsum([0, *map(len, kept)])
    out = np.empty((len(matrices[0]), first[-1]))

    def divide(rows: slice) -> None:
        for A, length, own, begin, end in zip(matrices, lengths, kept, first[:-1], first[1:], strict=True):
            part = A[rows] if len(own) == len(length) else A[rows, own]
            np.divide(part, length[own], out=out[rows, begin:end])

    each(divide, moved(*out.shape))
    return out


def without_nil(A: FloatArray) -> FloatArray:
    """The columns of A (m, p) that are not 0; A itself where that is all of them."""
    kept = column_lengths(A) > 0
    return A if kept.all() else A[:, kept]


def unit_products(normal: FloatArray) -> FloatArray:
    """The products of `unit_columns` of A, `normal` (p, p) those of A."""
    length = np.sqrt(np.diag(normal))
    kept = np.flatnonzero(length > 0)
    part = normal if len(kept) == len(normal) else normal[np.ix_(kept, kept)]
    return np.asarray(part / np.outer(length[kept], length[kept]))
