# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Did the instrument, the base or the target move between two rows? A search for the row of the change.

The motion of the base, or of the target, is tried from every row on, beside the parameters of the fit (change_point).
It counts where it explains more than half of what remains, more than a drift linear in the order of the rows does, and
more than chance could by an F test over all rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.change_point import find_step
from fastcal.calibration.row_weights import huber_weights

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_CHANCE = 1e-6
EXPLAINED = 0.5  # of the weighted squares
_SHOWN = 0.25  # of a move must be left by a fit without it
_FEWEST = 4  # rows on each side: three points place a body, the fourth tests it
_ROUNDS = 5
_RANK = 1e-10


@dataclass(frozen=True, eq=False)
class Shift:
    """From row `first` on, the points lie elsewhere by `size` [m] (RMS).

    `columns` (m, k) are those of the motion, 0 before that row, and `left` the cost (`huber_fit`) that it leaves.
    """

    first: int
    size: float
    columns: FloatArray
    left: float

    def smaller_part(self, count: int) -> IntArray:
        """The rows before or after the change, of `count`, whichever are fewer."""
        return np.arange(self.first, count) if count - self.first <= self.first else np.arange(self.first)


def find_shift(
    J: FloatArray, motions: list[FloatArray], residual: FloatArray, row: IntArray, scale: float
) -> Shift | None:
    """The change that explains the residual, or None.

    Args:
        J: (m, p) whitened columns of the fit's parameters.
        motions: (m, 6 or 3) columns of motions of the base and of the target.
        residual: (m,) whitened, predicted less measured.
        row: (m,) the row of the data that each number belongs to, ascending.
        scale: [m] the standard deviation that a whitened 1 stands for.
    """
    rows = np.unique(row)
    freedom = len(residual) - J.shape[1] - 6
    if len(rows) < 2 * _FEWEST or freedom < 6:
        return None
    order = (row - rows.mean()) / max(float(np.ptp(rows)), 1.0)
    best: tuple[float, int, FloatArray, FloatArray] | None = None
    drift = np.inf
    alone = _left(J, residual, row)
    for columns in motions:
        at, _ = find_step(J, columns, residual, row, np.arange(rows[-1] + 1, dtype=float))
        first = int(np.ceil(at))
        late = (row >= first)[:, np.newaxis]
        if min(np.sum(rows >= first), np.sum(rows < first)) < _FEWEST:
            continue
        squares, found = huber_fit(np.hstack([J, columns * late]), residual, row)
        drift = min(drift, _left(np.hstack([J, columns * order[:, np.newaxis]]), residual, row))
        if best is None or squares < best[0]:
            best = squares, first, (columns * late) @ found[J.shape[1] :], columns * late
    if best is None or best[0] > EXPLAINED * alone or best[0] > drift:
        return None
    squares, first, moved, columns = best
    from scipy import special  # takes longer to import than a fit, and few files come so far

    F = (alone - squares) / 6 / (squares / freedom)
    if special.fdtrc(6, freedom, F) * len(rows) * len(motions) > _CHANCE:
        return None
    late = row >= first
    size = float(np.sqrt(np.sum(moved[late] ** 2) / np.sum(rows >= first)))
    _, x = huber_fit(J, residual, row)
    left = float(np.sqrt(np.sum((residual - J @ x)[late] ** 2) / np.sum(rows >= first)))
    if left < _SHOWN * size:  # the parameters make up for it: along a path early and late postures differ
        return None
    size *= scale
    return Shift(first, size, columns, squares)


def _left(J: FloatArray, residual: FloatArray, row: IntArray) -> float:
    return huber_fit(J, residual, row)[0]


def huber_fit(J: FloatArray, residual: FloatArray, row: IntArray) -> tuple[float, FloatArray]:
    """The Huber cost in squares at unit noise that a fit of the columns J leaves, and its parameters.

    A row counts with its square up to some ten deviations and linearly beyond, so that neither a gross point nor a
    shifted part decides by its size alone.
    """
    weight = np.ones(len(residual))
    found: FloatArray = np.zeros(J.shape[1])
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)
        found = np.asarray(np.linalg.lstsq(J * root[:, np.newaxis], residual * root, rcond=_RANK)[0], dtype=np.float64)
        left = residual - J @ found
        weight = huber_weights(left, row)
    return float(np.sum(weight * left**2)), found
