# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Beetle antennae search and beetle swarm optimization (SR210D, 5.1 and 5.2), every evaluation of a step in one call.

The paper's signs are mended: the beetle walks away from the antenna that smells worse, (33) and (39) with a minus; the
left antenna is at minus, (32) and (40); both are compared in (39); (37) draws towards p_g - X.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Objective = Callable[[FloatArray], FloatArray]  # (B, n) -> (B,), to be minimized


class Found(NamedTuple):
    """The best place (n,), its value, and how many places were looked at."""

    x: FloatArray
    value: float
    evaluations: int


def antennae_search(
    f: Objective,
    starts: FloatArray,
    *,
    antenna: float = 2.0,
    step: float = 0.5,
    iterations: int = 150,
    seed: int = 0,
    target: float = -np.inf,
) -> Found:
    """Beetles that walk alone, one from each start (B, n).

        x <- x - step b sign(f(x + d b) - f(x - d b)),  b a random unit vector,
        d <- 0.95 d + 0.01,  step <- 0.95 step                                              (31) to (34)

    Stops when the best value is at most `target`, or after `iterations`.
    """
    random = np.random.default_rng(seed)
    x = np.array(starts, dtype=float)
    values = f(x)
    count = len(x)
    best, least = x[np.argmin(values)].copy(), float(values.min())
    for _ in range(iterations):
        if least <= target:
            break
        b = random.standard_normal(x.shape)
        b /= np.linalg.norm(b, axis=1, keepdims=True)
        smelt = f(np.concatenate([x + antenna * b, x - antenna * b]))
        x = x - step * b * np.sign(smelt[: len(x)] - smelt[len(x) :])[:, np.newaxis]
        values = f(x)
        count += 3 * len(x)
        if values.min() < least:
            best, least = x[np.argmin(values)].copy(), float(values.min())
        antenna, step = 0.95 * antenna + 0.01, 0.95 * step
    return Found(best, least, count)


@dataclass(frozen=True)
class Swarm:
    """Constants of (36) to (40): sizes of which the paper gives none.

    Attributes:
        iterations: K.
        share: lambda, of the velocity; the antennae have the remainder.
        inertia: Greatest and least omega.
        own, common: c1, c2.
        antenna, step: d and delta at the start; both shrink as in (34).
    """

    iterations: int = 40
    share: float = 0.6
    inertia: tuple[float, float] = (0.9, 0.4)
    own: float = 1.5
    common: float = 1.5
    antenna: float = 2.0
    step: float = 0.5


def swarm_search(f: Objective, starts: FloatArray, swarm: Swarm = Swarm(), *, seed: int = 0) -> Found:
    """Beetles that fly together, one from each start (S, n).

    V <- omega V + c1 r1 (p - X) + c2 r2 (p_g - X)                                       (37), (38)
    xi = -delta V sign(f(X + V d / 2) - f(X - V d / 2))                                  (39), (40)
    X <- X + lambda V + (1 - lambda) xi                                                  (36)
    """
    random = np.random.default_rng(seed)
    x = np.array(starts, dtype=float)
    velocity = 0.1 * random.standard_normal(x.shape) * np.maximum(np.std(x, axis=0), 1e-3)
    values = f(x)
    own, own_values = x.copy(), values.copy()
    count = len(x)
    antenna, step = swarm.antenna, swarm.step
    for k in range(swarm.iterations):
        omega = swarm.inertia[0] - (swarm.inertia[0] - swarm.inertia[1]) * k / swarm.iterations
        r1, r2 = random.random(x.shape), random.random(x.shape)
        best = own[np.argmin(own_values)]
        velocity = omega * velocity + swarm.own * r1 * (own - x) + swarm.common * r2 * (best - x)
        reach = velocity * antenna / 2
        smelt = f(np.concatenate([x + reach, x - reach]))
        xi = -step * velocity * np.sign(smelt[: len(x)] - smelt[len(x) :])[:, np.newaxis]
        x = x + swarm.share * velocity + (1 - swarm.share) * xi
        values = f(x)
        count += 3 * len(x)
        better = values < own_values
        own[better], own_values[better] = x[better], values[better]
        antenna, step = 0.95 * antenna + 0.01, 0.95 * step
    return Found(own[np.argmin(own_values)], float(own_values.min()), count)


def michalewicz(x: FloatArray) -> FloatArray:
    """(B,) at x (B, 2): (35) with the minus that makes -1.8013 at (2.20, 1.57) its minimum."""
    k = np.array([1.0, 2.0])
    return np.asarray(-(np.sin(x) * np.sin(k * x**2 / np.pi) ** 20).sum(axis=1))
