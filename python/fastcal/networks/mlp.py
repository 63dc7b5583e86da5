# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The default network: a curve of error over each joint, and a multilayer perceptron for what joins them.

Curves and network take turns, each fitted to what the other leaves. The papers' networks map joints to three
coordinates; here the arm's own Jacobian maps joint errors to coordinates, and nothing has to be learnt twice.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy import linalg

from fastcal.arrays import FloatArray, IndexArray
from fastcal.correction.joints import JointNetwork
from fastcal.networks.curves import CORNER, Ridge, choose, columns, phases_of
from fastcal.networks.fitting import BySlope, Schedule, fit, taken, taken_own
from fastcal.networks.options import Options
from fastcal.networks.population import Architecture, Population
from fastcal.networks.problem import Problem

HIDDEN = (32, 32)
ROUNDS = 2
SCHEDULE = Schedule(epochs=150, batch=256, rate=3e-3, huber=1.0, decay=0.1)


class JointErrors:
    """Errors of P networks that predict joint errors: J net(features) + offset - wanted, all in units.

    Numbers that were not measured, of which J and wanted are 0, count for nothing.
    """

    def __init__(
        self, population: Population, features: FloatArray, problem: Problem, wanted: FloatArray, device: torch.device
    ) -> None:
        def tensor(values: NDArray[Any]) -> torch.Tensor:
            return torch.tensor(values, dtype=torch.float32, device=device)

        self._population = population
        self._features, self._J = tensor(features), tensor(problem.J)
        self._wanted = tensor(wanted)  # (P, N, k)
        self._measured = None if problem.measured.all() else tensor(problem.measured)

    def error(self, theta: torch.Tensor, rows: torch.Tensor) -> torch.Tensor:
        """(P, B, k)."""
        return self._error(self._population(theta, taken(self._features, rows)), rows, taken(self._J, rows))

    def at(self, theta: torch.Tensor) -> Callable[[torch.Tensor, BySlope], torch.Tensor]:
        """As `fit` takes its steps; dL/dout = [J^T dL/derror, dL/derror]."""
        steps = self._population.at(theta)

        def by_theta(rows: torch.Tensor, by_error: BySlope) -> torch.Tensor:
            J = taken(self._J, rows)
            d = by_error(self._error(steps.forward(taken(self._features, rows)), rows, J))
            free = d if self._measured is None else d * taken(self._measured, rows)
            return steps.backward(torch.cat([(J.transpose(2, 3) @ d[..., None]).squeeze(-1), free], dim=2))

        return by_theta

    def _error(self, out: torch.Tensor, rows: torch.Tensor, J: torch.Tensor) -> torch.Tensor:
        joints = J.shape[3]
        moved = (J @ out[..., :joints, None]).squeeze(-1)
        free = out[..., joints:] if self._measured is None else out[..., joints:] * taken(self._measured, rows)
        return moved + free - taken_own(self._wanted, rows)


def fit_mlp(
    problem: Problem,
    rows: Sequence[IndexArray],
    options: Options,
    *,
    hidden: Sequence[int] = HIDDEN,
    schedule: Schedule = SCHEDULE,
) -> list[JointNetwork]:
    """A network for each set of training rows; all train together."""
    phases = phases_of(problem)
    joints = problem.robot.joint_count
    wanted = problem.wanted
    order, ridge = choose(problem, phases, wanted)
    A = columns(phases, problem, order)
    regression = Ridge(A)
    factors = [regression.factor(regression.gram(own), ridge) for own in rows]
    members = [Architecture.plain(hidden)] * len(rows)
    population = Population(2 * joints + 1, joints + len(problem.axes), members, options.device)
    seeds = options.seeds(len(rows))
    theta = population.start(seeds, last=0.1)
    features = phases.features(problem.inputs)
    predicted = np.zeros((len(rows), *wanted.shape))
    for _ in range(ROUNDS):
        curves = [
            linalg.cho_solve(factor, regression.right(own, wanted - offset))
            for factor, own, offset in zip(factors, rows, predicted, strict=True)
        ]
        left = np.array([wanted - A @ c for c in curves])
        model = JointErrors(population, features, problem, left, theta.device)
        theta, _ = fit(model, theta, rows, schedule, seeds, progress=options.progress)
        with torch.no_grad():
            every = torch.arange(len(problem), device=theta.device).expand(len(rows), -1)
            predicted = model.error(theta, every).cpu().numpy().astype(float) + left
    return [
        JointNetwork(phases, c.reshape(joints, -1), CORNER, net, problem.size, problem.turn_size)
        for c, net in zip(curves, population.networks(theta), strict=True)
    ]
