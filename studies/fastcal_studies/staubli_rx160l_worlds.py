# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""GA-DNN in three worlds, behind the paper's geometry and behind that of all rows; GD beside Adam.

The shape is the one that the genetic search finds in the world of joints. Networks that learn the same poses train as
one population.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fastcal.correction.experts import AxisNetworks
from fastcal.measurements.dataset import Dataset
from fastcal.networks.fitting import Schedule
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture
from fastcal.networks.problem import Problem
from fastcal.robot.robot import Robot
from fastcal_studies.exhibits import lengths_mm
from fastcal_studies.networks.ga_dnn import BATCH, EPOCHS, Network, split_rows
from fastcal_studies.networks.plain import train_plain
from fastcal_studies.simulated import FloatArray, left
from fastcal_studies.staubli_rx160l_tables import RATES

LOOK = 20  # epochs between two looks at a training
PLAIN = {"bp2": Architecture.plain((20,)), "bp5": Architecture.plain((20,) * 4)}
Curves = dict[str, dict[str, float]]  # mean error [mm] by epochs, of each network


@dataclass(frozen=True, eq=False)
class SideBySide(Problem):
    """What several models leave of the same poses, three columns each: each network of a population learns its own."""

    @property
    def has_turns(self) -> bool:
        """Points alone."""
        return False

    @property
    def units(self) -> FloatArray:
        """One size for all columns."""
        return np.full(self.residuals.shape[1], self.size)


def side_by_side(problem: Problem, wanted: Mapping[str, tuple[Robot, Dataset]]) -> SideBySide:
    """The poses of a problem with what each model leaves [m] of its own rows of them."""
    residuals = np.hstack([left(model, data) for model, data in wanted.values()])
    own = {name: getattr(problem, name) for name in Problem.__dataclass_fields__}
    return SideBySide(**own | {"residuals": residuals, "measured": np.ones(residuals.shape, dtype=bool)})


def deep(
    problem: Problem,
    found: Network,
    wanted: Mapping[str, tuple[Robot, Dataset]],
    options: Options,
    watched: tuple[Robot, Dataset],
) -> tuple[dict[str, AxisNetworks], dict[str, float]]:
    """GA-DNN for what each model leaves, and the curve of the first of them on the rows `watched`.

    The state that is kept is the best on the validation rows of the genes.
    """
    learnt, judged = split_rows(np.arange(len(problem)), found.split, options.seed)
    count = len(wanted)
    curve, look = _watching(watched, {"0": 0})
    trained, _ = train_plain(
        side_by_side(problem, wanted),
        [found.architecture] * count,
        [tuple(range(3 * k, 3 * k + 3)) for k in range(count)],
        [learnt] * count,
        Schedule(EPOCHS, BATCH, rule=found.rule, rate=found.rate),
        options,
        validation=[judged] * count,
        seeds=options.seeds(1) * count,
        watch=look,
    )
    return dict(zip(wanted, trained, strict=True)), curve["0"]


def plain(problem: Problem, options: Options, watched: tuple[Robot, Dataset]) -> tuple[dict[str, AxisNetworks], Curves]:
    """The plain networks by gradient descent and by Adam, trained as one population, and their curves."""
    named = {f"{name}_{rule}": (net, rule) for name, net in PLAIN.items() for rule in RATES}
    curves, look = _watching(watched, {name: k for k, name in enumerate(named)})
    rules = [rule for _, rule in named.values()]
    trained, _ = train_plain(
        problem,
        [net for net, _ in named.values()],
        [(0, 1, 2)] * len(named),
        [np.arange(len(problem))] * len(named),
        Schedule(EPOCHS, BATCH, rule=rules, rate=[RATES[rule] for rule in rules]),
        options,
        seeds=options.seeds(1) * len(named),
        watch=look,
    )
    return dict(zip(named, trained, strict=True)), curves


def _watching(
    watched: tuple[Robot, Dataset], members: Mapping[str, int]
) -> tuple[Curves, Callable[[int, list[AxisNetworks]], None]]:
    """Curves that fill as some members of a population train."""
    model, data = watched
    bare, inputs = left(model, data), model.inputs(data.q)
    curves: Curves = {name: {} for name in members}

    def look(epoch: int, experts: list[AxisNetworks]) -> None:
        if epoch % LOOK == 0:
            for name, k in members.items():
                curves[name][str(epoch)] = lengths_mm(bare - experts[k].displacement(inputs))["mean"]

    return curves, look
