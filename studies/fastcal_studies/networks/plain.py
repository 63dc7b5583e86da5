# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Networks that map scaled joints and payload straight to coordinates, as the papers' do; many train as one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IndexArray
from fastcal.correction.experts import AxisNetworks
from fastcal.correction.inputs import Scaling
from fastcal.networks.fitting import BySlope, Schedule, fit, taken, taken_own
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture, Population
from fastcal.networks.problem import Problem


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
        self.x = torch.tensor(self.scaling(problem.inputs), dtype=torch.float32, device=device)
        self.wanted = _of_axes(problem.wanted, axes, device)
        self._measured = None if problem.measured.all() else _of_axes(problem.measured, axes, device)

    def error(self, theta: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """(P, B, k)."""
        return self._error(self.population(theta, taken(self.x, rows)), rows)

    def at(self, theta: torch.Tensor) -> Callable[[torch.Tensor, BySlope], torch.Tensor]:
        """As `fit` takes its steps; dL/dout = dL/derror."""
        steps = self.population.at(theta)

        def by_theta(rows: torch.Tensor, by_error: BySlope) -> torch.Tensor:
            d = by_error(self._error(steps.forward(taken(self.x, rows)), rows))
            return steps.backward(d if self._measured is None else d * taken_own(self._measured, rows))

        return by_theta

    def _error(self, out: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        error = out - taken_own(self.wanted, rows)
        return error if self._measured is None else error * taken_own(self._measured, rows)


def _of_axes(values: NDArray[Any], axes: Sequence[Sequence[int]], device: torch.device) -> torch.Tensor:
    """(P, N, k) the columns of values (N, ...) that each network gives."""
    return torch.tensor(np.array([values[:, list(own)] for own in axes]), dtype=torch.float32, device=device)


def train_plain(
    problem: Problem,
    members: Sequence[Architecture],
    axes: Sequence[Sequence[int]],
    rows: Sequence[IndexArray],
    schedule: Schedule,
    options: Options,
    *,
    validation: Sequence[IndexArray] | None = None,
    start: torch.Tensor | None = None,
    seeds: Sequence[int] | None = None,
    watch: Callable[[int, list[AxisNetworks]], None] | None = None,
) -> tuple[list[AxisNetworks], FloatArray]:
    """Trains networks with the same number of outputs together; their losses are on the validation rows.

    Each is given as an expert of its own, though one with a single output is but a part of a model. `watch` sees them
    every `schedule.check` epochs, with how many are over.
    """
    population = Population(problem.robot.joint_count + 1, len(axes[0]), members, options.device)
    own = options.seeds(len(members)) if seeds is None else seeds
    model = Coordinates(population, problem, axes, options.device)
    theta = population.start(own) if start is None else start

    def experts(theta: torch.Tensor) -> list[AxisNetworks]:
        units = problem.size, problem.turn_size
        return [AxisNetworks(model.scaling, (net,), *units) for net in population.networks(theta)]

    theta, losses = fit(
        model,
        theta.to(options.device),
        rows,
        schedule,
        own,
        validation=validation,
        progress=options.progress,
        watch=None if watch is None else lambda epoch, now: watch(epoch, experts(now)),
    )
    return experts(theta), losses


def fit_plain(
    problem: Problem, rows: Sequence[IndexArray], options: Options, *, architecture: Architecture, schedule: Schedule
) -> list[AxisNetworks]:
    """One network with all outputs for each set of rows: the plain rival of the papers' networks."""
    members = [architecture] * len(rows)
    return train_plain(problem, members, [problem.axes] * len(rows), rows, schedule, options)[0]
