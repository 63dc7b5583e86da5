# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Counts, part by part of what was identified, how often 95 % intervals hold the truth over simulated sets."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import joblib
import numpy as np
from bench_coverage import GOAL, wilson

from fastcal.io.atomic import write_text

Misses = dict[str, list[tuple[float, bool]]]  # of a part: over its deviation, and whether the interval holds the truth


def count_parts(description: str | None, trial: Callable[[int], Misses | None], parts: Sequence[str]) -> None:
    """The command of a benchmark: runs trials of seeds, prints each part's share and writes the record.

    Args:
        description: Of the benchmark.
        trial: Misses by part of the set of a seed; None where it is not counted.
        parts: Their names, in the order of the table.
    """
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.sets)
    trials = joblib.Parallel(given.jobs)(joblib.delayed(trial)(seed) for seed in seeds)
    good = [of for of in trials if of is not None]
    rows: dict[str, dict[str, float]] = {}
    print(f"{given.sets} sets, {given.sets - len(good)} of them not counted")
    for part in parts:
        every = [miss for of in good for miss in of[part]]
        hits = sum(held for _, held in every)
        low, high = wilson(hits, len(every))
        z = np.array([off for off, _ in every])
        rows[part] = {"counted": len(every), "covered": hits / max(len(every), 1), "low": low, "high": high}
        rows[part]["rms_deviations"] = float(np.sqrt(np.mean(z**2))) if len(z) else float("nan")
        met = GOAL[0] <= rows[part]["covered"] <= GOAL[1]
        print(
            f"{'met     ' if met else 'NOT MET '}{part}: {rows[part]['covered']:.1%} of {len(every)} "
            f"({low:.1%} to {high:.1%}), misses {rows[part]['rms_deviations']:.2f} deviations"
        )
    if given.out is not None:
        record = {"sets": given.sets, "first": given.first, "not_counted": given.sets - len(good), "parts": rows}
        write_text(given.out, json.dumps(record, indent=2) + "\n")
