# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From scatter and budget to the uncertainty of each figure, through the alignment (JCGM 100), and by draws (JCGM 101).

An alignment fitted to the mean points takes away what a rigid motion would explain, of errors too: e' = M e, M = I -
A (A_f' A_f)^-1 A_f' on the stations f that it was fitted to, A = [I, -[p]x].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal.acceptance.figures import Figure, OfMeans
from fastcal.acceptance.visits import Campaign, cycle_of
from fastcal.arrays import FloatArray
from fastcal.budget import Budget, Component, Scene, Uncertainty, combined, components_of, drawn
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import skew

_STEP = 1e-8  # m or rad, of the gradient's differences
_BATCH = 5000


@dataclass(frozen=True, eq=False)
class Spreads:
    """How the mean errors of K stations may be off.

    Attributes:
        through: (3K, 3K) M of the alignment on positions.
        turn_through: (K, K) that of the orientations.
        scatter: (K, 3, 3) covariance of the mean points, from their visits [m^2].
        turn_scatter: The same of the mean turns [rad^2].
        freedom: (K,) degrees of freedom of the scatter.
        components: Of the budget, in the base.
        level: Probability that is to be covered.
    """

    through: FloatArray
    turn_through: FloatArray
    scatter: FloatArray
    turn_scatter: FloatArray
    freedom: FloatArray
    components: list[Component]
    level: float


def spreads_of(found: Campaign, budget: Budget, model: Robot | None = None) -> Spreads:
    """Scatter and budget of a campaign.

    Raises:
        InvalidInput: No pose was visited twice, or an input needs what is not known.
    """
    count = len(found.stations)
    visits = np.array([len(station.rows) for station in found.stations])
    if visits.max() < 2:
        raise InvalidInput(f"{found.data.source}: no pose was visited twice, so nothing shows how the arm repeats")
    scatter = _scatter([found.errors(k) for k in range(count)])
    none = np.zeros_like(scatter)
    turned = none if found.turns is None else _scatter([found.turn_errors(k) for k in range(count)])
    freedom = np.where(visits > 1, visits - 1.0, float((visits - 1).sum()))
    through, turn_through = np.eye(3 * count), np.eye(count)
    if found.fitted:
        A = np.concatenate([np.hstack([np.eye(3), -skew(p)]) for p in found.commanded])
        fit = cycle_of(found.stations)
        chosen = np.kron(np.eye(count)[fit], np.eye(3))
        through -= A @ np.linalg.pinv(chosen @ A) @ chosen
        turn_through[:, fit] -= 1 / len(fit)
    return Spreads(
        through,
        turn_through,
        scatter,
        turned,
        freedom,
        components_of(budget, _scene(found, budget, model)),
        budget.level,
    )


def _scatter(errors: list[FloatArray]) -> FloatArray:
    """(K, 3, 3) covariance of the means; a pose with one visit has the pooled scatter of the others."""
    squares = [(e - e.mean(axis=0)).T @ (e - e.mean(axis=0)) for e in errors]
    pooled = np.sum(squares, axis=0) / max(1, sum(len(e) - 1 for e in errors))
    own = [s / (len(e) - 1) if len(e) > 1 else pooled for s, e in zip(squares, errors, strict=True)]
    return np.array([s / len(e) for s, e in zip(own, errors, strict=True)])


def _scene(found: Campaign, budget: Budget, model: Robot | None) -> Scene:
    T = found.T_base_world
    last = np.array([station.rows[-1] for station in found.stations])  # the first row of all comes from nowhere
    own = None if model is None else model.core.base_and_tool(model.core.nominal)[0][:3, :3].T
    return Scene(
        found.commanded,
        np.array([station.commanded[:3, :3] for station in found.stations]),
        T[:3, :3] @ budget.instrument + T[:3, 3],
        np.zeros(3),
        model,
        found.data.q[last],
        float(found.data.payload[last].mean()),
        own,
        found.conditions(last),
    )


def uncertainty_of(figure: Figure, means: FloatArray, spreads: Spreads) -> Uncertainty:
    """Of a figure whose function of the means is taken at `means` (K, 3)."""
    if figure.of_means is None:
        return combined(figure.spread, figure.freedom, [], spreads.level)
    g = gradient(figure.of_means, means)
    turned = figure.unit == "rad"
    back = (g.T @ spreads.turn_through).T if turned else (g.reshape(-1) @ spreads.through).reshape(-1, 3)
    scatter = spreads.turn_scatter if turned else spreads.scatter
    own = np.einsum("ka,kab,kb->k", back, scatter, back)
    observed = float(np.sqrt(own.sum()))
    fourth = float(np.sum(own**2 / spreads.freedom))
    parts = [
        (c.input.name, abs(float(np.sum(back * (c.turn if turned else c.shift)))), c.input.freedom)
        for c in spreads.components
    ]
    return combined(observed, observed**4 / fourth if fourth > 0 else np.inf, parts, spreads.level)


def gradient(of_means: OfMeans, means: FloatArray) -> FloatArray:
    """(K, 3) of a figure's function of the means, by central differences."""
    steps = _STEP * np.eye(means.size).reshape(-1, *means.shape)
    return np.asarray((of_means(means + steps) - of_means(means - steps)).reshape(means.shape) / (2 * _STEP))


def simulated_expanded(
    figures: list[Figure], means: FloatArray, turned: FloatArray, spreads: Spreads, draws: int, seed: int
) -> list[float | None]:
    """Half the shortest interval that holds `level` of the draws of each figure of means, by JCGM 101; else None."""
    random = np.random.default_rng(seed)
    chosen = {i: figure.of_means for i, figure in enumerate(figures) if figure.of_means is not None}
    values: dict[int, list[FloatArray]] = {i: [] for i in chosen}
    roots, turn_roots = lower_roots(spreads.scatter), lower_roots(spreads.turn_scatter)
    for start in range(0, draws, _BATCH):
        size = min(_BATCH, draws - start)
        # Student's t of each mean: its scatter is estimated from its own visits.
        scale = np.sqrt(spreads.freedom / random.chisquare(spreads.freedom, (size, len(means))))[..., np.newaxis]
        normal = random.standard_normal((2, size, *means.shape))
        shift = scale * np.einsum("kab,nkb->nka", roots, normal[0])
        turn = scale * np.einsum("kab,nkb->nka", turn_roots, normal[1])
        for component in spreads.components:
            amplitude = drawn(component.input, random, (size, 1, 1))
            shift = shift + amplitude * component.shift
            turn = turn + amplitude * component.turn
        e = means + (shift.reshape(size, -1) @ spreads.through.T).reshape(size, *means.shape)
        t = turned + np.einsum("kj,nja->nka", spreads.turn_through, turn)
        for i, of_means in chosen.items():
            values[i].append(of_means(t if figures[i].unit == "rad" else e))
    return [
        _half_interval(np.concatenate(values[i]), spreads.level) if i in values else None for i in range(len(figures))
    ]


def lower_roots(scatter: FloatArray) -> FloatArray:
    """(K, 3, 3) lower triangular L with L L^T = scatter, which two or three visits leave singular."""
    values, vectors = np.linalg.eigh(scatter)
    half = vectors * np.sqrt(np.maximum(values, 0.0))[:, np.newaxis]
    R = np.asarray(np.linalg.qr(half.transpose(0, 2, 1), mode="r"))
    sign = np.where(np.einsum("kii->ki", R) < 0, -1.0, 1.0)
    return np.asarray((R * sign[..., np.newaxis]).transpose(0, 2, 1))


def _half_interval(values: FloatArray, level: float) -> float:
    """Half of the probabilistically symmetric interval (JCGM 101, 7.7)."""
    low, high = np.quantile(values, [(1 - level) / 2, (1 + level) / 2])
    return float(high - low) / 2
