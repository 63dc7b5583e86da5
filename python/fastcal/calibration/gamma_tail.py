# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The upper tail of the gamma law, and so of chi-squared, without importing SciPy, which takes longer than a fit."""

from __future__ import annotations

import math

_ROUNDS = 10_000
_SMALL = 1e-300


def gamma_tail(a: float, x: float) -> float:
    """Q(a, x) = Gamma(a, x) / Gamma(a), a > 0, x >= 0, as `scipy.special.gammaincc`.

    The series for x < a + 1, else Lentz's continued fraction (W. Press et al., Numerical Recipes, 6.2). A chi-squared
    with k degrees of freedom is above s with probability Q(k / 2, s / 2).
    """
    if math.isnan(a) or math.isnan(x):
        return math.nan
    if x <= 0:
        return 1.0
    if math.isinf(x):
        return 0.0
    front = math.exp(a * math.log(x) - x - math.lgamma(a))
    if x < a + 1:
        term = total = 1 / a
        for n in range(1, _ROUNDS):
            term *= x / (a + n)
            total += term
            if term < total * 1e-17:
                break
        return max(0.0, 1 - front * total)
    b = x + 1 - a
    c, d = 1 / _SMALL, 1 / b
    h = d
    for n in range(1, _ROUNDS):
        step = -n * (n - a)
        b += 2
        d = 1 / (step * d + b or _SMALL)
        c = b + step / c or _SMALL
        h *= c * d
        if abs(c * d - 1) < 1e-16:
            break
    return front * h
