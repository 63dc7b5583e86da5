# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Errors shared by successive rows in one posture (a stay): the arm's error there, not serial correlation of the noise.

Several targets at the tool, or readings that were repeated before the arm moved on, are rows of one stay. Any two of
them are correlated by w: Omega = 1 + w K, K 1 for numbers of the same coordinate in two rows of a stay. The covariance
of a fit, its noise and degrees of freedom follow as in `serial_correlation`. Memory is asked of the means of stays.
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray, IndexArray, IntArray
from fastcal.calibration.serial_correlation import DEVIATIONS, MOST, SerialCorrelation


def stay_correlation(J: FloatArray, residual: FloatArray, row: IntArray, stay: IndexArray) -> SerialCorrelation | None:
    """What rows of one stay share beyond white noise; None where they share nothing.

    With r = M e: E r^T K r = s^2 (tr(K M) + w tr(K M K M)) and E r^T r = s^2 (tr M + w tr(K M)), so w follows from the
    products as a share f of the squares. White noise has the mean tr(K M), and the variance 2 tr(K M K M).

    Args:
        J: (m, p) whitened columns of the free parameters, of full rank.
        residual: (m,) whitened.
        row: (m,) the row that each number belongs to, ascending.
        stay: (N,) of each row.
    """
    numbers = np.bincount(row, minlength=len(stay))
    keep = (numbers == np.bincount(numbers[numbers > 0]).argmax())[row]
    if not keep.all():
        J, residual, row = J[keep], residual[keep], row[keep]
    if len(residual) <= J.shape[1]:
        return None
    group = _same_numbers(row, stay)
    Q, R = np.linalg.qr(J)
    r = residual - Q @ (Q.T @ residual)
    freedom, count = len(r) - len(R), np.bincount(group)

    def beside(values: FloatArray) -> FloatArray:
        """K values, values (m, ...)."""
        return group_sums(values, group)[group] - values

    Kq = beside(Q)
    B, pairs = Q.T @ Kq, float(np.sum(count * (count - 1)))
    taken, spread = float(np.trace(B)), pairs - 2 * float(np.sum(Kq**2)) + float(np.sum(B * B))
    squares = float(r @ r)
    share = float(r @ beside(r)) / max(squares, 1e-300)
    beyond = share * freedom + taken
    if spread <= 0 or beyond < DEVIATIONS * float(np.sqrt(2 * spread)):
        return None
    w = min(beyond / (spread + share * taken), MOST)
    inner = np.eye(len(R)) + w * B
    trace = freedom - w * taken
    square = len(r) + w**2 * pairs - 2 * float(np.sum((Q + w * Kq) ** 2)) + float(np.sum(inner * inner))
    inverse = np.linalg.inv(R)
    covariance = inverse @ inner @ inverse.T * (squares / trace)
    return SerialCorrelation(w, covariance, float(np.sqrt(freedom / trace)), trace**2 / square)


def whitened(values: FloatArray, row: IntArray, stay: IndexArray, w: float) -> FloatArray:
    """Omega^-1/2 values, values (m, ...): means of n rows over sqrt(1 + (n - 1) w), what is beside over sqrt(1 - w)."""
    group = _same_numbers(row, stay)
    count = np.bincount(group).reshape(-1, *[1] * (values.ndim - 1))
    mean = group_sums(values, group) / count
    return np.asarray((values - mean[group]) / np.sqrt(1 - w) + (mean / np.sqrt(1 + (count - 1) * w))[group])


def of_stays(
    J: FloatArray, residual: FloatArray, row: IntArray, stay: IndexArray
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Columns (k, p), residual (k,) and stay (k,) of the stays: sums of their rows' numbers over the root of the count.

    White noise of the rows is white noise of the same size in them. Arguments as of `stay_correlation`; rows with other
    numbers than most are left out.
    """
    numbers = np.bincount(row, minlength=len(stay))
    keep = (numbers == np.bincount(numbers[numbers > 0]).argmax())[row]
    J, residual, row = J[keep], residual[keep], row[keep]
    group = _same_numbers(row, stay)
    root = np.sqrt(np.bincount(group))
    own = np.empty(len(root), dtype=np.int64)
    own[group] = stay[row]
    return group_sums(J, group) / root[:, np.newaxis], group_sums(residual, group) / root, own


def _same_numbers(row: IntArray, stay: IndexArray) -> IndexArray:
    """(m,) the same for numbers of one stay that stand at the same place of their rows, ascending by stay."""
    first = np.r_[True, np.diff(row) != 0]
    place = np.arange(len(row)) - np.maximum.accumulate(np.where(first, np.arange(len(row)), 0))
    key = stay[row] * (place.max() + 1) + place
    return np.asarray(np.unique(key, return_inverse=True)[1])


def group_sums(values: FloatArray, group: IndexArray) -> FloatArray:
    """(groups, ...) sums of values (m, ...), the groups ascending."""
    order = np.argsort(group, kind="stable")
    begins = np.flatnonzero(np.r_[True, np.diff(group[order]) != 0])
    return np.asarray(np.add.reduceat(values[order], begins, axis=0))
