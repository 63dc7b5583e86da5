# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How often `diagnose` is right: thousands of simulated sets whose cause is known, over three arms.

    python bench/python/bench_diagnosis.py [--sets N] [--first K] [--jobs N] [--seed S] [--only KIND] [--out FILE]
    python bench/python/bench_diagnosis.py --render FILE... > docs/diagnosis-performance.md
    python bench/python/bench_diagnosis.py --timing

Kinds of sets: none (nothing hidden), single (one cause of the library), several (two or three), outside (a cause that
the library lacks), without (one cause whose name is excluded), smallest (one cause of the size that the diagnosis says
it would see four times in five). Set number k of a seed is the same whatever the jobs and the other sets are. The
core and numpy run on one thread a job.
"""

from __future__ import annotations

import argparse
import json
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from diagnosis_sets import (
    Setting,
    Truth,
    drawable,
    measured,
    named_truth,
    of_size,
    outside_truth,
    scaled,
    setting,
)
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from fastcal import _core
from fastcal.diagnosis import Diagnosis, diagnose

KINDS = {"none": 0.2, "single": 0.4, "several": 0.12, "outside": 0.08, "without": 0.1, "smallest": 0.1}
SNR = (3.0, 60.0)
BINS = (3.0, 5.0, 8.0, 12.0, 20.0, 60.0)
TWIN = 0.999  # canonical correlation with a true signature, from which on two names are one


@dataclass(frozen=True)
class Record:
    """What was hidden in a set and what was said.

    Attributes:
        found: Of each true cause, is its name or a twin's among those returned?
        wrong: Names without equivalents that are no true cause's; `grade_a_wrong` those of them with grade A.
        exact: Every true cause is named, and nothing but it or its twins.
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
    seconds: float


def record(number: int, seed: int, only: str | None) -> Record:
    """Simulates set `number`, asks, and compares."""
    random = np.random.default_rng([seed, number])
    kind = only or str(random.choice(list(KINDS), p=list(KINDS.values())))
    at = setting(random)
    truths: list[Truth] = []
    wanted = float(np.exp(random.uniform(*np.log(SNR))))
    if kind in ("single", "without"):
        truths = [_draw(at, wanted, random)]
    elif kind == "several":
        truths = _different(at, int(random.integers(2, 4)), random)
    elif kind == "outside":
        truths = [outside_truth(at, wanted, random)]
    elif kind == "smallest":
        truths = [of_size(at, _ask(at, [], random, []), random)]
    excluded = [f"{t.effect}@{t.owner}" for t in truths] if kind == "without" else []
    start = time.process_time()
    said = _ask(at, truths, random, excluded)
    seconds = time.process_time() - start
    return compared(number, kind, at, truths, said, seconds)


def _ask(at: Setting, truths: Sequence[Truth], random: np.random.Generator, excluded: list[str]) -> Diagnosis:
    claimed = at.sigma if random.uniform() < 0.5 else None
    return diagnose(at.nominal, measured(at, truths, random), exclude=excluded, sigma=claimed)


def _draw(at: Setting, wanted: float, random: np.random.Generator) -> Truth:
    while True:
        found = named_truth(at, wanted, random)
        if found is not None:
            return found


def _different(at: Setting, count: int, random: np.random.Generator) -> list[Truth]:
    out: list[Truth] = []
    while len(out) < count:
        found = _draw(at, float(np.exp(random.uniform(np.log(10.0), np.log(SNR[1])))), random)
        if all((found.effect, found.owner) != (t.effect, t.owner) for t in out):
            out.append(found)
    return out


