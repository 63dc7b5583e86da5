# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Whether the measured point stands still where the joints do, and by how much its clock is late where it does not.

The spread of the points within windows of time is compared for windows that are moved: where both devices tell the same
time, or once their difference is made up for, all windows hold the instrument's noise alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray

_STEP = 0.01  # [s]
_LONGEST = 5.0  # [s] of a delay that is looked for
_RESTLESS = 8.0  # times the spread of a usual window: the point moves
_DRIFTS = 4.0  # times what differs from one point to the next: it moves too, in every window
_LEAST = 5e-4  # [m] of spread: below it a window is still for every instrument
_FEWEST = 3  # samples of a window, and windows
_ALIKE = 2.0  # times the least spread: a shift is as good


def delay(windows: FloatArray, times: FloatArray, points: FloatArray) -> tuple[float, bool]:
    """By how much the points' clock is late [s], 0 where it need not be; and whether another delay would do as well.

    Of several delays the smallest is taken: where poses are held equally long, one of a whole pose more looks alike.

    Args:
        windows: (K, 2) [s] begin and end of the joints' standstills.
        times: (N,) [s] of the points, in order.
        points: (N, 3) [m].
    """
    if len(windows) < _FEWEST or len(times) < _FEWEST:
        return 0.0, False
    here = spreads(windows, times, points)
    if not (np.isfinite(here).sum() >= _FEWEST and np.nanmedian(here) > _LEAST):
        return 0.0, False
    steps = round(_LONGEST / _STEP)
    shifts = _STEP * np.arange(-steps, steps + 1)
    typical = np.array([_typical(spreads(windows + shift, times, points)) for shift in shifts])
    best = float(typical.min())
    if not best < _typical(here) / _RESTLESS:
        return 0.0, False
    alike = np.r_[False, typical <= max(_ALIKE * best, _LEAST / _RESTLESS), False]
    ends = np.flatnonzero(np.diff(alike.astype(int)))  # of stretches of shifts that do
    middles = (shifts[ends[::2]] + shifts[ends[1::2] - 1]) / 2
    return float(middles[np.argmin(np.abs(middles))]), len(middles) > 1


def still_windows(windows: FloatArray, times: FloatArray, points: FloatArray) -> tuple[NDArray[np.bool_], float]:
    """(K,) whether the point moves within each window, and the largest spread of one that moves [m].

    A window is judged by the usual one and by its own noise, so that a noisy instrument does not move, and never below
    half a millimetre.
    """
    spread = spreads(windows, times, points)
    known = spread[np.isfinite(spread)]
    if not len(known):
        return np.zeros(len(windows), dtype=bool), 0.0
    quiet = float(np.quantile(known, 0.25))
    moves = np.nan_to_num(spread) > np.maximum(
        np.minimum(_RESTLESS * quiet, _DRIFTS * _noise(windows, times, points)), _LEAST
    )
    return moves, float(np.max(spread[moves], initial=0.0))


def spreads(windows: FloatArray, times: FloatArray, points: FloatArray) -> FloatArray:
    """(K,) standard deviation of the points in each window [m], of all coordinates; NaN of fewer than three points."""
    at = points - points.mean(axis=0)
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(at, axis=0)])
    squares = np.concatenate([[0.0], np.cumsum((at**2).sum(axis=1))])
    low, high = np.searchsorted(times, windows[:, 0]), np.searchsorted(times, windows[:, 1], side="right")
    count = np.maximum(high - low, 1)
    mean = (sums[high] - sums[low]) / count[:, np.newaxis]
    variance = (squares[high] - squares[low]) / count - (mean**2).sum(axis=1)
    return np.where(high - low >= _FEWEST, np.sqrt(np.maximum(variance, 0.0)), np.nan)


def _noise(windows: FloatArray, times: FloatArray, points: FloatArray) -> FloatArray:
    """(K,) what the spread of each window would be if its points differed by chance: from one to the next."""
    steps = np.concatenate([[0.0], np.cumsum((np.diff(points, axis=0) ** 2).sum(axis=1))])
    low, high = np.searchsorted(times, windows[:, 0]), np.searchsorted(times, windows[:, 1], side="right")
    last = np.maximum(high - 1, low)
    low, last = np.minimum(low, len(steps) - 1), np.minimum(last, len(steps) - 1)
    return np.asarray(np.sqrt((steps[last] - steps[low]) / (2 * np.maximum(last - low, 1))))


def _typical(spread: FloatArray) -> float:
    """Of nearly all windows; infinite where most of them hold no points."""
    known = spread[np.isfinite(spread)]
    return float(np.quantile(known, 0.75)) if 2 * len(known) > len(spread) else np.inf
