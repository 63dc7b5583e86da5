# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which sample of a log was taken when a point was measured: nearest in time, the arm at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.importers.clock import DAY, Times

Pair = tuple[int, int]

_HOUR = 3600.0
_AROUND = 0.25  # [s] before and after a point in which the arm must be at rest
_STILL = 3.5e-4  # [rad or m]: 0.02 degrees
_SPARSE = 3.0  # samples a point: fewer is a log of poses and no record of the motion
_HOURS = 14  # time zones lie at most so far apart


@dataclass(frozen=True)
class TimePairs:
    """Pairs by time.

    Attributes:
        pairs: (pose, point).
        moving: Points that were taken while the arm moved.
        outside: Points at whose time the log has nothing.
        shift: By how much the points' clock was set [s], in whole hours.
    """

    pairs: list[Pair]
    moving: list[int]
    outside: list[int]
    shift: float


def pairs_by_time(q: FloatArray, poses: Times | None, points: Times | None) -> TimePairs | None:
    """Pairs of poses q (M, n) and points by their clocks; None where the two clocks have nothing in common."""
    if poses is None or points is None or "counter" in (poses.kind, points.kind):
        return None
    at, to = poses.seconds, points.seconds
    if poses.kind != points.kind:
        at, to = at % DAY, to % DAY
    order = np.argsort(at, kind="stable")
    order = order[~np.isnan(at[order])]
    if len(order) < 2:
        return None
    shift = _shift(at[order], to)
    if shift is None:
        return None
    moved = to + shift
    interval = float(np.median(np.diff(at[order])))
    record = len(order) >= _SPARSE * len(to)
    reach = max(2 * interval, _AROUND) if record else interval / 2
    pairs: list[Pair] = []
    moving, outside = [], []
    for row, time in enumerate(moved):
        if np.isnan(time):
            outside.append(row)
            continue
        after = int(np.searchsorted(at[order], time))
        near = min((k for k in (after - 1, after) if 0 <= k < len(order)), key=lambda k: abs(at[order[k]] - time))
        if abs(at[order[near]] - time) > reach:
            outside.append(row)
        elif record and not _at_rest(q, at, order, time):
            moving.append(row)
        else:
            pairs.append((int(order[near]), row))
    return TimePairs(pairs, moving, outside, shift) if pairs else None


def _shift(at: FloatArray, to: FloatArray) -> float | None:
    """Whole hours that bring most points into the time of the log; None where none does."""
    inside = {
        hours: int(((to + hours * _HOUR >= at[0] - 1) & (to + hours * _HOUR <= at[-1] + 1)).sum())
        for hours in range(-_HOURS, _HOURS + 1)
    }
    if inside[0] * 2 > len(to):
        return 0.0
    best = max(inside, key=lambda hours: (inside[hours], -abs(hours)))
    alone = sum(count == inside[best] for count in inside.values()) == 1
    return best * _HOUR if alone and inside[best] >= 0.9 * len(to) else None


def _at_rest(q: FloatArray, at: FloatArray, order: NDArray[np.int64], time: float) -> bool:
    low, high = np.searchsorted(at[order], [time - _AROUND, time + _AROUND])
    around = q[order[max(0, low - 1) : high + 1]]
    return bool(np.ptp(around, axis=0).max() <= _STILL)
