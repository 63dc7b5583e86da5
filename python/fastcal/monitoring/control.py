# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Control charts of checks: EWMA of the misfit, CUSUM of each number, for what moves too slowly for a single check.

Misfit: z = Phi^-1(1 - p) of each check is N(0, 1) while nothing changes; its exponentially weighted mean has a limit
(S. Roberts 1959). A number: checks of one model share its error, so what is charted is the innovation u: the estimate
less what the checks before it let expect, over its standard deviation, N(0, 1) and independent while nothing changes (a
Kalman filter of a constant; self-starting CUSUM of D. Hawkins 1987). Its cumulative sums (E. Page 1954) beyond a slack
of half a standard deviation have a limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from fastcal.arrays import FloatArray

WEIGHT, WIDTH = 0.3, 3.0  # of the EWMA, and its limit in standard deviations
SLACK, LIMIT = 0.5, 7.0  # of the CUSUM: one side alone reaches it by chance once in 7,000 checks
_LEAST_P = 1e-16


@dataclass(frozen=True, eq=False)
class Chart:
    """A charted quantity over the checks of one model.

    Attributes:
        name: "misfit", or owner and name of a number.
        value: (k,) what is charted; limit (k,) where it alarms.
        low: (k,) for a CUSUM the sum downwards, at most 0; None for the misfit.
        alarms: Indices of the checks beyond a limit.
    """

    name: str
    value: FloatArray
    limit: FloatArray
    low: FloatArray | None
    alarms: list[int]


def misfit_chart(p_values: Sequence[float]) -> Chart:
    """EWMA of the misfits' normal scores."""
    scores = -special.ndtri(np.clip(np.asarray(p_values, dtype=float), _LEAST_P, 1 - _LEAST_P))
    value, mean = np.zeros(len(scores)), 0.0
    for k, score in enumerate(scores):
        mean = (1 - WEIGHT) * mean + WEIGHT * score
        value[k] = mean
    grown = 1 - (1 - WEIGHT) ** (2 * np.arange(1, len(scores) + 1))
    limit = WIDTH * np.sqrt(WEIGHT / (2 - WEIGHT) * grown)
    return Chart("misfit", value, limit, None, np.flatnonzero(value > limit).tolist())


def number_chart(name: str, change: Sequence[float], std: Sequence[float], std_noise: Sequence[float]) -> Chart:
    """Two-sided CUSUM of a number's innovations.

    Args:
        name: Of the number.
        change: (k,) estimates of the checks.
        std: (k,) their standard deviations, the model's own share in them.
        std_noise: (k,) the same without it.
    """
    u = innovations(np.asarray(change), np.asarray(std), np.asarray(std_noise))
    high, low = np.zeros(len(u)), np.zeros(len(u))
    above = below = 0.0
    for k, each in enumerate(u):
        above, below = max(0.0, above + each - SLACK), min(0.0, below + each + SLACK)
        high[k], low[k] = above, below
    return Chart(name, high, np.full(len(u), LIMIT), low, np.flatnonzero((high > LIMIT) | (low < -LIMIT)).tolist())


def innovations(change: FloatArray, std: FloatArray, std_noise: FloatArray) -> FloatArray:
    """(k,) each estimate less its prediction by those before it, over its standard deviation."""
    out = np.zeros(len(change))
    mean = 0.0
    variance = float(max(std[0] ** 2 - std_noise[0] ** 2, 0.0)) if len(std) else 0.0
    for k, (value, noise) in enumerate(zip(change, std_noise**2, strict=True)):
        total = variance + noise
        out[k] = (value - mean) / np.sqrt(total) if total > 0 else 0.0
        gain = variance / total if total > 0 else 0.0
        mean, variance = mean + gain * (value - mean), (1 - gain) * variance
    return out
