# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Row at which the base was knocked, or moved and put back: every row is tested on the linearized problem.

With the other parameters projected out, a step at t leaves  |r|^2 - b(t)^T A(t)^-1 b(t);  A (6, 6) and b (6,) are sums
over the rows from t on, so all moments together cost one pass. (Change-point by least squares: D. Hinkley, "Inference
about the change-point in a sequence of random variables", 1970.)
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray, IntArray, thin_svd
from fastcal.calibration.columns import column_lengths
from fastcal.calibration.row_weights import huber_weights

_ROUNDS = 4
_ROUNDS_OF_STRETCHES = 2
_MOMENTS = 40  # between rows at which a stretch may begin or end, before its ends are looked at one by one
_RIDGE = 1e-10
_RANK = 1e-10  # of squared lengths
_FLAT = 1e-8  # of the eigenvalues of columns of unit length


def find_step(
    others: FloatArray, step: FloatArray, residual: FloatArray, row: IntArray, time: FloatArray, fewest: int = 1
) -> tuple[float, float]:
    """The moment after which a motion of the base explains most, and the time between the two rows around it.

    Args:
        others: (m, p) whitened columns of the other parameters.
        step: (m, 6) columns of the step as if it were before every row.
        residual: (m,) whitened, predicted less measured.
        row: (m,) the row of the data that each number belongs to.
        time: (N,) of the rows [s], or whatever else sets the rows before the step apart from those after it.
        fewest: Different moments on either side.
    """
    moments = np.unique(time[row])
    if len(moments) < 2 * fewest:
        return float(moments[0]), 0.0
    order = np.argsort(time[row], kind="stable")
    others, step, residual, row = others[order], step[order], residual[order], row[order]
    starts = np.searchsorted(time[row], moments[fewest : len(moments) - fewest + 1], side="left")
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


def find_stretch(
    others: FloatArray, step: FloatArray, residual: FloatArray, row: IntArray, fewest: int
) -> tuple[int, int] | None:
    """The first row of a stretch, of `fewest` rows at least, that a motion of its own explains most, and that after it.

    Args: as of `find_step`, the rows ascending. None where there are too few rows before, in and after a stretch.
    """
    rows, starts = np.unique(row, return_index=True)
    if len(rows) < 3 * fewest:
        return None
    weight = np.ones(len(residual))
    first, end = 0, len(rows)
    for _ in range(_ROUNDS_OF_STRETCHES):
        root = np.sqrt(weight)[:, np.newaxis]
        sums = _tail_sums(_basis(others * root), step * root, residual * root[:, 0], starts)
        moments = np.unique(np.linspace(fewest, len(rows) - fewest, _MOMENTS).astype(int))
        i, j = np.triu_indices(len(moments), 1)
        first, end = _longest_gain(sums, moments[i], moments[j], fewest)
        near = np.arange(fewest, len(rows) - fewest + 1)
        for _ in range(2):
            first, _ = _longest_gain(sums, near[near <= end - fewest], np.array([end]), fewest)
            _, end = _longest_gain(sums, np.array([first]), near[near >= first + fewest], fewest)
        inside = (row >= rows[first]) & (row < rows[end])
        J = np.hstack([others, step * inside[:, np.newaxis]])
        left = residual - J @ np.linalg.lstsq(J * root, residual * root[:, 0], rcond=_RANK)[0]
        weight = huber_weights(left, row)
    return int(rows[first]), int(rows[end])


def _tail_sums(
    Q: FloatArray, step: FloatArray, residual: FloatArray, starts: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sums over all rows from each start on: step' step, Q' step, step' (residual without what Q explains)."""
    clean = residual - Q @ (Q.T @ residual)

    def tail(products: FloatArray) -> FloatArray:
        return np.asarray(np.cumsum(products[::-1], axis=0)[::-1][starts])

    coupling = np.stack([tail(Q * step[:, [k]]) for k in range(step.shape[1])], axis=1)
    return tail(step[:, :, np.newaxis] * step[:, np.newaxis]), coupling, tail(step * clean[:, np.newaxis])


def _longest_gain(
    sums: tuple[FloatArray, FloatArray, FloatArray], first: IntArray, end: IntArray, fewest: int
) -> tuple[int, int]:
    """The pair of moments between which a motion explains most."""
    first, end = np.broadcast_arrays(first, end)
    long = end - first >= fewest
    first, end = first[long], end[long]
    own, coupling, b = (part[first] - part[end] for part in sums)
    A, b = scaled(own, coupling, b)
    A = A + _RIDGE * np.eye(A.shape[1])
    gain = np.einsum("ki,ki->k", b, np.linalg.solve(A, b[..., np.newaxis])[..., 0])
    best = int(np.argmax(gain))
    return int(first[best]), int(end[best])


def _basis(J: FloatArray) -> FloatArray:
    """Orthonormal columns that span those of J."""
    scale = column_lengths(J)
    U, s, _ = thin_svd(J[:, scale > 0] / scale[scale > 0])
    return np.asarray(U[:, s > _RANK * s[0]])


def _best(Q: FloatArray, step: FloatArray, residual: FloatArray, starts: IntArray) -> int:
    """The start whose step explains most."""
    return int(starts[np.argmax(gains(*_tail_sums(Q, step, residual, starts)))])


def scaled(own: FloatArray, coupling: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A = own - coupling coupling^T and b for columns of unit length; zeros where a column has nothing of its own.

    Of such a column only rounding is left, of either sign; scaled to unit length it would be infinite.

    Args:
        own: (n, k, k) sums of products of the columns.
        coupling: (n, k, p) of the columns and an orthonormal basis of the others.
        b: (n, k) of the columns and what the basis leaves of the residual.
    """
    A = own - coupling @ coupling.transpose(0, 2, 1)
    left, before = (np.einsum("nkk->nk", part) for part in (A, own))
    seen = left > _RANK * before
    inverse = np.where(seen, 1 / np.sqrt(np.where(seen, left, 1.0)), 0.0)
    return A * inverse[:, :, np.newaxis] * inverse[:, np.newaxis], b * inverse


def gains(own: FloatArray, coupling: FloatArray, b: FloatArray) -> FloatArray:
    """(n,) b^T A^+ b, by which the sum of squares falls; arguments as those of `scaled`."""
    A, b = scaled(own, coupling, b)
    values, vectors = np.linalg.eigh(A)
    along = np.einsum("nkj,nk->nj", vectors, b)
    return np.asarray(np.where(values > _FLAT, along**2 / np.maximum(values, _FLAT), 0.0).sum(axis=1))