def compared(number: int, kind: str, at: Setting, truths: Sequence[Truth], said: Diagnosis, seconds: float) -> Record:
    """What was said beside what is true."""
    right = [_right_names(said, t) for t in truths]
    everything = set().union(*right)
    returned = [{(f.effect, f.owner), *f.equivalents} for f in said.effects if f.grade != "C"]
    named = [f for f in said.effects if f.grade in "AB"]
    wrong = [f for f in named if not f.equivalents and (f.effect, f.owner) not in everything]
    found = [any(names & r for r in returned) for names in right]
    return Record(
        number=number,
        kind=kind,
        arm=str(at.nominal.spec["name"]),
        truth=[f"{t.entry.get('order', '')}{t.effect}@{t.owner}" for t in truths],
        snr=[t.snr for t in truths],
        verdict=said.verdict,
        said=[
            f"{f.grade} {f.label} {f.snr:.1f}" + "".join(f" | {e}@{o}" for e, o in f.equivalents) for f in said.effects
        ],
        named=bool(said.effects),
        detected=bool(said.effects) or said.unexplained is not None,
        found=found,
        wrong=[f.label for f in wrong],
        grade_a_wrong=[f.label for f in wrong if f.grade == "A"],
        exact=all(found) and len(returned) == len(truths) and set().union(*returned) <= everything,
        seconds=seconds,
    )


def _right_names(said: Diagnosis, truth: Truth) -> set[tuple[str, str]]:
    """The true name, and those of no more parameters whose columns hold its signature all but whole."""
    start = said.search.start
    A, _r, row = start.fit.whitened
    blocks = start.blocks
    d = np.zeros(len(row))
    d[row >= 0] = truth.shift[start.fit.problem.rows[row[row >= 0][::3]]].ravel()
    tests = _core.ScoreTests(A, blocks.columns, d / said.search.problem.noise.factor, blocks.sizes)
    share = np.asarray(tests.scores.statistic) / tests.remaining
    rank = np.asarray(tests.scores.rank)
    out: set[tuple[str, str]] = set()
    if not truth.entry:
        return out
    own = [int(rank[i]) for i, n in enumerate(blocks.names) if n.key == (truth.effect, truth.owner)]
    for i, name in enumerate(blocks.names):
        richer = name.owner == truth.owner and truth.effect in name.traits.generalizes
        if share[i] > TWIN**2 and rank[i] <= max(own, default=6) and not richer:
            out.add(name.key)
    return {*out, (truth.effect, truth.owner)}


def tried(number: int, seed: int, only: str | None) -> Record | str:
    """`record`, or what went wrong."""
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore")
        try:
            return record(number, seed, only)
        except Exception:  # noqa: BLE001 - one set in thousands must not cost the others
            return f"set {number}: {traceback.format_exc()}"


def wilson(hits: int, count: int) -> tuple[float, float]:
    """95 % bounds of a share (E. B. Wilson, 1927)."""
    if count == 0:
        return 0.0, 1.0
    z, p = 1.959964, hits / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return max(0.0, float(middle - half)), min(1.0, float(middle + half))


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
    seen = [r for r in of["single"] if r.snr[0] >= 5]
    return [
        share("any name where nothing is missing", of["none"], lambda r: r.named, 0, 0.02),
        share("true name in the set, one cause of SNR 5 and more", seen, lambda r: all(r.found), 0.93),
        share("unique and wrong, all sets", asked, lambda r: bool(r.wrong), 0, 0.02),
        share("unique and wrong, SNR 12 and more", loud, lambda r: bool(r.wrong), 0, 0.005),
        share(
            "unique and right, one cause of SNR 20 and more",
            [r for r in of["single"] if r.snr[0] >= 20],
            lambda r: r.exact,
            0.85,
        ),
        share("seen at the smallest effect that was told", of["smallest"], lambda r: r.detected, 0.75, 0.85),
        share("grade A and wrong, all sets", asked, lambda r: bool(r.grade_a_wrong), 0, 0.005),
        share("grade A and wrong, true name excluded", of["without"], lambda r: bool(r.grade_a_wrong), 0, 0.005),
        share("all of two or three causes and nothing else", of["several"], lambda r: r.exact),
        share("a cause outside the library has a grade A name", of["outside"], lambda r: bool(r.grade_a_wrong)),
        share(
            "a cause outside the library of SNR 12 and more is seen",
            [r for r in of["outside"] if r.snr[0] >= 12],
            lambda r: r.detected,
        ),
    ]


