# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a figure keep its limit? Guarded acceptance and guarded rejection (ISO 14253-1, JCGM 106).

With P the probability that the true figure lies within its limit: pass where P is at least CONFIDENCE, fail where it is
at most 1 - CONFIDENCE, else the measurement can't decide. For an uncertainty that is small beside the limit T this is
the guard band g = t_CONFIDENCE u: pass up to T - g, fail from T + g.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from fastcal.acceptance.figures import Figure
from fastcal.budget.evaluation import Uncertainty, quantile
from fastcal.errors import InvalidInput
from fastcal.units import from_si, to_si

CONFIDENCE = 0.95
ALIKE = 0.999  # odds beyond this, or below its complement, are alike: a page shows no more of them
Verdict = Literal["pass", "fail", "cannot_tell"]

# Name of a limit, as an option takes it: the symbols that it holds for.
LIMITS: dict[str, tuple[str, ...]] = {
    "ap_mm": ("AP",),
    "rp_mm": ("RP",),
    "vap_mm": ("vAP",),
    "ad_mm": ("AD",),
    "rd_mm": ("RD",),
    "dap_mm": ("dAP",),
    "drp_mm": ("dRP",),
    "ap_deg": ("AP_rx", "AP_ry", "AP_rz"),
    "rp_deg": ("RP_rx", "RP_ry", "RP_rz"),
}
PATH_LIMITS: dict[str, tuple[str, ...]] = {
    "at_mm": ("AT",),
    "rt_mm": ("RT",),
    "cr_mm": ("CR",),
    "co_mm": ("CO",),
    "at_deg": ("AT_rx", "AT_ry", "AT_rz"),
    "rt_deg": ("RT_rx", "RT_ry", "RT_rz"),
}
SIGNED = ("AD", *LIMITS["ap_deg"], *PATH_LIMITS["at_deg"])
UNITS = {"m": "mm", "rad": "deg"}  # in which figures are written


@dataclass(frozen=True, eq=False)
class Judged:
    """A figure with its uncertainty and, where a limit was given, what follows.

    Attributes:
        figure, uncertainty: In m or rad.
        limit: None where none was given.
        probability: That the true figure keeps the limit.
        guard: Width of the guard band.
        verdict: pass, fail or cannot_tell; None without a limit.
    """

    figure: Figure
    uncertainty: Uncertainty
    limit: float | None = None
    probability: float | None = None
    guard: float | None = None
    verdict: Verdict | None = None

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `figures`, in mm or degrees."""
        unit = UNITS[self.figure.unit]

        def edge(value: float | None) -> float | None:
            return None if value is None else float(from_si(value, unit))

        return {
            "symbol": self.figure.symbol,
            "where": self.figure.where,
            "unit": unit,
            "value": edge(self.figure.value),
            "standard": edge(self.uncertainty.standard),
            "observed": edge(self.uncertainty.observed),
            "degrees_of_freedom": self.uncertainty.freedom,
            "coverage_factor": self.uncertainty.coverage_factor,
            "expanded": edge(self.uncertainty.expanded),
            "contributions": {name: edge(part) for name, part in self.uncertainty.parts},
            "limit": edge(self.limit),
            "guard": edge(self.guard),
            "probability": self.probability,
            "verdict": self.verdict,
        }


def parsed_limits(given: Mapping[str, float], known: Mapping[str, tuple[str, ...]] = LIMITS) -> dict[str, float]:
    """Limits by symbol in SI; `known` are the names there are.

    Raises:
        InvalidInput: An unknown name, or a limit that is not above 0.
    """
    out: dict[str, float] = {}
    for name, value in given.items():
        if name not in known:
            raise InvalidInput(f"unknown limit '{name}', expected one of {', '.join(known)}")
        if not value > 0:
            raise InvalidInput(f"a limit must be above 0, got {name}={value:g}")
        out |= dict.fromkeys(known[name], float(to_si(value, name.rpartition("_")[2])))
    return out


def judged(figure: Figure, uncertainty: Uncertainty, limits: Mapping[str, float]) -> Judged:
    """The figure held against the limit of its symbol."""
    limit = limits.get(figure.symbol)
    if limit is None:
        return Judged(figure, uncertainty)
    value = abs(figure.value)
    within = uncertainty.probability_within(value, limit)
    if figure.symbol in SIGNED:  # it must not lie beyond the limit on the other side either
        within -= uncertainty.probability_within(value, -limit)
    verdict: Verdict = "pass" if within >= CONFIDENCE else "fail" if within <= 1 - CONFIDENCE else "cannot_tell"
    guard = quantile(CONFIDENCE, uncertainty.freedom) * uncertainty.standard
    return Judged(figure, uncertainty, limit, within, guard, verdict)


def least_sure(figures: Sequence[Judged]) -> list[Judged]:
    """Of each symbol the figure that keeps its limit least surely; where the odds are alike, the largest.

    Odds beyond ALIKE, or below 1 - ALIKE, are alike: a page shows no more of them.
    """

    def order(each: Judged) -> tuple[float, float]:
        return min(max(each.probability or 0.0, 1 - ALIKE), ALIKE), -abs(each.figure.value)

    symbols = dict.fromkeys(each.figure.symbol for each in figures)
    return [min((each for each in figures if each.figure.symbol == symbol), key=order) for symbol in symbols]


def overall(figures: Sequence[Judged], missing: Sequence[str]) -> Verdict | None:
    """Fail where one fails; pass where all pass; None where there was no limit. `missing`: limits without a figure."""
    verdicts = [each.verdict for each in figures if each.verdict is not None]
    if "fail" in verdicts:
        return "fail"
    if missing or "cannot_tell" in verdicts:
        return "cannot_tell"
    return "pass" if verdicts else None
