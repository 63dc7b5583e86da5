# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How often `diagnose` is right: thousands of simulated sets whose cause is known, over arms that carry 6 to 500 kg.

    python bench/python/bench_diagnosis.py [--sets N] [--first K] [--jobs N] [--seed S] [--minutes M] [--out FILE]
    python bench/python/bench_diagnosis.py ... --out FILE --go-on        sets that FILE holds already are not made again
    python bench/python/bench_diagnosis.py --world wide ...         over all that files differ in: diagnosis_worlds.py
    python bench/python/bench_diagnosis.py --cluster ADDRESS ...    its workers have this folder on PYTHONPATH
    python bench/python/bench_diagnosis.py --render bench/python/bench_diagnosis.json > docs/diagnosis-performance.md

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
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from diagnosis_arms import HELD_OUT, Setting, setting
from diagnosis_page import KINDS, TWIN, Record, rendered
from diagnosis_sets import Truth, drawable, measured, named_truth, of_size, outside_truth, points_of, scaled
from diagnosis_wide import WIDE_KINDS, WideRecord, wide_line, wide_tried
from diagnosis_wide_page import wide_rendered
from threadpoolctl import threadpool_limits

from fastcal import _core
from fastcal.calibration.processes import workers
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.diagnosis.blocks import columns_at
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.variants import effect_has_moment
from fastcal.io.atomic import write_text

SNR = (3.0, 60.0)


# What comes to rest at once is a step, slowly a drift, and heat that rises steadily moves a base as one: to leave a
# cause out of the library is to leave these out as well.
LIMITS = {
    "base_step": ("base_settling@base", "thermal_base@base"),
    "base_drift": ("base_settling@base", "thermal_base@base"),
}


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
    excluded = [name for t in truths for name in (f"{t.effect}@{t.owner}", *LIMITS.get(t.effect, ()))]
    excluded = excluded if kind == "without" else []
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
            out += [found, *_stepped_again(at, found, random)]
    return out[:count]


def _stepped_again(at: Setting, first: Truth, random: np.random.Generator) -> list[Truth]:
    """Of half of the steps: one more of the same thing, at another moment."""
    if not effect_has_moment(first.effect) or random.uniform() < 0.5:
        return []
    moments = [n for n in drawable(at) if n.key == (first.effect, first.owner) and n.entry != first.entry]
    if not moments:
        return []
    again = scaled(at, moments[int(random.integers(len(moments)))], first.snr, random)
    return [again] if again is not None else []


def compared(number: int, kind: str, at: Setting, truths: Sequence[Truth], said: Diagnosis, seconds: float) -> Record:
    """What was said beside what is true."""
    right = [_right_names(at, said, t) for t in truths]
    there = points_of(at, truths)[-HELD_OUT:]
    # Of all rows: heat that lags depends on the temperatures before.
    off = [step.model.poses(at.poses)[-HELD_OUT:, :3, 3] - there for step in (said.steps[0], said.steps[-1])]
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
    d[row >= 0] = decorrelated(problem, d[row >= 0] / problem.noise.factor, row[row >= 0])
    tests = _core.ScoreTests(A, columns_at(start.fit).values, d, blocks.sizes)
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=2400)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--cluster", help="address of a Dask scheduler, in place of jobs")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--world", choices=("usual", "wide"), default="usual")
    parser.add_argument("--only", choices=sorted({*KINDS, *WIDE_KINDS}))
    parser.add_argument("--out", type=Path, help="the records, as JSON")
    parser.add_argument("--minutes", type=float, help="begin no set after so many; --go-on makes the others")
    parser.add_argument("--go-on", action="store_true", help="--out holds records of this seed and world: keep them")
    parser.add_argument("--quiet", action="store_true", help="no line a set")
    parser.add_argument("--render", type=Path, nargs="+", help="prints the page of records that --out wrote")
    options = parser.parse_args()
    if options.render:
        print(_page(_read(options.render)), end="")
        return
    of_world, line = (tried, _line) if options.world == "usual" else (wide_tried, wide_line)
    records = _read([options.out]) if options.go_on and options.out and options.out.exists() else []
    numbers = still_to_make(records, range(options.first, options.first + options.sets))
    began = time.monotonic()
    with workers(options.jobs, options.cluster) as side_by_side:
        for result in side_by_side.results(partial(of_world, seed=options.seed, only=options.only), numbers):
            if not isinstance(result, str):
                records.append(result)
            if not options.quiet or isinstance(result, str):
                print(result if isinstance(result, str) else line(result), flush=True)
            if options.out and not isinstance(result, str):  # a cut run keeps what it has
                _write(options.out, records)
            if options.minutes and time.monotonic() - began > 60 * options.minutes:
                break
    if options.out:
        _write(options.out, records)
    print(_page(records))


def still_to_make(records: Sequence[Any], numbers: Sequence[int]) -> list[int]:
    """Numbers of the sets of which there is no record."""
    made = {of.number for of in records}
    return [number for number in numbers if number not in made]


def _read(paths: Sequence[Path]) -> list[Any]:
    """Records of either world, in the order of the files."""
    entries = [entry for path in paths for entry in json.loads(path.read_text(encoding="utf-8"))]
    return [WideRecord(**entry) if "factors" in entry else Record(**entry) for entry in entries]


def _page(records: Sequence[Any]) -> str:
    """The page of the usual world's records, with a part on those of the wide one."""
    wide = [r for r in records if isinstance(r, WideRecord)]
    usual = [r for r in records if isinstance(r, Record)]
    return (rendered(usual) if usual else "") + (wide_rendered(wide) if wide else "")


def _write(path: Path, records: Sequence[Any]) -> None:
    ordered = sorted(records, key=lambda of: of.number)
    lines = ",\n".join(json.dumps(asdict(r), separators=(",", ":")) for r in ordered)
    write_text(path, f"[\n{lines}\n]\n")


def _line(r: Record) -> str:
    right = r.exact or (not r.truth and not r.detected)
    mark = "A!" if r.grade_a_wrong else "w" if r.wrong else "ok" if right else ""
    truth = ", ".join(f"{t} ({s:.1f})" for t, s in zip(r.truth, r.snr, strict=True))
    said = "; ".join(r.said)
    return f"{r.number:5} {mark:2} {r.kind} {r.arm}: {truth} -> {r.verdict}: {said} found {r.found} {r.seconds:.1f} s"


if __name__ == "__main__":
    main()
