# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Reduces a record at a steady rate to the poses at which the arm, or the target, stood still."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray

_SHORTEST = 4  # samples of a standstill
_ASIDE = 0.1  # of a standstill, at either end, that is left out: settling


def standstills(values: FloatArray, tolerance: float) -> list[tuple[int, int]]:
    """Stretches [start, end) of (N, k) in which no column strays by more than the tolerance from its start."""
    found = []
    start = 0
    for row in range(1, len(values) + 1):
        if row == len(values) or np.nanmax(np.abs(values[row] - values[start])) > tolerance:
            if row - start >= _SHORTEST:
                found.append((start, row))
            start = row
    return _joined(found, values, tolerance)


def _joined(found: list[tuple[int, int]], values: FloatArray, tolerance: float) -> list[tuple[int, int]]:
    """Stretches of one place, parted by a sample of noise, made one."""
    out: list[tuple[int, int]] = []
    for start, end in found:
        if out and start - out[-1][1] < _SHORTEST:
            before = np.nanmedian(values[out[-1][0] : out[-1][1]], axis=0)
            if np.nanmax(np.abs(np.nanmedian(values[start:end], axis=0) - before)) <= tolerance:
                out[-1] = (out[-1][0], end)
                continue
        out.append((start, end))
    return out


def core(start: int, end: int) -> slice:
    """The middle of a standstill."""
    aside = int((end - start) * _ASIDE)
    return slice(start + aside, end - aside)
