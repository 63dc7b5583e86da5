# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Temperature behind a first-order filter: what the metal feels of what the sensor reads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def lagged(temperature: FloatArray, time: FloatArray, lag: float) -> FloatArray:
    """(N,) T_f [K] of  lag dT_f/dt = T - T_f,  T (N,) linear between its readings at `time` (N,) [s], lag [s] above 0.

    Exact for such a T: over a step of length h and slope s,
    T_f1 = T_1 - s lag + (T_f0 - T_0 + s lag) exp(-h / lag). At the first moment T_f = T. Rows may come in any order.
    """
    order = np.argsort(time, kind="stable")
    t, T = time[order], temperature[order]
    step = np.diff(t)
    slope = np.divide(np.diff(T), step, out=np.zeros_like(step), where=step > 0)
    keep, steady = np.exp(-step / lag), slope * lag
    jump = np.where(step == 0, np.diff(T), 0.0)
    behind = [0.0]  # T_f - T; a list, since numpy takes ten times as long for one number after the other
    for s, k, j in zip(steady.tolist(), keep.tolist(), jump.tolist(), strict=True):
        behind.append(-s + (behind[-1] + s) * k - j)
    out = np.empty(len(t))
    out[order] = T + behind
    return out
