# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A swarm and a population of networks beside the same networks one after another, same steps.

    python bench/python/bench_networks.py -o bench/python/bench_networks.json

The swarm: 30 beetles, 6-20-3 sigmoids, 200 rows, 10 rounds of 3 evaluations. The population: the 100 deep
networks of a genetic search's first generation, batches of 200 of 2,796 rows, 2 epochs. One core. What is kept are
ratios of CPU time, each of two measurements that follow one another in the same process: other work on the machine
slows both.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from fastcal import load_robot, random_poses, simulate
from fastcal.calibration.simulation import perturbed
from fastcal.networks.device import one_thread
from fastcal.networks.fitting import loss
from fastcal.networks.options import Options
from fastcal.networks.population import Population
from fastcal.networks.problem import Problem, problem_of
from fastcal_studies.networks import ga_dnn
from fastcal_studies.networks.bso_mlp import ARCHITECTURE
from fastcal_studies.networks.plain import Coordinates
from fastcal_studies.networks.search import Candidate, losses_of

ROUNDS = 5
Work = Callable[[], object]


def seconds(work: Work) -> float:
    """CPU time of a run."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def ratios(together: Work, apart: Work, rounds: int) -> list[float]:
    """How many times as long as together the same takes one after another, round by round."""
    together()  # what is done once
    return [seconds(apart) / seconds(together) for _ in range(rounds)]


def learnt(rows: int) -> Problem:
    nominal = load_robot("staubli_rx160l")
    return problem_of(nominal, simulate(perturbed(nominal, seed=1), random_poses(nominal, rows, seed=1), noise=1e-5))


def swarm() -> tuple[Work, Work]:
    """30 beetles together, and one by one."""
    problem, beetles, rounds = learnt(200), 30, 30
    one = Population(7, 3, [ARCHITECTURE])
    model = Coordinates(one, problem, [(0, 1, 2)], torch.device("cpu"))
    theta = torch.cat([one.start([k]) for k in range(beetles)])

    def evaluate(part: torch.Tensor) -> None:
        with torch.no_grad():
            loss(one(part, model.x) - model.wanted[0], 0.0)

    return (
        lambda: [evaluate(theta) for _ in range(rounds)],
        lambda: [evaluate(row[None]) for _ in range(rounds) for row in theta],
    )


def population() -> tuple[Work, Work]:
    """100 deep networks trained as one, and one after another."""
    problem, count = learnt(2796), 100
    candidates = []
    for k, row in enumerate(np.random.default_rng(0).random((count, ga_dnn.GENES))):
        net = ga_dnn.network_of(row)
        split = ga_dnn.split_rows(np.arange(len(problem)), net.split, 0)
        candidates.append(Candidate(net.architecture, net.rate, net.rule, (0, 1, 2), *split, k))

    def train(chosen: list[Candidate]) -> None:
        losses_of(problem, chosen, 2, 200, Options())

    return lambda: train(candidates), lambda: [train([one]) for one in candidates]


def main() -> None:
    """Prints and, asked to, keeps the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=ROUNDS)
    parser.add_argument("-o", "--out", type=Path, help="record to write")
    asked = parser.parse_args()
    found = {}
    with one_thread():
        for name, works in (("swarm", swarm()), ("population", population())):
            found[name] = [round(ratio, 2) for ratio in ratios(*works, asked.rounds)]
            print(f"{name}: one after another {statistics.median(found[name]):.1f} times, {found[name]}", flush=True)
    if asked.out is not None:
        asked.out.write_text(json.dumps({"rounds": asked.rounds, "ratios": found}) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
