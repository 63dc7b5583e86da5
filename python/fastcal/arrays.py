# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Types of arrays, which every signature tells shapes and units of; their singular values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]


def thin_svd(A: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """U (m, k), s (k,), Vt (k, n) with A (m, n) = U diag(s) Vt, k = min(m, n); s descends.

    LAPACK's gesdd, which numpy takes, fails on a rare matrix of low rank and ordinary numbers; gesvd, slower, does not.

    Raises:
        numpy.linalg.LinAlgError: A is not finite.
    """
    try:
        U, s, Vt = np.linalg.svd(A, full_matrices=False)
    except np.linalg.LinAlgError:
        if not np.isfinite(A).all():
            raise
        from scipy import linalg

        U, s, Vt = linalg.svd(A, full_matrices=False, lapack_driver="gesvd")
    return U, s, Vt
