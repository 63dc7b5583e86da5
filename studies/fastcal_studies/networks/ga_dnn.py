# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""GA-DNN (RX160L, 3 and 5.2): a genetic search for a deep network, PReLU in its first layers, then tanh.

Genes: depth, widths, learning rate, optimizer, the layer where PReLU gives way to tanh, and the split of the rows into
training and validation. Population 100, crossover 0.9, mutation 0.05 as in the paper; fitness is the loss on validation
rows. Successive halving trains each generation a little, the better third three times as long, and so on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fastcal.correction.experts import AxisNetworks
from fastcal.networks.fitting import Schedule
from fastcal.networks.optimizers import RULES
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture
from fastcal.networks.problem import Problem
from fastcal_studies.networks.plain import train_plain
from fastcal_studies.networks.search import Candidate, losses_of, remembered, study_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

DEEPEST, NARROWEST, WIDEST = 12, 4, 32
RATES = (3e-4, 3e-2)
SPLITS = (0.1, 0.15, 0.2, 0.25, 0.3)  # share of the rows for validation, drawn again for each split's number
GENES = 5 + DEEPEST
EPOCHS = 400
BATCH = 200


@dataclass(frozen=True)
class Budget:
    """What a search may cost.

    Attributes:
        population, generations: Of the genetic search.
        rungs: Epochs of each training of a generation; after each but the last, the better third goes on.
    """

    population: int = 100
    generations: int = 5
    rungs: tuple[int, ...] = (4, 12, 36)


FULL = Budget(population=100, generations=20, rungs=(60,))
CROSSOVER, MUTATION, ELITE = 0.9, 0.05, 2


class Network(NamedTuple):
    """What the genes mean."""

    architecture: Architecture
    rate: float
    rule: str
    split: int


def network_of(genes: FloatArray) -> Network:
    """Genes (GENES,) in [0, 1) as a network: depth, switch, rate, rule, split, then the widths."""
    depth = 1 + int(genes[0] * DEEPEST)
    switch = int(genes[1] * (depth + 1))
    widths = tuple(NARROWEST + int(gene * (WIDEST - NARROWEST + 1)) for gene in genes[5 : 5 + depth])
    activations = ("prelu",) * switch + ("tanh",) * (depth - switch)
    rate = float(RATES[0] * (RATES[1] / RATES[0]) ** genes[2])
    return Network(
        Architecture(widths, activations), rate, RULES[int(genes[3] * len(RULES))], int(genes[4] * len(SPLITS))
    )


def fit_ga_dnn(
    problem: Problem, rows: Sequence[IntArray], options: Options, *, budget: Budget | None = None
) -> list[AxisNetworks]:
    """The network that the search finds best, trained at length on each set of rows."""
    best = search(problem, options, budget or (FULL if options.full else Budget()))
    options.notes.append(
        f"the search chose {len(best.architecture.hidden)} hidden layers {list(best.architecture.hidden)}, "
        f"{best.architecture.activations.count('prelu')} of PReLU, {best.rule}, rate {best.rate:.2g}"
    )
    schedule = Schedule(epochs=EPOCHS, batch=BATCH, rule=best.rule, rate=best.rate)
    members = [best.architecture] * len(rows)
    parts = [split_rows(own, best.split, options.seed) for own in rows]
    learnt, judged = [part[0] for part in parts], [part[1] for part in parts]
    return train_plain(problem, members, [problem.axes] * len(rows), learnt, schedule, options, validation=judged)[0]


def split_rows(own: IntArray, split: int, seed: int) -> tuple[IntArray, IntArray]:
    """Training and validation rows of one of the splits."""
    order = np.random.default_rng((seed, 5, split)).permutation(own)
    count = max(1, round(SPLITS[split] * len(own)))
    return np.sort(order[count:]), np.sort(order[:count])


def search(problem: Problem, options: Options, budget: Budget = Budget()) -> Network:
    """The fittest network of the last generation; generations that the storage holds are not trained again."""
    random = np.random.default_rng((options.seed, 6))
    rungs = "-".join(map(str, budget.rungs))
    study = study_of(f"ga-dnn {budget.population} {rungs}", options.storage, options.seed)
    genes = random.random((budget.population, GENES))
    best, least = genes[0], np.inf
    for generation in range(budget.generations):
        if generation > 0 and options.is_over:
            note = f"the search ended after {generation} of {budget.generations} generations: time is up"
            options.notes.append(note)
            break
        options.progress(f"genetic search, generation {generation + 1} of {budget.generations}")
        current = genes
        loss = remembered(
            study,
            generation,
            len(genes),
            lambda current=current: fitness(problem, current, options, budget),  # type: ignore[misc]
        )
        order = np.argsort(loss, kind="stable")
        if loss[order[0]] < least:
            best, least = genes[order[0]].copy(), float(loss[order[0]])
        genes = offspring(genes[order], random)
    return network_of(best)


def fitness(problem: Problem, genes: FloatArray, options: Options, budget: Budget) -> FloatArray:
    """(P,) loss of each on its validation rows, after its last rung; who is left behind is worse than who goes on."""
    loss = np.empty(len(genes))
    alive = np.arange(len(genes))
    every = np.arange(len(problem))
    for rung, epochs in enumerate(budget.rungs):
        candidates = []
        for k in alive:
            net = network_of(genes[k])
            learnt, judged = split_rows(every, net.split, options.seed)
            seed = options.seed * 1009 + int(k)
            candidates.append(Candidate(net.architecture, net.rate, net.rule, problem.axes, learnt, judged, seed))
        now = losses_of(problem, candidates, epochs, BATCH, options)
        order = np.argsort(now, kind="stable")
        loss[alive] = now + len(budget.rungs) - 1 - rung if len(budget.rungs) > 1 else now
        if rung + 1 < len(budget.rungs):
            alive = np.sort(alive[order[: max(1, len(alive) // 3)]])
    return loss


def offspring(sorted_genes: FloatArray, random: np.random.Generator) -> FloatArray:
    """The next generation: the best two as they are, the rest children of tournament winners, fittest first."""
    count = len(sorted_genes)
    children = [row.copy() for row in sorted_genes[:ELITE]]
    while len(children) < count:
        first, second = (sorted_genes[int(random.integers(count, size=3).min())].copy() for _ in range(2))
        if random.random() < CROSSOVER:
            swap = random.random(GENES) < 0.5
            first[swap] = second[swap]
        mutated = random.random(GENES) < MUTATION
        first[mutated] = random.random(int(mutated.sum()))
        children.append(first)
    return np.array(children[:count])
