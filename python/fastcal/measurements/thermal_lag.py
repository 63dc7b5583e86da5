# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Temperature behind a first-order filter: what the metal feels of what the sensor reads."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray


def lagged(temperature: FloatArray, time: FloatArray, lag: float) -> FloatArray:
    """(N,) T_f [K] of  lag dT_f/dt = T - T_f,  T (N,) linear between its readings at `time` (N,) [s], lag [s] above 0.

    Exact for such a T: over a step of length h and slope s,
    T_f1 = T_1 - s lag + (T_f0 - T_0 + s lag) exp(-h / lag). At the first moment T_f = T. Rows may come in any order.
    """
    order = np.argsort(time, kind="stable")
    t, T = time[order], temperature[order]
    step = np.diff(t)
    slope = np.divide(np.diff(T), step, out=np.zeros_like(step), where=step > 0)
    jump = np.where(step == 0, np.diff(T), 0.0)
    out = np.empty(len(t))
    out[order] = T + np.append(0.0, _recurrence(np.exp(-step / lag), slope * lag * np.expm1(-step / lag) - jump))
    return out


def _recurrence(a: FloatArray, b: FloatArray) -> FloatArray:
    """(N,) x_i = a_i x_(i-1) + b_i from x_-1 = 0, steps joined two by two (W. Hillis, G. Steele 1986)."""
    a, b, joined = a.copy(), b.copy(), 1
    while joined < len(b) and a[joined:].any():
        b[joined:] += a[joined:] * b[:-joined]
        a[joined:] *= a[:-joined].copy()
        joined *= 2
    return b
