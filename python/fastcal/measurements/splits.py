# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which rows to fit and which to hold out: at random, or a whole region of joint space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import InvalidInput

SAME_POSTURE = 1e-6  # [rad, m] rows closer than this in every joint are visits of one posture


def random_rows(q: NDArray[np.float64], share: float, seed: int) -> NDArray[np.bool_]:
    """(N,) True in rows to hold out, drawn at random; all visits of a posture go the same way.

    Args:
        q: (N, n) joint positions [rad or m].
        share: Of the postures that is held out, above 0 and below 1.
        seed: The same seed draws the same rows.

    Raises:
        InvalidInput: A share that leaves nothing on one side.
    """
    _, posture = np.unique(np.round(q / SAME_POSTURE), axis=0, return_inverse=True)
    count = int(posture.max()) + 1
    held = np.random.default_rng(seed).permutation(count)[: _count(count, share)]
    return np.isin(posture.ravel(), held)


def region_rows(q: NDArray[np.float64], share: float, seed: int) -> NDArray[np.bool_]:
    """(N,) True in the rows nearest to one drawn at random, each joint measured by its range; arguments as above.

    What a model says there is extrapolation: none of its rows is near.
    """
    spread = np.ptp(q, axis=0)
    scaled = q / np.where(spread > 0, spread, 1.0)
    centre = scaled[np.random.default_rng(seed).integers(len(q))]
    distance = np.linalg.norm(scaled - centre, axis=1)
    limit = np.sort(distance)[_count(len(q), share) - 1]
    held = distance <= limit + SAME_POSTURE
    if held.all():
        raise InvalidInput("all rows are in one region of joint space: none can be held out")
    return np.asarray(held)


def _count(available: int, share: float) -> int:
    """How many of the available ones are held out: at least one, and not all."""
    if not 0 < share < 1:
        raise InvalidInput(f"the share to hold out must lie between 0 and 1, got {share}")
    if available < 2:
        raise InvalidInput("a split needs at least two different postures")
    return int(np.clip(round(share * available), 1, available - 1))


def deal(count: int, folds: int, random: np.random.Generator) -> NDArray[np.intp]:
    """(count,) the fold, 0 ... folds - 1, of each of `count` things: at random, sizes differ by one at most."""
    return np.asarray(random.permutation(count) % folds, dtype=np.intp)
