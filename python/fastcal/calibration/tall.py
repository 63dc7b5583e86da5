# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Products of tall matrices in parts of their rows, which threads share: the parts are the same for any number of them.

They are matrix products, which numpy computes without the interpreter lock.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import iadd
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.calibration.parallel import each

_PARTS = 4
_WORTH = 1e7  # multiplications: fewer are done sooner than shared out
_MOVED = 8  # multiplications that take as long as a number's way from memory and back
_BLOCK = 96  # columns of a triangle that are solved at once


def parts(m: int, work: float) -> list[slice]:
    """The parts of m rows, where a product makes `work` multiplications a row."""
    count = _PARTS if m * work > _WORTH else 1
    return [slice(m * k // count, m * (k + 1) // count) for k in range(count)]


def moved(m: int, columns: int) -> list[slice]:
    """The parts of m rows, where work moves so many columns and hardly reckons."""
    return parts(m, _MOVED * columns)


def taken(A: FloatArray, index: NDArray[np.intp], *, axis: int = 0) -> FloatArray:
    """Rows, or with `axis` 1 columns, of A (m, p), row by row in memory."""
    count = (len(index), A.shape[1]) if axis == 0 else (len(A), len(index))
    out = np.empty(count)

    def take(rows: slice) -> None:
        of, which = (A, index[rows]) if axis == 0 else (A[rows], index)
        np.take(of, which, axis=axis, out=out[rows], mode="clip")

    each(take, moved(*count))
    return out


def single(A: FloatArray) -> NDArray[Any]:
    """A (m, p) in single precision."""
    out = np.empty(A.shape, np.float32)

    def copy(rows: slice) -> None:
        out[rows] = A[rows]

    each(copy, moved(*A.shape))
    return out


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
    """(p, k) A^T B of A (m, p) and B (m, k), or (p,) of B (m,)."""
    work = parts(len(A), A.shape[1] * B.shape[1]) if B.ndim > 1 else moved(*A.shape)
    return summed(lambda rows: np.asarray(A[rows].T @ B[rows]), work)


def times(A: FloatArray, B: FloatArray) -> FloatArray:
    """(m, k) A B of A (m, p) and B (p, k), or (m,) of B (p,)."""
    out = np.empty((len(A), *B.shape[1:]), np.result_type(A, B))
    work = parts(len(A), B.size) if B.ndim > 1 else moved(*A.shape)
    each(lambda rows: np.matmul(A[rows], B, out=out[rows]), work)
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
