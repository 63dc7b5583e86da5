# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What two threads are worth: the wall time of one over that of two, and the share of the work that is serial.

    python bench/python/bench_threads.py [--rounds 7] [--threads 2] [--json FILE]

Identification of 33 parameters from 100,000 points, without a loss and with Tukey's, and the diagnosis of 20,000 rows
of a loaded KR 500 with lost motion in one joint. One and more threads take turns and must give the same bits; medians.
T threads of work of which a share s is serial take s + (1 - s) / T of the time (G. Amdahl 1967). Nothing else may run
on the machine.
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bench_identification import Arm, make_data, problem
from diagnosis_arms import setting
from diagnosis_sets import drawable, measured, scaled

from fastcal import _core, diagnose

ROWS, POSES = 20_000, 100_000


def identification(loss: str) -> Callable[[int], bytes]:
    """Identifies with so many threads and gives the parameters."""
    arm = Arm()
    given = problem(arm, *make_data(arm, POSES))

    def run(threads: int) -> bytes:
        found = _core.identify(*given, asked=arm.core_indices(), loss=loss, threads=threads)
        return np.asarray(found.theta).tobytes()

    return run


def diagnosis() -> Callable[[int], bytes]:
    """Diagnoses with so many threads and gives what was found, with its numbers."""
    random = np.random.default_rng(5)
    at = setting(random, "kuka_kr500_3", ROWS)
    truth = scaled(at, next(n for n in drawable(at) if n.key == ("backlash", "joint4")), 25.0, random)
    assert truth is not None
    data = measured(at, [truth], random)

    def run(threads: int) -> bytes:
        found = diagnose(at.nominal, data, sigma=at.sigma, threads=threads)
        return repr([(f.label, f.grade, f.parameters) for f in found.effects]).encode()

    return run


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    table = {}
    for name, make in {
        f"identification, {POSES:,} poses": lambda: identification("none"),
        f"identification, {POSES:,} poses, tukey": lambda: identification("tukey"),
        f"diagnosis, {ROWS:,} rows": diagnosis,
    }.items():
        run = make()
        seconds: dict[int, list[float]] = {1: [], given.threads: []}
        answers = {run(1)}
        for _ in range(given.rounds):
            for threads, taken in seconds.items():
                start = time.perf_counter()
                answers.add(run(threads))
                taken.append(time.perf_counter() - start)
        if len(answers) > 1:
            raise SystemExit(f"{name}: the threads change the answer")
        one, more = (statistics.median(taken) for taken in seconds.values())
        share = (given.threads * more / one - 1) / (given.threads - 1)
        table[name] = {"one_s": one, "more_s": more, "ratio": one / more, "serial_share": share}
        print(f"{name:40s} {one:7.3f} s {more:7.3f} s   {one / more:.2f} times, serial {100 * share:.0f} %")
    if given.json:
        shown = {"machine": platform.processor() or platform.machine(), "threads": given.threads, "medians": table}
        given.json.write_text(json.dumps(shown, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
