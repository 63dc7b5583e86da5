# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How each joint last moved, from the order of rows: what settling and backlash without an approach column look at.

Row i was reached from row i - 1 where nothing speaks against it. A move whose direction contradicts an approach column
shows that a pose in between is not in the file; all moves into that row are then unknown, and 0.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.arrays import FloatArray


def last_moves(q: FloatArray, approach: FloatArray | None) -> FloatArray:
    """(N, n) moves [rad or m] by which rows q (N, n) were reached from the row before; 0 where unknown or none."""
    move = np.zeros_like(q)
    move[1:] = q[1:] - q[:-1]
    if approach is not None:
        move[(np.sign(move) * approach < 0).any(axis=1)] = 0.0
    return move


def directions(move: FloatArray, before: Sequence[float] = ()) -> FloatArray:
    """(N, n) +1 or -1, the direction of each joint's last known move up to that row.

    Before the first it is what `before` says, n numbers; 0 where it says nothing.
    """
    rows = np.where(move != 0, np.arange(len(move))[:, np.newaxis], -1)
    last = np.maximum.accumulate(rows, axis=0)
    moved = np.sign(np.take_along_axis(move, np.maximum(last, 0), axis=0))
    return np.asarray(np.where(last >= 0, moved, np.asarray(before if len(before) else 0.0, dtype=np.float64)))
