# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Combined and expanded uncertainty of one figure (JCGM 100), and the odds that it keeps a limit (JCGM 106).

u^2 = u_A^2 + sum u_k^2; degrees of freedom by Welch and Satterthwaite, nu = u^4 / sum (u_k^4 / nu_k); U = k u with k
the quantile of Student's t at (1 + level) / 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scipy import special


@dataclass(frozen=True)
class Uncertainty:
    """Of one figure, in its unit.

    Attributes:
        standard: u, combined.
        freedom: Effective degrees of freedom, infinite where everything is known well.
        expanded: U at `level`, two-sided.
        level: Probability that value +- U covers.
        observed: The part u_A that the repeated visits show.
        parts: (name of the input, its part u_k), largest first.
    """

    standard: float
    freedom: float
    expanded: float
    level: float
    observed: float
    parts: tuple[tuple[str, float], ...] = ()

    @property
    def coverage_factor(self) -> float:
        """K = U / u."""
        return quantile((1 + self.level) / 2, self.freedom)

    def probability_within(self, value: float, limit: float) -> float:
        """P(true value <= limit), where `value` was found."""
        if self.standard == 0:
            return float(value <= limit)
        return student((limit - value) / self.standard, self.freedom)


def combined(
    observed: float, freedom: float, parts: Sequence[tuple[str, float, float]], level: float = 0.95
) -> Uncertainty:
    """The uncertainty of a figure.

    Args:
        observed: u_A, from repeated visits.
        freedom: Its degrees of freedom.
        parts: (name, u_k, its degrees of freedom) of independent contributions; those of one name are pooled in the
            table.
        level: Probability that is to be covered.
    """
    total = math.sqrt(observed**2 + sum(u**2 for _, u, _ in parts))
    weights = sum(u**4 / nu for u, nu in ((observed, freedom), *((u, nu) for _, u, nu in parts)) if u > 0)
    effective = total**4 / weights if weights > 0 else math.inf
    pooled: dict[str, float] = {}
    for name, u, _ in parts:
        pooled[name] = math.hypot(pooled.get(name, 0.0), u)
    table = tuple(sorted(pooled.items(), key=lambda part: -part[1]))
    expanded = quantile((1 + level) / 2, effective) * total
    return Uncertainty(total, effective, expanded, level, observed, table)


def quantile(probability: float, freedom: float) -> float:
    """Of Student's t; of the normal distribution for infinite degrees of freedom."""
    return float(special.ndtri(probability) if math.isinf(freedom) else special.stdtrit(freedom, probability))


def student(t: float, freedom: float) -> float:
    """P(T <= t)."""
    return float(special.ndtr(t) if math.isinf(freedom) else special.stdtr(freedom, t))
