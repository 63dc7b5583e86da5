# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Networks that map scaled joints and payload straight to coordinates, as the papers' do; many train as one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from fastcal.correction.experts import AxisNetworks
from fastcal.correction.inputs import Scaling
from fastcal.networks.fitting import Schedule, fit
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture, Population
from fastcal.networks.problem import Problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


class Coordinates:
    """Errors of P networks with k outputs: net(x) less the coordinates of each, in units.

    Args:
        population: The networks.
        problem: Its inputs, scaled over all rows, and residuals.
        axes: (P, k) which coordinates each network gives.
    """

    def __init__(self, population: Population, problem: Problem, axes: Sequence[Sequence[int]], device: torch.device):
        self.population = population
        self.scaling = Scaling.of(problem.inputs)
        self.unit = problem.size
        self.x = torch.tensor(self.scaling(problem.inputs), dtype=torch.float32, device=device)
        y = (problem.residuals / self.unit).T
        self.wanted = torch.tensor(np.array([y[list(own)].T for own in axes]), dtype=torch.float32, device=device)
        self._own = torch.arange(len(axes), device=device)[:, None]

    def error(self, theta: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """(P, B, k)."""
        return self.population(theta, torch.nn.functional.embedding(rows, self.x)) - self.wanted[self._own, rows]


def train_plain(
    problem: Problem,
    members: Sequence[Architecture],
    axes: Sequence[Sequence[int]],
    rows: Sequence[IntArray],
    schedule: Schedule,
    options: Options,
    *,
    validation: Sequence[IntArray] | None = None,
    start: torch.Tensor | None = None,
    seeds: Sequence[int] | None = None,
) -> tuple[list[AxisNetworks], FloatArray]:
    """Trains networks with the same number of outputs together; their losses are on the validation rows.

    Each is given as an expert of its own, though one with a single output is but a third of a model.
    """
    population = Population(problem.robot.joint_count + 1, len(axes[0]), members, options.device)
    own = options.seeds(len(members)) if seeds is None else seeds
    model = Coordinates(population, problem, axes, options.device)
    theta = population.start(own) if start is None else start
    theta, losses = fit(
        model, theta.to(options.device), rows, schedule, own, validation=validation, progress=options.progress
    )
    experts = [AxisNetworks(model.scaling, (net,), model.unit) for net in population.networks(theta)]
    return experts, losses


def fit_plain(
    problem: Problem, rows: Sequence[IntArray], options: Options, *, architecture: Architecture, schedule: Schedule
) -> list[AxisNetworks]:
    """One network with three outputs for each set of rows: the plain rival of the papers' networks."""
    members = [architecture] * len(rows)
    return train_plain(problem, members, [(0, 1, 2)] * len(rows), rows, schedule, options)[0]
