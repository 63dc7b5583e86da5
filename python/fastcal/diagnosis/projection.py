# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Score tests by matrix products: all blocks projected on the complement of the fitted parameters at once.

With Q an orthonormal basis of A's columns, R = C - Q Q^T C and r' = r - Q Q^T r. The tests read inner products of
[R r'] only, so where there are more rows than columns the triangle T of a pivoted Cholesky factorization of
R^T R = T^T T takes the place of R: a tenth of the work of a QR of the rows.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg
from scipy.linalg import lapack

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.columns import column_lengths
from fastcal.calibration.tall import gram, inner, over, times

_RANK = 1e-9  # of A, columns scaled to length 1
_EPSILON = float(np.finfo(np.float64).eps)
_MANY = 1.5  # times as many rows as columns: from there on a triangle is worth its making


def score_tests(Q: FloatArray, C: FloatArray, r: FloatArray, sizes: Sequence[int]) -> _core.ScoreTests:
    """Tests of the blocks of C (m, c), `sizes` columns each, of r (m,), beside the fitted columns A (m, p).

    Q (m, rank) is the `basis` of A.
    """
    normal = gram(C) if 0 < _MANY * C.shape[1] < len(r) else None
    length = column_lengths(C) if normal is None else np.sqrt(np.diag(normal))
    scale = np.where(length > 0, length, 1.0)
    held = inner(Q, C) / scale
    left = r - Q @ (Q.T @ r)
    if normal is not None:
        # Of C - Q H: what Q lacks of orthonormal counts with its square, as in R itself.
        of_rows = normal / np.outer(scale, scale) - inner(held, 2 * held - gram(Q) @ held)
        R, left = _triangle(of_rows, inner(C, left) / scale - held.T @ (Q.T @ left), float(left @ left))
    else:
        R = np.asfortranarray(C / scale - (held.T @ Q.T).T)
    return _core.ScoreTests.projected(R, left, length, Q.shape[1], list(sizes))


def score_tests_beside(
    A: FloatArray, normal: FloatArray, C: FloatArray, r: FloatArray, sizes: Sequence[int]
) -> _core.ScoreTests | None:
    """The same by products of A's own columns, `normal` A^T A, where rows abound: neither Q nor R is made; else None.

    With X = (A^T A)^-1 A^T C the products are R^T R = C^T C - X^T (2 A^T C - A^T A X): so written they are those of
    C - A X, whatever X is, and rounding in X counts with its square.
    """
    if not 0 < _MANY * C.shape[1] < len(r) or A.shape[1] == 0:
        return None
    unit = np.sqrt(np.diag(normal))
    if unit.min() == 0:
        return None
    normal = normal / np.outer(unit, unit)
    L = root(normal)
    if L is None:
        return None
    of_C = gram(C)
    length = np.sqrt(np.diag(of_C))
    scale = np.where(length > 0, length, 1.0)
    along = inner(A, C) / unit[:, np.newaxis] / scale
    X = lapack.dpotrs(L, along, lower=1)[0]
    of_rows = of_C / np.outer(scale, scale) - inner(X, 2 * along - times(normal, X))
    left = r
    for _ in range(2):  # the second takes what rounding left
        left = left - A @ (lapack.dpotrs(L, A.T @ left / unit, lower=1)[0] / unit)
    R, left = _triangle(of_rows, inner(C, left) / scale - X.T @ (A.T @ left / unit), float(left @ left))
    return _core.ScoreTests.projected(R, left, length, A.shape[1], list(sizes))


def basis(A: FloatArray, normal: FloatArray | None = None) -> FloatArray:
    """(m, rank) an orthonormal basis of the columns of A (m, p), in whatever units they are; `normal` is A^T A."""
    if A.shape[1] == 0:
        return A
    normal = gram(A) if normal is None else normal
    length = np.sqrt(np.diag(normal))
    length = np.where(length > 0, length, 1.0)
    L = root(normal / np.outer(length, length))
    if L is not None:
        return over(A, length[:, np.newaxis] * L)
    A = A / length
    Q, R = linalg.qr(A, mode="economic", check_finite=False)
    diagonal = np.abs(np.diag(R))
    if diagonal.min() < _RANK * diagonal.max():
        Q, R, _ = linalg.qr(A, mode="economic", pivoting=True, check_finite=False)
        diagonal = np.abs(np.diag(R))
    return np.asarray(Q[:, diagonal >= _RANK * diagonal[0]])


def root(normal: FloatArray, away: float = _RANK) -> FloatArray | None:
    """Lower triangular L, L L^T = A^T A (p, p) of unit columns; None where A L^-T would not be orthonormal to `away`.

    Rounding leaves it epsilon times the condition of A^T A away. A third of the work of a QR of the rows.
    """
    L, failed = lapack.dpotrf(normal, lower=1)
    if failed:
        return None
    share, _ = lapack.dpocon(L, float(np.abs(normal).sum(axis=0).max()), uplo="L")
    return np.asarray(L) if away * share > _EPSILON else None


def root_again(A: FloatArray, length: FloatArray, normal: FloatArray) -> FloatArray | None:
    """`root` for A of columns of this `length` (p,) that are less independent: by what its own triangle leaves of it.

    Cholesky QR, twice (Y. Yamamoto et al. 2015): as accurate as Householder's, by matrix products.
    """
    L, failed = lapack.dpotrf(normal, lower=1)
    if failed:
        return None
    second = root(gram(over(A, length[:, np.newaxis] * L)))
    return None if second is None else np.asarray(L @ second)


def _triangle(normal: FloatArray, along: FloatArray, square: float) -> tuple[FloatArray, FloatArray]:
    """T (k, c) and t (k,) with T^T T = R^T R, T^T t = R^T r and t^T t = r^T r, k <= c + 1; by these products."""
    factor, pivot, rank, _ = lapack.dpstrf(normal)
    order = pivot - 1
    T = np.zeros((rank + 1, len(along)), order="F")
    T[:rank, order] = np.triu(factor[:rank])
    own = along[order[:rank]]
    t = linalg.solve_triangular(factor[:rank, :rank], own, trans="T", check_finite=False) if rank else own
    return T, np.append(t, np.sqrt(max(square - float(t @ t), 0.0)))