def rendered(records: Sequence[Record]) -> str:
    """The page docs/diagnosis-performance.md."""
    out = [
        "# How often a diagnosis is right",
        "",
        f"{len(records)} simulated sets over {len({r.arm for r in records})} arms,",
        "by `bench/python/bench_diagnosis.py`; its head and `diagnosis_sets.py` say what is in them.",
        "Bounds are Wilson's at 95 %. A name counts as right where",
        f"its columns hold the true signature to a canonical correlation of {TWIN}.",
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
    seconds = np.array([r.seconds for r in records])
    out += ["", f"A set took {np.median(seconds):.2f} s of one core in the median, {seconds.max():.1f} s at most.", ""]
    return "\n".join(out)


def _percent(hits: int, count: int) -> str:
    return f"{hits / count:.1%}" if count else "none"


def _with_bounds(hits: int, count: int) -> str:
    low, high = wilson(hits, count)
    return f"{_percent(hits, count)} ({low:.1%} to {high:.1%})"


def timing() -> str:
    """CPU seconds of one core: a whole diagnosis of 300 and of 5,000 rows, and the screening of 300 alone."""
    out = []
    for rows in (300, 5000):
        random = np.random.default_rng(5)
        at = setting(random, "kuka_kr500_3", rows)
        truth = scaled(at, next(n for n in drawable(at) if n.key == ("backlash", "joint4")), 25.0, random)
        data = measured(at, [truth] if truth else [], random)
        start = time.process_time()
        found = diagnose(at.nominal, data, sigma=at.sigma)
        out.append(f"{rows} rows: {time.process_time() - start:.2f} s, {found.verdict}: {found.effects[0].label}")
        A, r, _row = found.search.start.fit.whitened
        blocks = found.search.start.blocks
        named = sum(blocks.sizes[: blocks.count])
        start = time.process_time()
        for _ in range(10):
            _core.ScoreTests(A, blocks.columns[:, :named], r, blocks.sizes[: blocks.count])
        taken = (time.process_time() - start) / 10
        out.append(f"{rows} rows: screening of {blocks.count} names {1e3 * taken:.1f} ms")
    return "\n".join(out)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=2400)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=KINDS)
    parser.add_argument("--out", type=Path, help="the records, as JSON")
    parser.add_argument("--quiet", action="store_true", help="no line a set")
    parser.add_argument("--render", type=Path, nargs="+", help="prints the page of records that --out wrote")
    parser.add_argument("--timing", action="store_true")
    options = parser.parse_args()
    if options.timing:
        with threadpool_limits(1):
            print(timing())
        return
    if options.render:
        files = [json.loads(path.read_text(encoding="utf-8")) for path in options.render]
        print(rendered([Record(**entry) for entries in files for entry in entries]), end="")
        return
    numbers = range(options.first, options.first + options.sets)
    work = (delayed(tried)(k, options.seed, options.only) for k in numbers)
    records: list[Record] = []
    for result in Parallel(n_jobs=options.jobs, return_as="generator")(work):
        if isinstance(result, Record):
            records.append(result)
        if not options.quiet or isinstance(result, str):
            print(result if isinstance(result, str) else _line(result), flush=True)
        if options.out and records and len(records) % 100 == 0:  # a cut run keeps what it has
            _write(options.out, records)
    if options.out:
        _write(options.out, records)
    print(rendered(records))


def _write(path: Path, records: Sequence[Record]) -> None:
    path.write_text(json.dumps([asdict(r) for r in records], indent=0) + "\n", encoding="utf-8")


def _line(r: Record) -> str:
    right = r.exact or (not r.truth and not r.detected)
    mark = "A!" if r.grade_a_wrong else "w" if r.wrong else "ok" if right else ""
    truth = ", ".join(f"{t} ({s:.1f})" for t, s in zip(r.truth, r.snr, strict=True))
    said = "; ".join(r.said)
    return f"{r.number:5} {mark:2} {r.kind} {r.arm}: {truth} -> {r.verdict}: {said} found {r.found} {r.seconds:.1f} s"


if __name__ == "__main__":
    main()
