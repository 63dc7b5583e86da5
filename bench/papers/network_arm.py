# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the papers' network studies share: a simulated arm with errors that no model of fastcal has, and tables.

The true arm is built by the effect library and measured at q + e(q, load), e a sum of waves over pairs of joints,

    e_i = size_i sum_k a_ik sin(n_ik . q + p_ik) (1 + load share),   n_ik of two joints, orders 1 to 2,

which no effect can express: it is what a network is for.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import joblib
import numpy as np
from numpy.typing import NDArray

from fastcal import Dataset, Robot, simulate

FloatArray = NDArray[np.float64]

WAVES = 3


def outside_error(q: FloatArray, payload: FloatArray, sizes: Sequence[float], heaviest: float, seed: int) -> FloatArray:
    """(N, n) joint errors e of the module's equation [rad]; sizes [rad], the load doubles them at `heaviest` [kg]."""
    random = np.random.default_rng((seed, 11))
    e = np.zeros_like(q)
    n = q.shape[1]
    for joint, size in enumerate(sizes):
        for _ in range(WAVES):
            orders = np.zeros(n)
            orders[random.permutation(n)[:2]] = random.integers(1, 3, 2) * random.choice([-1, 1], 2)
            e[:, joint] += size / WAVES**0.5 * np.sin(q @ orders + random.uniform(0, 2 * np.pi))
    return e * (1 + payload / heaviest)[:, np.newaxis]


def measure(
    true: Robot, q: FloatArray, payload: FloatArray, sizes: Sequence[float], heaviest: float, noise: float, seed: int
) -> Dataset:
    """What a tracker sees of the true arm; `noise` [m], and 0.02 mm of repeatability at the tool."""
    sent = Dataset.from_arrays(q, payload=payload)
    bent = replace(sent, q=q + outside_error(q, payload, sizes, heaviest, seed))
    return replace(simulate(true, bent, noise=float(np.hypot(noise, 2e-5)), seed=seed * 7 + len(q)), q=q)


def lengths(errors: FloatArray) -> dict[str, float]:
    """mean, std (n - 1) and max of lengths of errors (N, 3) [m], in mm."""
    length = np.linalg.norm(errors, axis=1) * 1e3
    return {"mean": float(length.mean()), "std": float(length.std(ddof=1)), "max": float(length.max())}


def arguments(doc: str | None) -> argparse.ArgumentParser:
    """The options of every study."""
    parser = argparse.ArgumentParser(description=(doc or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=1, help="how many arms, each with its own errors and noise")
    parser.add_argument("--jobs", type=int, default=1, help="how many of them at a time")
    parser.add_argument("--out", type=Path, help="JSON with every figure of every seed")
    return parser


def run(study: Callable[[int], dict[str, float]], given: argparse.Namespace) -> dict[str, float]:
    """The median over the seeds of every figure; all of them go to --out, after each seed what there is."""
    work = joblib.Parallel(n_jobs=given.jobs, return_as="generator")
    runs: list[dict[str, float]] = []
    median: dict[str, float] = {}
    for one in work(joblib.delayed(study)(seed) for seed in range(given.seeds)):
        runs.append(one)
        median = {key: float(np.median([other[key] for other in runs])) for key in one}
        if given.out:
            content = {"median": median, "runs": runs}
            given.out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return median


def table(title: str, rows: Sequence[tuple[str, float | str, float]]) -> None:
    """Lines of (what, the paper's figure, ours)."""
    print(f"\n{title:58}{'paper':>10}{'fastcal':>10}")
    for label, paper, ours in rows:
        said = paper if isinstance(paper, str) else f"{paper:.3f}"
        print(f"{label:58}{said:>10}{ours:>10.3f}")
