# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Evidence of a random effect beside a linear model, and what it predicts of poses that were held out.

    r = A b + a C w + e,   b flat,  w ~ N(0, I),  e ~ N(0, s^2 I),  s unknown

With Q an orthonormal basis of A's columns, C' = C - Q Q^T C and r' likewise, and C' = U diag(d) V^T, twice the log of
the likelihood of a over that of a = 0, s at its best for each, is
    (m - p) log(|r'|^2 / S(a)) - sum log(1 + a^2 d^2),   S(a) = |r'|^2 - sum (U^T r')^2 a^2 d^2 / (1 + a^2 d^2).
Source: C. Rasmussen, C. Williams, "Gaussian Processes for Machine Learning" (2006), section 2.7.
"""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np
from scipy import linalg

from fastcal.arrays import BoolArray, FloatArray
from fastcal.calibration.columns import column_lengths
from fastcal.calibration.tall import gram

_INDEPENDENT = 1e-6  # of unit columns: what those before it leave of each
_SIZES = 10.0 ** np.arange(-1.5, 3.01, 0.25)  # of a, in noise: columns of a block have mean square 1


class Weighed(NamedTuple):
    """Evidence of a block at its best size.

    Attributes:
        evidence: Twice the log of the ratio of likelihoods, 0 for a block that does nothing.
        size: a.
    """

    evidence: float
    size: float


class Beside:
    """The linear model that blocks are held against.

    Args:
        A: (m, p) its columns, rows of priors among them.
        r: (m,) what it has to explain.
    """

    def __init__(self, A: FloatArray, r: FloatArray) -> None:
        Q, R, _ = linalg.qr(A, mode="economic", pivoting=True, check_finite=False)
        diagonal = np.abs(np.diag(R))
        self._Q = Q[:, diagonal > 1e-12 * diagonal[0]]
        self._left = self.across(r)
        self._freedom = max(len(r) - self._Q.shape[1], 1)

    def across(self, values: FloatArray) -> FloatArray:
        """What the model cannot do of columns (m, k) or of one (m,)."""
        once = values - self._Q @ (self._Q.T @ values)
        return np.asarray(once - self._Q @ (self._Q.T @ once))

    def weigh(self, C: FloatArray) -> Weighed:
        """Evidence of columns C (m, k)."""
        held = self._Q.T @ C
        d2, V = np.linalg.eigh(C.T @ C - held.T @ held)
        d2 = np.maximum(d2, 0.0)
        along = (V.T @ (C.T @ self._left)) ** 2  # d^2 (U^T r')^2
        a2 = _SIZES[:, np.newaxis] ** 2
        square = float(self._left @ self._left)
        left = np.maximum(square - (along * a2 / (1 + a2 * d2)).sum(axis=1), 1e-12 * square)
        gain = self._freedom * np.log(square / left) - np.log1p(a2 * d2).sum(axis=1)
        best = int(np.argmax(gain))
        return Weighed(float(gain[best]), float(_SIZES[best])) if gain[best] > 0 else Weighed(0.0, 0.0)


def held_out_squares(A: FloatArray, C: FloatArray, r: FloatArray, held: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Squares of the held-out rows, fitted to the others: by A alone, and with C of weights ~ N(0, I)."""
    kept = ~held
    alone = _solve(A[kept], r[kept])
    count = C.shape[1]
    prior = np.hstack([np.zeros((count, A.shape[1])), np.eye(count)])
    whole = np.hstack([A, C])
    both = _solve(np.vstack([whole[kept], prior]), np.append(r[kept], np.zeros(count)))
    return (r[held] - A[held] @ alone) ** 2, (r[held] - whole[held] @ both) ** 2


def _solve(A: FloatArray, b: FloatArray) -> FloatArray:
    """(p,) least squares of A x = b: by the products of unit columns where these are independent, else by a QR."""
    length = column_lengths(A)
    length = np.where(length > 0, length, 1.0)
    with suppress(np.linalg.LinAlgError):
        root = np.linalg.cholesky(gram(A) / np.outer(length, length))
        if np.diag(root).min(initial=1.0) > _INDEPENDENT:
            return np.asarray(linalg.cho_solve((root.T, False), A.T @ b / length, check_finite=False) / length)
    return np.asarray(linalg.lstsq(A, b, lapack_driver="gelsy", check_finite=False)[0])
