# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""When was the base knocked? Every moment between two rows is tried on the linearized problem.

With the other parameters projected out, a step at t leaves  |r|^2 - b(t)^T A(t)^-1 b(t);  A (6, 6) and b (6,) are sums
over the rows from t on, so all moments together cost one pass. (Change-point by least squares: D. Hinkley, "Inference
about the change-point in a sequence of random variables", 1970.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.columns import column_lengths
from fastcal.calibration.row_weights import huber_weights

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ROUNDS = 4
_RANK = 1e-10


def find_step(
    others: FloatArray, step: FloatArray, residual: FloatArray, row: IntArray, time: FloatArray
) -> tuple[float, float]:
    """The moment after which a motion of the base explains most, and the time between the two rows around it.

    Args:
        others: (m, p) whitened columns of the other parameters.
        step: (m, 6) columns of the step as if it were before every row.
        residual: (m,) whitened, predicted less measured.
        row: (m,) the row of the data that each number belongs to.
        time: (N,) of the rows [s].
    """
    moments = np.unique(time[row])
    if len(moments) < 2:
        return float(moments[0]), 0.0
    order = np.argsort(time[row], kind="stable")
    others, step, residual, row = others[order], step[order], residual[order], row[order]
    starts = np.searchsorted(time[row], moments[1:], side="left")
    weight = np.ones(len(residual))
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)[:, np.newaxis]
        Q = _basis(others * root)
        place = _best(Q, step * root, residual * root[:, 0], starts)
        late = (np.arange(len(residual)) >= place)[:, np.newaxis]
        J = np.hstack([others, step * late])
        left = residual - J @ np.linalg.lstsq(J * root, residual * root[:, 0], rcond=_RANK)[0]
        weight = huber_weights(left, row)
    after = float(time[row[place]])
    before = float(moments[np.searchsorted(moments, after) - 1])
    return (before + after) / 2, after - before


def _basis(J: FloatArray) -> FloatArray:
    """Orthonormal columns that span those of J."""
    scale = column_lengths(J)
    U, s, _ = np.linalg.svd(J[:, scale > 0] / scale[scale > 0], full_matrices=False)
    return np.asarray(U[:, s > _RANK * s[0]])


def _best(Q: FloatArray, step: FloatArray, residual: FloatArray, starts: IntArray) -> int:
    """The start whose step explains most."""
    clean = residual - Q @ (Q.T @ residual)

    def tail_sums(products: FloatArray) -> FloatArray:
        return np.asarray(np.cumsum(products[::-1], axis=0)[::-1][starts])

    A = tail_sums(step[:, :, np.newaxis] * step[:, np.newaxis])
    coupling = np.stack([tail_sums(Q * step[:, [k]]) for k in range(step.shape[1])], axis=1)
    A -= coupling @ coupling.transpose(0, 2, 1)
    b = tail_sums(step * clean[:, np.newaxis])
    scale = np.sqrt(np.maximum(np.einsum("kii->ki", A), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(A / (scale[:, :, np.newaxis] * scale[:, np.newaxis]))
    along = np.einsum("kij,ki->kj", vectors, b / scale)
    gain = np.where(values > 1e-8, along**2 / np.maximum(values, 1e-8), 0.0).sum(axis=1)
    return int(starts[np.argmax(gain)])
