# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibrated model and its rows as a surrogate needs them: residuals, geometry, motions of every place, inputs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.calibration.alignment import measurements, noise_by_observation
from fastcal.calibration.pose_folds import pose_folds
from fastcal.calibration.problem import asked_parameters, shown_ends
from fastcal.calibration.row_weights import huber_weights
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec
from fastcal.surrogate.candidates import directions
from fastcal.surrogate.features import Features, features

_Kernel = tuple[tuple[str, ...], tuple[float, ...], int]

FOLDS = 8
_WEAK = 30.0  # plausible sizes: a weak prior that only keeps poorly determined parameters from running away
_SEED = 0


@dataclass(frozen=True, eq=False)
class ResidualProblem:
    """Whitened residuals of a model and what could explain them.

    Attributes:
        model: The calibrated robot.
        rows: (N,) rows of the data that are used.
        A: (m, p) derivatives by the geometry (and unknowns of observations), then a row of weak priors for each.
        r: (m,) measured less predicted; 0 in the rows of priors.
        row: (m,) index into `rows`, -1 for a prior's.
        fold: (m,) by pose, -1 for a prior's.
        weight: (m,) of each number, Huber's, already in A and r; 1 for a prior's.
        shifted: (p,) which parameter of the robot each column of A is; -1 for an unknown of an observation.
        place: Owner to (m, directions): what a unit of each motion does.
        data: The used rows; `samples` are their conditions.
        cached: Inputs that were asked for.
        threads: Cores.
        kernels: Features that were asked for, and their values, by inputs, widths and nodes: many places have the same.
    """

    model: Robot
    data: Dataset
    samples: _core.Samples
    A: FloatArray
    r: FloatArray
    row: IntArray
    fold: IntArray
    weight: FloatArray
    shifted: IntArray
    place: dict[str, FloatArray]
    threads: int = 1
    cached: dict[str, FloatArray] = field(default_factory=dict)
    kernels: dict[_Kernel, tuple[Features, FloatArray]] = field(default_factory=dict)

    def without(self, held: NDArray[np.bool_]) -> ResidualProblem:
        """The problem without some numbers (m,)."""
        kept = ~held
        return replace(
            self,
            A=self.A[kept],
            r=self.r[kept],
            row=self.row[kept],
            fold=self.fold[kept],
            weight=self.weight[kept],
            place={owner: values[kept] for owner, values in self.place.items()},
        )

    def inputs(self, names: tuple[str, ...]) -> FloatArray:
        """(N, inputs) in the used rows."""
        self.find(names)
        return np.column_stack([self.cached[name] for name in names])

    def features(self, names: tuple[str, ...], width: FloatArray, most: int) -> tuple[Features, FloatArray]:
        """Features over inputs in the used rows, and their values there (N, f): `fastcal.surrogate.features`."""
        key = names, tuple(width.tolist()), most
        if key not in self.kernels:
            x = self.inputs(names)
            kernel = features(x, width, most)
            self.kernels[key] = kernel, kernel(x)
        return self.kernels[key]

    def find(self, names: Iterable[str]) -> None:
        """Keeps inputs that were not asked for before: many at once cost the core no more than one."""
        names = [name for name in dict.fromkeys(names) if name not in self.cached]
        moves = [name for name in names if name.startswith("move")]
        others = [name for name in names if name not in moves]
        core = self.model.error_model
        if others:
            found = np.asarray(_core.surrogate_inputs(core, self.samples, core.start, " ".join(others), self.threads))
            self.cached.update(zip(others, found.T, strict=True))
        if self.data.move is not None:
            self.cached.update((name, self.data.move[:, int(name.removeprefix("move")) - 1]) for name in moves)


def residual_problem(
    model: Robot,
    data: Dataset,
    noise: tuple[float, float, float],
    unknowns: FloatArray | None,
    owners: list[str],
    threads: int,
) -> ResidualProblem:
    """The problem of `add_surrogate`, whose arguments these are; `owners` are the places to look at."""
    units = [unit_motion(owner, k) for owner in owners for k in range(directions(owner))]
    extended = model.with_(correction=None, calibration=None, effects=[*model.entries, *units])
    samples = extended.samples(data)
    core = extended.error_model
    places = np.zeros(0) if unknowns is None else np.ravel(unknowns)
    measured = measurements(data, extended)
    theta = np.concatenate([np.asarray(core.start), places])
    near = _core.linearize(core, samples, measured, theta, noise_by_observation(measured, noise), threads)
    J, r, row = np.asarray(near.J), -np.asarray(near.r), np.asarray(near.row, dtype=np.int64)

    asked = asked_parameters(core, True, **shown_ends(measured))
    geometry = [i for i in asked if i < len(core.robot.parameters)]
    columns = [*geometry, *range(len(core.parameters), len(theta))]
    weight = np.sqrt(huber_weights(r, row))[:, np.newaxis]
    sizes = np.append(np.array([parameter.sigma for parameter in core.parameters])[geometry], np.ones(len(places)))
    A = np.vstack([weight * J[:, columns], np.diag(1 / (_WEAK * sizes))])
    first = len(core.parameters) - len(units)
    place: dict[str, FloatArray] = {}
    for owner in owners:
        count = directions(owner)
        place[owner] = _padded(weight * J[:, first : first + count], len(columns))
        first += count
    pad = np.full(len(columns), -1, dtype=np.int64)
    return ResidualProblem(
        model=model,
        data=data,
        samples=model.samples(data),
        A=A,
        r=np.append(weight[:, 0] * r, np.zeros(len(columns))),
        row=np.append(row, pad),
        fold=np.append(pose_folds(data, FOLDS, np.random.default_rng(_SEED))[row], pad),
        weight=np.append(weight[:, 0], np.ones(len(columns))),
        shifted=np.array([*geometry, *([-1] * len(places))], dtype=np.int64),
        place=place,
        threads=threads,
    )


def misfit(model: Robot, data: Dataset, noise: tuple[float, float, float], unknowns: FloatArray, threads: int) -> float:
    """Sum of squares of what a robot leaves, whitened; arguments as of `add_surrogate`."""
    core = model.error_model
    measured = measurements(data, model)
    theta = np.concatenate([np.asarray(core.start), unknowns])
    common = noise_by_observation(measured, noise)
    r = np.asarray(_core.linearize(core, model.samples(data), measured, theta, common, threads, columns=False).r)
    return float(r @ r)


def unit_motion(owner: str, direction: int) -> Spec:
    """A surrogate that moves a place by one unit along one of its directions, whatever the inputs."""
    weights = np.zeros(directions(owner))
    weights[direction] = 1.0
    return {"effect": "surrogate", "owner": owner, "weights": weights.tolist()}


def _padded(values: FloatArray, count: int) -> FloatArray:
    return np.vstack([values, np.zeros((count, values.shape[1]))])
