# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The SR210D paper's network from five starts, fastcal's on the same rows, and its searches on its function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from fastcal.correction.experts import Expert
from fastcal.measurements.dataset import Dataset
from fastcal.networks.device import one_thread
from fastcal.networks.gaussian_process import fit_gaussian_process
from fastcal.networks.mlp import fit_mlp
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem, problem_of
from fastcal.networks.training import train
from fastcal.robot.robot import Robot
from fastcal_studies.exhibits import MM, lengths_mm
from fastcal_studies.networks.beetles import Swarm, antennae_search, michalewicz, swarm_search
from fastcal_studies.networks.bso_mlp import ARCHITECTURE, BEETLES, SCHEDULE, fit_from_search
from fastcal_studies.networks.plain import fit_plain
from fastcal_studies.searches import Counted, Objective, bee_colony, genetic, particle_swarm
from fastcal_studies.simulated import FloatArray, left
from fastcal_studies.study import Run

MINIMUM, CLOSE = -1.8013034, 1e-4
EVALUATIONS, REPEATS, BEETLES_ALONE = 3000, 20, 20
DRAWN = 30  # points of a curve of convergence
DIGITS = 1e-7  # of MINIMUM
ENSEMBLE = 3
Search = Callable[[Counted, FloatArray, int, int], None]


