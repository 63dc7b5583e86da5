# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""BSO-MLP (SR210D, figure 3): a beetle swarm looks for the perceptron's start, gradients train it from there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from fastcal.correction.experts import AxisNetworks
from fastcal.networks.beetles import Swarm, swarm_search
from fastcal.networks.fitting import Schedule, loss
from fastcal.networks.options import Options
from fastcal.networks.plain import Coordinates, train_plain
from fastcal.networks.population import Architecture, Population
from fastcal.networks.problem import Problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

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
    starts = []
    for k, (own, seed) in enumerate(zip(rows, options.seeds(len(rows)), strict=True)):
        options.progress(f"beetle swarm {k + 1} of {len(rows)}")
        starts.append(swarm_start(problem, own, architecture, swarm, seed, options.device))
    axes = [(0, 1, 2)] * len(rows)
    members = [architecture] * len(rows)
    return train_plain(problem, members, axes, rows, schedule, options, start=torch.stack(starts))[0]


def swarm_start(
    problem: Problem, own: IntArray, architecture: Architecture, swarm: Swarm, seed: int, device: torch.device
) -> torch.Tensor:
    """(size,) the numbers of the network that the swarm finds best on the given rows."""
    inputs = problem.robot.joint_count + 1
    one = Population(inputs, 3, [architecture], device)
    starts = np.vstack([one.start([seed * 1009 + k]).numpy() for k in range(BEETLES)]).astype(float)
    model = Coordinates(one, problem, [(0, 1, 2)], device)
    x, wanted = model.x[own], model.wanted[0][own]

    def losses(places: FloatArray) -> FloatArray:
        theta = torch.tensor(places, dtype=torch.float32, device=device)
        with torch.no_grad():
            errors = one(theta, x) - wanted
        return loss(errors, 0.0).cpu().numpy().astype(float)

    return torch.tensor(swarm_search(losses, starts, swarm, seed=seed).x, dtype=torch.float32)
