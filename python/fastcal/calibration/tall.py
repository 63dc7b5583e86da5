# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Products of tall matrices in parts of their rows, which threads share: the parts are the same for any number of them.

They are matrix products, which numpy works out without its lock.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from itertools import pairwise
from operator import iadd

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.parallel import each

FloatArray = NDArray[np.float64]

_PARTS = 4
_WORTH = 1e7  # multiplications: fewer are done sooner than shared out
_BLOCK = 96  # columns of a triangle that are solved at once


def parts(m: int, work: float) -> list[slice]:
    """The parts of m rows, where a product makes `work` multiplications a row."""
    ends = np.linspace(0, m, (_PARTS if m * work > _WORTH else 1) + 1).astype(int).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def summed(work: Callable[[slice], FloatArray], rows: list[slice]) -> FloatArray:
    """The sum of what `work` makes of each part."""
    return reduce(iadd, each(work, rows))


def gram(A: FloatArray) -> FloatArray:
    """(p, p) A^T A of A (m, p)."""

    def own(rows: slice) -> FloatArray:
        part = A[rows]
        return np.asarray(part.T @ part)

    return summed(own, parts(len(A), A.shape[1] ** 2))


def inner(A: FloatArray, B: FloatArray) -> FloatArray:
    """(p, k) A^T B of A (m, p) and B (m, k)."""
    return summed(lambda rows: np.asarray(A[rows].T @ B[rows]), parts(len(A), A.shape[1] * B.shape[1]))


def times(A: FloatArray, B: FloatArray) -> FloatArray:
    """(m, k) A B of A (m, p) and B (p, k)."""
    out = np.empty((len(A), B.shape[1]))
    each(lambda rows: np.matmul(A[rows], B, out=out[rows]), parts(len(A), B.size))
    return out


def over(A: FloatArray, L: FloatArray) -> FloatArray:
    """(m, p) A L^-T of A (m, p) and a lower triangle L (p, p)."""
    out = np.empty(A.shape)
    blocks = [slice(a, a + _BLOCK) for a in range(0, len(L), _BLOCK)]
    inverse = [np.linalg.inv(L[own, own]).T for own in blocks]

    def solve(rows: slice) -> None:
        for own, back in zip(blocks, inverse, strict=True):
            before = slice(own.start)
            out[rows, own] = (A[rows, own] - out[rows, before] @ L[own, before].T) @ back

    each(solve, parts(len(A), A.shape[1] ** 2))
    return out
