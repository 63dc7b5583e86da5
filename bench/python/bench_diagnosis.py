# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How often `diagnose` is right: thousands of simulated sets whose cause is known, over arms that carry 6 to 500 kg.

    python bench/python/bench_diagnosis.py [--sets N] [--first K] [--jobs N] [--seed S] [--minutes M] [--out FILE]
    python bench/python/bench_diagnosis.py --render bench/python/bench_diagnosis.json > docs/diagnosis-performance.md
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
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from diagnosis_arms import HELD_OUT, NOISES, Setting, setting
from diagnosis_sets import Truth, drawable, measured, named_truth, of_size, outside_truth, points_of, scaled
from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from fastcal import _core
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.diagnosis.memory import without_memory

KINDS = {"none": 0.22, "single": 0.42, "several": 0.1, "outside": 0.14, "without": 0.06, "smallest": 0.06}
SNR = (3.0, 60.0)
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


def record(number: int, seed: int, only: str | None) -> Record:
    """Simulates set `number`, asks, and compares."""
    random = np.random.default_rng([seed, number])
    kind = only or str(random.choice(list(KINDS), p=list(KINDS.values())))
    at = setting(random)
    if kind == "smallest":  # of all causes
        at = replace(at, nominal=at.complete)
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
    right = [_right_names(at, said, t) for t in truths]
    there = points_of(at, truths)[-HELD_OUT:]
    rows = at.poses.select(np.arange(at.count, at.count + HELD_OUT))
    off = [step.model.poses(rows)[:, :3, 3] - there for step in (said.steps[0], said.steps[-1])]
    geometry, model = (round(1e6 * float(np.sqrt(np.mean(e**2))), 3) for e in off)
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
        snr=[round(t.snr, 3) for t in truths],
        verdict=said.verdict,
        said=[
            f"{f.grade} {f.label} {f.snr:.1f}" + "".join(f" | {e}@{o}" for e, o in f.equivalents) for f in said.effects
        ],
        named=bool(said.effects),
        detected=bool(said.effects) or said.unexplained is not None,
        found=found,
        wrong=[f.label for f in wrong],
        grade_a_wrong=[f.label for f in wrong if f.grade == "A"],
        masses=at.has_masses,
        noise=at.noise,
        sigma_um=round(1e6 * at.sigma, 3),
        geometry_um=geometry,
        model_um=model,
        exact=all(found) and len(returned) == len(truths) and set().union(*returned) <= everything,
        seconds=round(seconds, 2),
    )


def _right_names(at: Setting, said: Diagnosis, truth: Truth) -> set[tuple[str, str]]:
    """The true name, and those of no more parameters whose columns hold its signature all but whole.

    Where masses are not known, a joint that yields is as well named by its sag.
    """
    start = said.search.start
    A, _r, row = start.fit.whitened
    blocks = start.blocks
    d = np.zeros(len(row))
    d[row >= 0] = truth.shift[start.fit.problem.rows[row[row >= 0][::3]]].ravel()
    problem = start.fit.problem
    d[row >= 0] = without_memory(problem, d[row >= 0] / problem.noise.factor, row[row >= 0])
    tests = _core.ScoreTests(A, blocks.columns.values, d, blocks.sizes)
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
    if not at.has_masses and truth.effect == "joint_compliance":
        out.add(("gravity_sag", truth.owner))
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
        "[Diagnosis](diagnosis.md#what-was-simulated). The seeds were used for nothing else.",
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
        named, columns = sum(blocks.sizes[: blocks.count]), blocks.columns.values
        start = time.process_time()
        for _ in range(10):
            _core.ScoreTests(A, columns[:, :named], r, blocks.sizes[: blocks.count])
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
    parser.add_argument("--minutes", type=float, help="begin no set after so many; --first goes on where a run ended")
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
    began = time.monotonic()
    for result in Parallel(n_jobs=options.jobs, return_as="generator")(work):
        if isinstance(result, Record):
            records.append(result)
        if not options.quiet or isinstance(result, str):
            print(result if isinstance(result, str) else _line(result), flush=True)
        if options.out and records and len(records) % 20 == 0:  # a cut run keeps what it has
            _write(options.out, records)
        if options.minutes and time.monotonic() - began > 60 * options.minutes:
            break
    if options.out:
        _write(options.out, records)
    print(rendered(records))


def _write(path: Path, records: Sequence[Record]) -> None:
    lines = ",\n".join(json.dumps(asdict(r), separators=(",", ":")) for r in records)
    path.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def _line(r: Record) -> str:
    right = r.exact or (not r.truth and not r.detected)
    mark = "A!" if r.grade_a_wrong else "w" if r.wrong else "ok" if right else ""
    truth = ", ".join(f"{t} ({s:.1f})" for t, s in zip(r.truth, r.snr, strict=True))
    said = "; ".join(r.said)
    return f"{r.number:5} {mark:2} {r.kind} {r.arm}: {truth} -> {r.verdict}: {said} found {r.found} {r.seconds:.1f} s"


if __name__ == "__main__":
    main()
