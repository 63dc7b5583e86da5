# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which measurements tell most about what is known badly, one after the other."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray


def most_telling(A: FloatArray, C: FloatArray, count: int) -> list[int]:
    """Indices of `count` candidates, each of the greatest gain log det(1 + A_i C A_i^T) after those before it.

    Args:
        A: (N, m, k) whitened columns of each candidate's m numbers.
        C: (k, k) covariance before them.
        count: At most N.
    """
    chosen: list[int] = []
    for _ in range(count):
        AC = A @ C
        gain = np.linalg.slogdet(np.eye(A.shape[1]) + AC @ A.transpose(0, 2, 1))[1]
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        chosen.append(best)
        a = AC[best]
        C = C - a.T @ np.linalg.solve(np.eye(A.shape[1]) + a @ A[best].T, a)
    return chosen
