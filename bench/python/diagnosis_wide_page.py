# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The part of docs/diagnosis-performance.md on the wide world."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from diagnosis_page import Demand, wilson
from diagnosis_wide import WideRecord

WORSE = 1.05  # times the RMS of the best plain calibration at rows held out
LOUD = 12.0
FACTORS = ("masses", "payload", "place", "set-ups", "noise", "sigma", "measured", "time", "temperature", "approach")


def wide_demands(records: Sequence[WideRecord]) -> list[Demand]:
    """The acceptance figures."""
    answered = [r for r in records if not r.error]
    drawn = [r for r in answered if r.kind not in ("paper", "real")]
    told = [r for r in drawn if r.kind not in ("slip", "mixed") and r.factors["payload"] != "labels"]
    seen = [(f, s) for r in told if r.kind != "outside" for f, s in zip(r.found, _sizes(r), strict=True) if s >= LOUD]
    quiet = [r for r in told if r.kind == "none"]
    named = sum(r.b_names for r in told)
    return [
        Demand("sets that are answered", len(answered), len(records), 1.0),
        Demand(f"worse than {WORSE} of the best plain calibration", sum(r.ratio > WORSE for r in answered),
               len(answered), 0, 0.01),
        Demand("grade A and wrong, all sets", sum(_has_wrong(r, "A") for r in told), len(told), 0, 0.001),
        Demand("wrong among names of grade B", sum(w[0] == "B" for r in told for w in r.wrong), named, 0, 0.03),
        Demand("no name where nothing is missing", sum(not r.named for r in quiet), len(quiet), 0.97),
        Demand(f"a cause of SNR {LOUD:g} and more that the columns show is named", sum(f for f, _ in seen),
               len(seen), 0.9),
    ]  # fmt: skip


def _sizes(r: WideRecord) -> list[float]:
    """SNR of the causes that the file's columns show."""
    return [s for t, s in zip(r.truth, r.snr, strict=True) if t.lstrip("0123456789.") in r.shown]


def _has_wrong(r: WideRecord, grade: str) -> bool:
    return any(w[0] == grade for w in r.wrong)


def wide_rendered(records: Sequence[WideRecord]) -> str:
    """The part of the page."""
    out = [
        "",
        "## Over all that files differ in",
        "",
        f"{len(records)} sets by `bench_diagnosis.py --world wide`: with and without masses, payloads, columns and",
        "names, 40 to 700 rows, spread, in a box, on grids, along paths, several set-ups, bad columns, arms of 4 to",
        "8 joints, the arms of the papers and rows of open real sets. Plain calibrations: geometry; with compliance;",
        "with sag; with a curve of each joint; each by least squares and with rows thrown out. A name of grade B is",
        "right too where it is at the hidden cause's place and the model closes nine tenths of the gap.",
        "",
        "| what | of | share | 95 % bounds | wanted | |",
        "|---|---:|---:|---:|---:|---|",
    ]
    for d in wide_demands(records):
        low, high = wilson(d.hits, d.count)
        wanted = f"at least {d.low:.1%}" if d.low else f"at most {d.high:.1%}"
        share = f"{d.hits / d.count:.1%}" if d.count else "none"
        mark = "met" if d.is_met else "MISSED"
        out.append(f"| {d.what} | {d.count} | {share} | {low:.1%} to {high:.1%} | {wanted} | {mark} |")
    out += _about_outside(records)
    out += ["", "| sets | number | answered | worse | wrong names | missing causes named |"]
    out += ["|---|---:|---:|---:|---:|---:|"]
    parts: list[tuple[str, Callable[[WideRecord], bool]]] = [
        (kind, lambda r, kind=kind: r.kind == kind) for kind in dict.fromkeys(r.kind for r in records)
    ]
    for what in FACTORS:
        values = sorted({r.factors[what] for r in records if what in r.factors})
        parts += [(f"{what}: {v}", lambda r, what=what, v=v: r.factors.get(what) == v) for v in values]
    for name, belongs in parts:
        some = [r for r in records if belongs(r)]
        found = [f for r in some for f in r.found]
        cells = [str(sum(not r.error for r in some)), str(sum(r.ratio > WORSE for r in some if not r.error))]
        cells += [str(sum(len(r.wrong) for r in some)), f"{sum(found)} of {len(found)}"]
        out.append(f"| {name} | {len(some)} | {' | '.join(cells)} |")
    return "\n".join([*out, ""])


def _about_outside(records: Sequence[WideRecord]) -> list[str]:
    closed = [r.closed for r in records if r.kind == "outside" and not r.error and r.snr[0] >= LOUD]
    if not closed:
        return []
    quarter, half = np.quantile(closed, [0.25, 0.5])
    return [
        "",
        f"Causes outside the library of SNR {LOUD:g} and more, {len(closed)} sets: the model closes {half:.0%} of the",
        f"squared gap at poses held out in the median, {quarter:.0%} in the lower quartile (wanted: 95 % and 80 %).",
    ]
