# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The records of `bench_diagnosis`, what is wanted of them, and the page docs/diagnosis-performance.md."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from diagnosis_arms import NOISES
from scipy import stats

KINDS = {"none": 0.22, "single": 0.42, "several": 0.1, "outside": 0.14, "without": 0.06, "smallest": 0.06}
BINS = (3.0, 5.0, 8.0, 12.0, 20.0, 60.0)
WORSE = 1.02  # RMS of held-out poses, noise included, over that of the geometry alone
TWIN = 0.999  # canonical correlation with a true signature, from which on two names are one


@dataclass(frozen=True)
class Record:
    """What was hidden in a set and what was said.

    Attributes:
        found: Of each true cause, is its name or a twin's among those returned?
        wrong: Names without equivalents that are no true cause's; `grade_a_wrong` those of them with grade A.
        exact: Every true cause is named, and nothing but it or its twins.
        masses: Does the user's robot file have them?
        noise: Of the sets: white, heavy-tailed or serial.
        sigma_um, geometry_um, model_um: RMS of a coordinate: the noise, and what the fitted geometry and the model that
            is written are off the true points at poses held out.
    """

    number: int
    kind: str
    arm: str
    truth: list[str]
    snr: list[float]
    verdict: str
    said: list[str]
    named: bool
    detected: bool
    found: list[bool]
    wrong: list[str]
    grade_a_wrong: list[str]
    exact: bool
    masses: bool
    noise: str
    sigma_um: float
    geometry_um: float
    model_um: float
    seconds: float

    @property
    def is_worse(self) -> bool:
        """Does the model that is written predict held-out poses worse than the geometry alone?"""
        return bool(np.hypot(self.model_um, self.sigma_um) > WORSE * np.hypot(self.geometry_um, self.sigma_um))


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % bounds of a share (E. B. Wilson, 1927)."""
    if count == 0:
        return 0.0, 1.0
    bounds = stats.binomtest(hits, count).proportion_ci(0.95, "wilson")
    return float(bounds.low), float(bounds.high)


@dataclass(frozen=True)
class Demand:
    """A share that is counted, and the limits that it must keep."""

    what: str
    hits: int
    count: int
    low: float = 0.0
    high: float = 1.0

    @property
    def is_met(self) -> bool:
        """By the share itself; the bounds say how sure that is."""
        return self.count > 0 and self.low <= self.hits / self.count <= self.high


def demands(records: Sequence[Record]) -> list[Demand]:
    """The acceptance figures."""

    def share(what: str, some: Sequence[Record], hit: Callable[[Record], bool], *limits: float) -> Demand:
        return Demand(what, sum(map(hit, some)), len(some), *limits)

    of = {kind: [r for r in records if r.kind == kind] for kind in KINDS}
    asked = [r for r in records if r.kind != "without"]
    loud = [r for r in asked if r.snr and min(r.snr) >= 12]
    seen = [r for r in of["single"] if r.snr[0] >= 8]
    clear = [r for r in of["single"] if r.snr[0] >= 20]
    outside = of["outside"]
    return [
        share("grade A and wrong, all sets", records, lambda r: bool(r.grade_a_wrong), 0, 0.001),
        share("of these: the true name was excluded", of["without"], lambda r: bool(r.grade_a_wrong)),
        share("of these: the cause is outside the library", outside, lambda r: bool(r.grade_a_wrong)),
        share("held-out poses made worse, all sets", records, lambda r: r.is_worse, 0, 0),
        share("true name in the set, one cause of SNR 8 and more", seen, lambda r: all(r.found), 0.95),
        share("silent where nothing is missing", of["none"], lambda r: not r.detected, 0.99),
        share("any name where nothing is missing", of["none"], lambda r: r.named, 0, 0.01),
        share("unique and wrong, all but excluded", asked, lambda r: bool(r.wrong), 0, 0.02),
        share("unique and wrong, SNR 12 and more", loud, lambda r: bool(r.wrong), 0, 0.005),
        share("unique and right, one cause of SNR 20 and more", clear, lambda r: r.exact, 0.85),
        share("seen at the smallest effect that was promised", of["smallest"], lambda r: r.detected, 0.75, 0.85),
        share("all of two or three causes and nothing else", of["several"], lambda r: r.exact),
        share("a cause outside the library of SNR 12 and more is seen", [r for r in outside if r.snr[0] >= 12], _seen),
    ]


def _seen(r: Record) -> bool:
    return r.detected


def rendered(records: Sequence[Record]) -> str:
    """The page docs/diagnosis-performance.md."""
    out = [
        "# How often a diagnosis is right",
        "",
        f"{len(records)} simulated sets over {len({r.arm for r in records})} arms,",
        "by `bench/python/bench_diagnosis.py`; what is in them, and how they differ from the world, says",
        "[the page of these sets](diagnosis-sets.md). The seeds were used for nothing else.",
        "Bounds are Wilson's at 95 %. A name counts as right where",
        f"its columns hold the true signature to a canonical correlation of {TWIN}. Worse: the RMS of held-out poses,",
        f"noise included, is more than {WORSE:g} times that of the geometry alone.",
        "",
        "| what | sets | share | 95 % bounds | wanted | |",
        "|---|---:|---:|---:|---:|---|",
    ]
    for d in demands(records):
        low, high = wilson(d.hits, d.count)
        told = f"{d.low:.1%} to {d.high:.1%}" if d.low > 0 and d.high < 1 else f"at least {d.low:.1%}" if d.low else ""
        told = told or (f"at most {d.high:.1%}" if d.high < 1 else "")
        mark = "" if not told else "met" if d.is_met else "MISSED"
        out.append(
            f"| {d.what} | {d.count} | {_percent(d.hits, d.count)} | {low:.1%} to {high:.1%} | {told} | {mark} |"
        )
    out += [
        "",
        "One cause, by the root of its noncentrality after geometry:",
        "",
        "| SNR | sets | seen | true name in the set | unique and right | unique and wrong |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for low, high in pairwise(BINS):
        some = [r for r in records if r.kind == "single" and low <= r.snr[0] < high]
        cells = [
            _with_bounds(sum(hit), len(some))
            for hit in (
                [r.detected for r in some],
                [all(r.found) for r in some],
                [r.exact for r in some],
                [bool(r.wrong) for r in some],
            )
        ]
        out.append(f"| {low:g} to {high:g} | {len(some)} | {' | '.join(cells)} |")
    out += ["", "Held-out poses of causes outside the library, SNR 12 and more:", ""]
    closed = [_closed(r) for r in records if r.kind == "outside" and r.snr[0] >= 12]
    if closed:
        low, middle, high = np.quantile(closed, [0.1, 0.5, 0.9])
        out.append(
            f"the model that is written closes {middle:.0%} of the gap between geometry and truth in the median "
            f"(10th percentile {low:.0%}, 90th {high:.0%})."
        )
    out += [
        "",
        "By arm, table of masses and noise:",
        "",
        "| sets | number | silent where nothing is missing | true name, one cause of SNR 8 and more | grade A and "
        "wrong | made worse |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    parts: list[tuple[str, Callable[[Record], bool]]] = [
        *((arm, lambda r, arm=arm: r.arm == arm) for arm in sorted({r.arm for r in records})),
        ("with masses", lambda r: r.masses),
        ("without masses", lambda r: not r.masses),
        *((f"{kind} noise", lambda r, kind=kind: r.noise == kind) for kind in NOISES),
    ]
    for name, belongs in parts:
        some = [r for r in records if belongs(r)]
        quiet = [not r.detected for r in some if r.kind == "none"]
        right = [all(r.found) for r in some if r.kind == "single" and r.snr[0] >= 8]
        cells = [f"{sum(quiet)} of {len(quiet)}", f"{sum(right)} of {len(right)}"]
        cells += [str(sum(bool(r.grade_a_wrong) for r in some)), str(sum(r.is_worse for r in some))]
        out.append(f"| {name} | {len(some)} | {' | '.join(cells)} |")
    seconds = np.array([r.seconds for r in records])
    out += ["", f"A set took {np.median(seconds):.2f} s of one core in the median, {seconds.max():.1f} s at most.", ""]
    return "\n".join(out)


def _closed(r: Record) -> float:
    """Share of the geometry's error at held-out poses that the model mends."""
    return 1 - r.model_um / max(r.geometry_um, 1e-9)


def _percent(hits: int, count: int) -> str:
    return f"{hits / count:.1%}" if count else "none"


def _with_bounds(hits: int, count: int) -> str:
    low, high = wilson(hits, count)
    return f"{_percent(hits, count)} ({low:.1%} to {high:.1%})"
