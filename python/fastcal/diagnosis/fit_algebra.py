# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Linear algebra of a fit with priors: rows above a diagonal, steps, the root of a covariance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.linalg import lapack

from fastcal.calibration.parallel import each
from fastcal.calibration.tall import moved, taken
from fastcal.diagnosis.problem import Linearization
from fastcal.diagnosis.projection import root, root_again

FloatArray = NDArray[np.float64]

_COVARIANCE = 1e-6  # relative error of a covariance that decides nothing


def columns_of(near: Linearization, free: list[int]) -> FloatArray:
    """(m, F) of the parameters that are free, row by row in memory."""
    return taken(near.J, np.array(free, dtype=np.intp), axis=1)


def above(A: FloatArray, diagonal: FloatArray) -> FloatArray:
    """(m + p, p) A (m, p) above a diagonal matrix."""
    out = np.empty((len(A) + len(diagonal), len(diagonal)))

    def copy(rows: slice) -> None:
        out[rows] = A[rows]

    each(copy, moved(*A.shape))
    out[len(A) :] = np.diag(diagonal)
    return out


def inverse_triangle(rows: Callable[[], FloatArray], normal: FloatArray) -> FloatArray:
    """(p, p) R^-1 of A = Q R (m, p), in whatever units its columns are; `rows` gives A, `normal` is A^T A."""
    length = np.sqrt(np.diag(normal))
    normal = normal / np.outer(length, length)
    L = root(normal, _COVARIANCE)
    if L is None:
        A = rows()
        L = root_again(A, length, normal)
        R = linalg.qr(A / length, mode="r", check_finite=False)[0][: A.shape[1]] if L is None else L.T
    else:
        R = L.T
    return np.asarray(lapack.dtrtri(R)[0] / length[:, np.newaxis])


def solved(J: FloatArray, normal: FloatArray, scale: FloatArray, hold: FloatArray, g: FloatArray) -> FloatArray:
    """The solution x of (S J^T J S + H^2) x = g, S and H diagonal: each column has a prior, so it has full rank.

    `normal` is J^T J. By Cholesky, a tenth of the work of a QR of the rows; by that where rounding makes the squares
    indefinite.
    """
    normal = normal * np.outer(scale, scale)
    normal[np.diag_indices_from(normal)] += hold**2
    try:
        return np.asarray(linalg.cho_solve(linalg.cho_factor(normal, overwrite_a=True, check_finite=False), g))
    except linalg.LinAlgError:
        R = linalg.qr(np.vstack([J * scale, np.diag(hold)]), mode="r", check_finite=False)[0][: len(g)]
        return np.asarray(linalg.cho_solve((R, False), g, check_finite=False))
