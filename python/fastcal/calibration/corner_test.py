# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a straight line have a corner? The largest of many nested F tests, with the null distribution of that maximum.

Without a corner its place means nothing, so that the F statistic of the best place has no F distribution (R. B. Davies
1977): searched for, a corner comes out significant far too often. Here the distribution of the largest is drawn.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fastcal.arrays import FloatArray

DRAWS = 20_000
_NOTHING = 1e-6  # of a column: what is left of it behind the others is no direction of its own


class Corner(NamedTuple):
    """What points to a corner.

    Attributes:
        p: Chance of a largest F at least as large as the one seen, without a corner and with normal noise: between
            1 / (DRAWS + 1) and 1; 1 where no place adds anything.
        share: Of |r|^2, what the best place explains.
    """

    p: float
    share: float


def corner_test(r: FloatArray, A: FloatArray, B: FloatArray, freedom: int, seed: int = 0) -> Corner:
    """Is there a corner?

        F_c = z_c^2 / ((|r|^2 - z_c^2) / (freedom - 1)),   z_c = u_c . r,   u_c = b_c behind A, of length 1

    Args:
        r: (n,) residuals of the straight fit.
        A: (n, p) its columns.
        B: (n, c) the column that a corner adds, for each place that is tried.
        freedom: Of r: measured numbers less what was fitted.
        seed: Of the draws.
    """
    length = np.linalg.norm(A, axis=0)
    Q, triangle = np.linalg.qr(A[:, length > 0] / length[length > 0])
    Q = Q[:, np.abs(np.diag(triangle)) > _NOTHING]
    behind = B - Q @ (Q.T @ B)
    sizes, whole = np.linalg.norm(behind, axis=0), np.linalg.norm(B, axis=0)
    kept = sizes > _NOTHING * np.maximum(whole, np.finfo(float).tiny)
    if not kept.any() or freedom < 2:
        return Corner(1.0, 0.0)
    U = behind[:, kept] / sizes[kept]
    r = r - Q @ (Q.T @ r)
    seen = float(np.max((U.T @ r) ** 2) / (r @ r))
    # U' g for white g, and |g|^2 of it: coordinates in the span of U, and what is outside.
    values, directions = np.linalg.eigh(U.T @ U)
    own = values > _NOTHING * values[-1]
    root = directions[:, own] * np.sqrt(values[own])
    random = np.random.default_rng((seed, 31))
    inside = random.standard_normal((DRAWS, root.shape[1]))
    outside = random.chisquare(max(freedom - root.shape[1], 1), DRAWS)
    largest = np.max((inside @ root.T) ** 2, axis=1) / (np.sum(inside**2, axis=1) + outside)
    return Corner(float((1 + np.sum(largest >= seen)) / (1 + DRAWS)), seen)  # F rises with z^2 / |r|^2
