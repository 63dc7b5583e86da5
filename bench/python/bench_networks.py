# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A swarm and a population of networks beside the same networks one after another, same steps.

    python bench/python/bench_networks.py

The swarm: 30 beetles, 6-20-3 sigmoids, 200 rows, 10 rounds of 3 evaluations. The population: the 100 deep
networks of a genetic search's first generation, batches of 200 of 2,796 rows, 2 epochs. One core, CPU time, since cores
may be shared; then the population's batches on two cores that nothing else uses, wall time, workers started before.
"""

from __future__ import annotations

import time
from collections.abc import Callable

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

Clock = Callable[[], float]


def seconds(work: Callable[[], object], repeats: int = 3, clock: Clock = time.process_time) -> float:
    """Least time of some runs."""
    found = []
    for _ in range(repeats):
        begun = clock()
        work()
        found.append(clock() - begun)
    return min(found)


def learnt(rows: int) -> Problem:
    nominal = load_robot("staubli_rx160l")
    return problem_of(nominal, simulate(perturbed(nominal, seed=1), random_poses(nominal, rows, seed=1), noise=1e-5))


def swarm() -> tuple[float, float]:
    problem, beetles, rounds = learnt(200), 30, 30
    one = Population(7, 3, [ARCHITECTURE])
    model = Coordinates(one, problem, [(0, 1, 2)], torch.device("cpu"))
    theta = torch.cat([one.start([k]) for k in range(beetles)])

    def evaluate(part: torch.Tensor) -> None:
        with torch.no_grad():
            loss(one(part, model.x) - model.wanted[0], 0.0)

    together = seconds(lambda: [evaluate(theta) for _ in range(rounds)])
    return together, seconds(lambda: [evaluate(row[None]) for _ in range(rounds) for row in theta])


def population(jobs: int = 1, clock: Clock = time.process_time) -> tuple[float, float]:
    problem, count = learnt(2796), 100
    candidates = []
    for k, row in enumerate(np.random.default_rng(0).random((count, ga_dnn.GENES))):
        net = ga_dnn.network_of(row)
        split = ga_dnn.split_rows(np.arange(len(problem)), net.split, 0)
        candidates.append(Candidate(net.architecture, net.rate, net.rule, (0, 1, 2), *split, k))

    def train(chosen: list[Candidate], jobs: int) -> None:
        losses_of(problem, chosen, 2, 200, Options(jobs=jobs))

    together = seconds(lambda: train(candidates, jobs), 3, clock)
    return together, seconds(lambda: [train([one], 1) for one in candidates], 1, clock)


def population_on_two_cores() -> tuple[float, float]:
    return population(2, time.perf_counter)


def main() -> None:
    with one_thread():
        for name, measure in (
            ("swarm", swarm),
            ("population", population),
            ("population, two cores", population_on_two_cores),
        ):
            together, apart = measure()
            print(f"{name}: together {together:.3f} s, one after another {apart:.3f} s, {apart / together:.1f} times")


if __name__ == "__main__":
    main()
