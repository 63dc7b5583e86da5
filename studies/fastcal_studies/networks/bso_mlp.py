# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""BSO-MLP (SR210D, figure 3): a beetle swarm looks for the perceptron's start, gradients train it from there."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from fastcal.correction.experts import AxisNetworks
from fastcal.networks.fitting import Schedule, loss
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture, Population
from fastcal.networks.problem import Problem
from fastcal_studies.networks.beetles import Swarm, swarm_search
from fastcal_studies.networks.plain import Coordinates, train_plain

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
Losses = Callable[[FloatArray], FloatArray]
Search = Callable[[Losses, FloatArray, int], FloatArray]

# The paper gives the type, three layers with sigmoids, and no sizes.
ARCHITECTURE = Architecture.plain((20,), "sigmoid")
BEETLES = 30
SCHEDULE = Schedule(epochs=400, batch=0, rate=1e-2, decay=0.01)


def fit_bso_mlp(
    problem: Problem,
    rows: Sequence[IntArray],
    options: Options,
    *,
    architecture: Architecture = ARCHITECTURE,
    swarm: Swarm = Swarm(),  # noqa: B008 - it never changes
    schedule: Schedule = SCHEDULE,
) -> list[AxisNetworks]:
    """For each set of rows a swarm's best network, then all are trained by gradients together."""
    return fit_from_search(problem, rows, options, swarm_of(swarm), architecture=architecture, schedule=schedule)


def swarm_of(swarm: Swarm) -> Search:
    """The beetle swarm as a search for a start."""
    return lambda losses, starts, seed: swarm_search(losses, starts, swarm, seed=seed).x


def fit_from_search(
    problem: Problem,
    rows: Sequence[IntArray],
    options: Options,
    search: Search,
    *,
    architecture: Architecture = ARCHITECTURE,
    schedule: Schedule = SCHEDULE,
) -> list[AxisNetworks]:
    """The same with any search for the start: `search(losses, starts (BEETLES, size), seed)` gives (size,)."""
    starts = []
    for k, (own, seed) in enumerate(zip(rows, options.seeds(len(rows)), strict=True)):
        options.progress(f"searching for the start of network {k + 1} of {len(rows)}")
        starts.append(searched_start(problem, own, architecture, search, seed, options.device))
    axes = [problem.axes] * len(rows)
    members = [architecture] * len(rows)
    return train_plain(problem, members, axes, rows, schedule, options, start=torch.stack(starts))[0]


def searched_start(
    problem: Problem, own: IntArray, architecture: Architecture, search: Search, seed: int, device: torch.device
) -> torch.Tensor:
    """(size,) the numbers of the network that the search finds best on the given rows."""
    inputs = problem.robot.joint_count + 1
    one = Population(inputs, len(problem.axes), [architecture], device)
    starts = np.vstack([one.start([seed * 1009 + k]).numpy() for k in range(BEETLES)]).astype(float)
    model = Coordinates(one, problem, [problem.axes], device)
    x, wanted = model.x[own], model.wanted[0][own]

    def losses(places: FloatArray) -> FloatArray:
        theta = torch.tensor(places, dtype=torch.float32, device=device)
        with torch.no_grad():
            errors = one(theta, x) - wanted
        return loss(errors, 0.0).cpu().numpy().astype(float)

    return torch.tensor(search(losses, starts, seed), dtype=torch.float32)
