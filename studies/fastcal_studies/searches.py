# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The searches that the SR210D paper compares its beetles with, all with a number of evaluations that they may spend.

`particle_swarm`: J. Kennedy, R. Eberhart 1995 with falling inertia; `genetic`: tournaments of two, blends (BLX-0.5,
L. J. Eshelman, J. D. Schaffer 1993), normal mutation, the best kept; `bee_colony`: D. Karaboga 2005.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Objective = Callable[[FloatArray], FloatArray]  # (B, n) -> (B,), to be minimized

_MUTATED, _TIRED = 0.2, 20


class Counted:
    """An objective that counts its evaluations, keeps the best place, its course, and when it first met a target."""

    def __init__(self, f: Objective, target: float = -np.inf) -> None:
        self._f, self._target = f, target
        self.evaluations, self.value, self.x = 0, np.inf, np.empty(0)
        self.reached: int | None = None
        self._course: list[tuple[int, float]] = []

    def __call__(self, x: FloatArray) -> FloatArray:
        """Values (B,) at x (B, n)."""
        values = self._f(x)
        best = int(np.argmin(values))
        if values[best] < self.value:
            self.value, self.x = float(values[best]), x[best].copy()
        below = np.flatnonzero(values <= self._target)
        if self.reached is None and len(below):
            self.reached = self.evaluations + int(below[0]) + 1
        self.evaluations += len(x)
        self._course.append((self.evaluations, self.value))
        return values

    def best_by(self, evaluations: FloatArray) -> FloatArray:
        """(K,) the least value found within as many evaluations (K,); in its first batch, that batch's."""
        after, best = np.array(self._course).T
        return np.asarray(best[np.maximum(np.searchsorted(after, evaluations, side="right") - 1, 0)])


def particle_swarm(f: Counted, starts: FloatArray, evaluations: int, seed: int) -> None:
    """Particles from `starts` (S, n) until the evaluations are spent."""
    random = np.random.default_rng(seed)
    x = np.array(starts, dtype=float)
    velocity = 0.1 * random.standard_normal(x.shape) * np.maximum(np.std(x, axis=0), 1e-3)
    values = f(x)
    own, own_values = x.copy(), values.copy()
    steps = (evaluations - len(x)) // len(x)
    for k in range(steps):
        omega = 0.9 - 0.5 * k / steps
        r1, r2 = random.random(x.shape), random.random(x.shape)
        best = own[np.argmin(own_values)]
        velocity = omega * velocity + 1.5 * r1 * (own - x) + 1.5 * r2 * (best - x)
        x = x + velocity
        values = f(x)
        better = values < own_values
        own[better], own_values[better] = x[better], values[better]


def genetic(f: Counted, starts: FloatArray, evaluations: int, seed: int) -> None:
    """A population from `starts` (S, n) until the evaluations are spent."""
    random = np.random.default_rng(seed)
    x = np.array(starts, dtype=float)
    size = np.maximum(np.std(x, axis=0), 1e-3)
    values = f(x)
    generations = (evaluations - len(x)) // len(x)
    for k in range(generations):
        pairs = random.integers(len(x), size=(2, len(x), 2))
        winners = np.where(values[pairs[..., 0]] < values[pairs[..., 1]], pairs[..., 0], pairs[..., 1])
        share = random.uniform(-0.5, 1.5, x.shape)
        children = share * x[winners[0]] + (1 - share) * x[winners[1]]
        mutated = random.random(x.shape) < _MUTATED
        children += mutated * size * (1 - k / generations) * 0.3 * random.standard_normal(x.shape)
        children[0] = x[np.argmin(values)]
        x = children
        values = f(x)


def bee_colony(f: Counted, starts: FloatArray, evaluations: int, seed: int) -> None:
    """Food sources at `starts` (S, n); a source that is tired of is left for a random one between the extremes."""
    random = np.random.default_rng(seed)
    x = np.array(starts, dtype=float)
    low, high = x.min(axis=0), x.max(axis=0)
    values = f(x)
    tries = np.zeros(len(x))
    while f.evaluations + 2 * len(x) <= evaluations:
        for onlookers in (False, True):
            worth = values.max() - values + 1e-12
            place = random.choice(len(x), len(x), p=worth / worth.sum()) if onlookers else np.arange(len(x))
            other = (place + random.integers(1, len(x), len(x))) % len(x)
            moved = x[place].copy()
            rows, axis = np.arange(len(x)), random.integers(x.shape[1], size=len(x))
            moved[rows, axis] += random.uniform(-1, 1, len(x)) * (x[place, axis] - x[other, axis])
            found = f(moved)
            for source, to, value in zip(place, moved, found, strict=True):
                better = value < values[source]
                tries[source] = 0 if better else tries[source] + 1
                if better:
                    x[source], values[source] = to, value
        tired = tries > _TIRED * x.shape[1]
        tired[np.argmin(values)] = False
        if tired.any():
            x[tired] = random.uniform(low, high, x[tired].shape)
            values[tired], tries[tired] = f(x[tired]), 0
