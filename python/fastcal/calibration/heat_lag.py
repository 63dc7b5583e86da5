# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Thermal lag: the time constant of a first-order filter that minimizes the residuals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fastcal.arrays import FloatArray

EARNED = 12.0  # drop of chi square that a lag must bring: by chance one of 2,000 sets has it
_LEAST, _MOST = 0.005, 1.0  # shares of the time that the data span
_COUNT = 12
_ROUNDS = 12


def find_lag(left: Callable[[float], float], time: FloatArray | None) -> dict[str, float] | None:
    """The lag {value, std} [s] that leaves least; None where none leaves EARNED less than heat that comes at once.

    Args:
        left: chi square by the lag [s]; 0: none.
        time: (N,) [s].

    The least of a grid, then by golden sections of the logarithm; the standard deviation is half the width over which
    chi square rises by 1, of a parabola through three points.
    """
    if time is None:
        return None
    grid = np.geomspace(_LEAST, _MOST, _COUNT) * float(np.ptp(time))
    values = [left(float(lag)) for lag in grid]
    best = int(np.argmin(values))
    if left(0.0) - values[best] < EARNED:
        return None
    low, high = np.log(grid[max(best - 1, 0)]), np.log(grid[min(best + 1, _COUNT - 1)])
    golden = (5**0.5 - 1) / 2
    inner = [high - golden * (high - low), low + golden * (high - low)]
    found = [left(float(np.exp(x))) for x in inner]
    for _ in range(_ROUNDS):
        if found[0] < found[1]:
            high, inner, found = inner[1], [0.0, inner[0]], [0.0, found[0]]
            inner[0] = high - golden * (high - low)
            found[0] = left(float(np.exp(inner[0])))
        else:
            low, inner, found = inner[0], [inner[1], 0.0], [found[1], 0.0]
            inner[1] = low + golden * (high - low)
            found[1] = left(float(np.exp(inner[1])))
    middle = float((low + high) / 2)
    step = 0.1
    around = [left(float(np.exp(middle + k * step))) for k in (-1, 0, 1)]
    bend = (around[0] - 2 * around[1] + around[2]) / step**2
    lag = float(f"{np.exp(middle):.6g}")
    return {"value": lag, "std": lag * float(np.sqrt(2 / bend)) if bend > 0 else lag}