def _beetle_swarm(f: Counted, starts: FloatArray, evaluations: int, seed: int) -> None:
    swarm_search(f, starts, Swarm(iterations=(evaluations // len(starts) - 1) // 3), seed=seed)


def _beetles(f: Counted, starts: FloatArray, evaluations: int, seed: int) -> None:
    """Each walks alone; sent out anew until the evaluations are spent, as one walk is too short to use them."""
    walk = 0
    while f.evaluations < evaluations:
        iterations = min(150, (evaluations - f.evaluations) // 3)
        antennae_search(f, starts[walk % len(starts)][np.newaxis], iterations=max(iterations, 1), seed=seed + walk)
        walk += 1


SEARCHES: dict[str, Search] = {
    "BAS": _beetles,
    "BSO": _beetle_swarm,
    "PSO": particle_swarm,
    "GA": genetic,
    "ABC": bee_colony,
}


def networks(
    stiff: Robot, best: Robot, by_current: Robot, learnt: Dataset, unseen: Dataset, seed: int, full: bool
) -> Run:
    """Errors [mm] on the rows learnt and on others; `stiff` is the paper's model before networks, `best` fastcal's.

    `by_current` is fastcal's fit of all rows with compliances that take motor currents for torques.
    """
    problem, ours, frictional = (problem_of(model, learnt, seed=seed) for model in (stiff, best, by_current))
    options = Options(seed=seed)
    own = [np.arange(len(problem))]
    budget = (3 if full else 1) * BEETLES * 121
    rows = [np.arange(len(ours))] * ENSEMBLE
    starts: Run = {}

    def begun(name: str) -> list[Expert]:
        return [*fit_from_search(problem, own, options, partial(_drawn, SEARCHES[name], budget, starts, name))]

    with one_thread():
        fitted: dict[str, tuple[Problem, list[Expert]]] = {
            "random": (problem, [*fit_plain(problem, own, options, architecture=ARCHITECTURE, schedule=SCHEDULE)]),
            **{name.lower(): (problem, begun(name)) for name in SEARCHES if name != "BAS"},
            "mlp": (problem, [*fit_mlp(problem, [own[0]] * ENSEMBLE, options)]),
            "bso_ours": (ours, [*fit_from_search(ours, rows[:1], options, partial(_found, _beetle_swarm, budget))]),
            "best_mlp": (ours, [*fit_mlp(ours, rows, options)]),
            "best": (ours, [*fit_gaussian_process(ours, rows[:1], options)]),
            "by_current": (frictional, [*fit_gaussian_process(frictional, rows[:1], options)]),
        }
    out: Run = {name: {} for name in ("before", "best_before", *fitted)}
    axes: Run = {}
    for part, data in (("learnt", learnt), ("unseen", unseen)):
        for name, model in (("before", stiff), ("best_before", best)):
            out[name][part] = lengths_mm(left(model, data))
        for name, (of, members) in fitted.items():
            model = of.robot
            predicted = np.mean([member.displacement(model.inputs(data.q, data.payload)) for member in members], axis=0)
            errors = left(model, data) - predicted
            out[name][part] = lengths_mm(errors)
            if name in ("bso", "best"):
                out[name][f"{part}_by_pose"] = [float(x) for x in np.linalg.norm(errors, axis=1) / MM]
        out["before"][f"{part}_by_pose"] = [float(x) for x in np.linalg.norm(left(stiff, data), axis=1) / MM]
    axes = {axis: [float(x) for x in column] for axis, column in zip("XYZ", left(stiff, learnt).T / MM, strict=True)}
    return {"networks": out, "axes": axes, "searches": searches(seed), "starts": starts}


def compared(stiff: Robot, best: Robot, learnt: Dataset, unseen: Dataset, seed: int, full: bool) -> Run:
    """Mean errors [mm] of `unseen`: the paper's network and mlp behind its model, that network and gp behind ours."""
    problem, ours = (problem_of(model, learnt, seed=seed) for model in (stiff, best))
    options, own = Options(seed=seed), [np.arange(len(problem))]
    rows = [np.arange(len(ours))]
    search = partial(_found, _beetle_swarm, (3 if full else 1) * BEETLES * 121)
    with one_thread():
        fitted: dict[str, tuple[Robot, Sequence[Expert]]] = {
            "bso": (stiff, fit_from_search(problem, own, options, search)),
            "mlp": (stiff, fit_mlp(problem, own * ENSEMBLE, options)),
            "bso_ours": (best, fit_from_search(ours, rows, options, search)),
            "best": (best, fit_gaussian_process(ours, rows, options)),
        }
    means = {}
    for name, (model, members) in fitted.items():
        inputs = model.inputs(unseen.q, unseen.payload)
        predicted = np.mean([member.displacement(inputs) for member in members], axis=0)
        means[name] = lengths_mm(left(model, unseen) - predicted)["mean"]
    return means


def with_networks(stiff: Robot, best: Robot, learnt: Dataset, seed: int) -> dict[str, Robot]:
    """The models with what `train` makes of the rows: what a user sends commands with."""
    return {
        "network": train(stiff, learnt, network="bso-mlp", rivals=(), seed=seed).model,
        "best_network": train(best, learnt, network="gp", rivals=(), seed=seed).model,
    }


def _found(search: Search, evaluations: int, losses: Objective, starts: FloatArray, seed: int) -> FloatArray:
    """The best place (n,) of a search."""
    counted = Counted(losses)
    search(counted, starts, evaluations, seed)
    return counted.x


def _drawn(
    search: Search, evaluations: int, curves: Run, name: str, losses: Objective, starts: FloatArray, seed: int
) -> FloatArray:
    """`_found`, with the least loss by evaluations among the curves."""
    counted = Counted(losses)
    search(counted, starts, evaluations, seed)
    curves[name] = _curve(evaluations, counted.best_by(_by(evaluations)))
    return counted.x


def _by(evaluations: int) -> FloatArray:
    """(DRAWN,) numbers of evaluations up to all."""
    return np.linspace(evaluations / DRAWN, evaluations, DRAWN).round()


def _curve(evaluations: int, values: FloatArray) -> dict[str, list[float]]:
    return {"evaluations": _by(evaluations).tolist(), "values": values.tolist()}


def searches(seed: int) -> dict[str, Run]:
    """Table 2 without its clock: how often, and after how many evaluations, each gets within CLOSE of the minimum.

    And `curve`: how far the best value is above the minimum by evaluations, the median of the starts.
    """
    out: dict[str, Run] = {}
    for name, search in SEARCHES.items():
        reached, above = [], []
        for repeat in range(REPEATS):
            f = Counted(lambda x: michalewicz(np.clip(x, 0, np.pi)), MINIMUM + CLOSE)
            starts = np.random.default_rng((seed, repeat)).uniform(0, np.pi, (BEETLES_ALONE, 2))
            search(f, starts, EVALUATIONS, seed * REPEATS + repeat)
            reached.append(f.reached)
            above.append(f.best_by(_by(EVALUATIONS)) - MINIMUM)
        times = [count for count in reached if count is not None]
        out[name] = {
            "share": len(times) / REPEATS,
            "evaluations": float(np.median(times)) if times else None,
            "curve": _curve(EVALUATIONS, np.maximum(np.median(above, axis=0), DIGITS)),
        }
    return out
