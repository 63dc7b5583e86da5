# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Several waves of one joint, or one smooth curve over its position? The more likely of the two.

A few orders can follow any curve, so chi square alone prefers them. Here both are random functions of the joint's
position beside the rest of the model, each with one amplitude at its most likely size (`surrogate.evidence`): the waves
with independent coefficients, the curve as a Gaussian process of one of a few length scales. What was chosen among
many, the orders or the length scale, pays for the choice by twice the log of their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb, log

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.diagnosis import periodic, rules
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.periodic import is_periodic, scan
from fastcal.diagnosis.search import Search, SearchNode
from fastcal.place import place_of
from fastcal.surrogate.evidence import Beside
from fastcal.surrogate.features import features


def waves_of_one_curve(search: Search, state: SearchNode) -> tuple[str, SearchNode] | None:
    """A joint of which a set names several waves that are one curve, and the set without them; None: no joint is."""
    names = state.names
    for owner in sorted({name.owner for name in names}):
        waves = [name for name in names if name.owner == owner and is_periodic(name)]
        is_alone = len(waves) == len(names)
        if not is_alone and len(names) > search.most:  # many waves of many joints are what they are
            continue
        if is_one_curve(search, state, waves):
            return owner, without(search, state, waves)
    return None


def with_orders_between(search: Search, state: SearchNode) -> SearchNode:
    """The set with one wave in place of several waves of a joint, where that is likelier.

    Over less than a few turns two whole orders draw a wave of an order between them, and suffice.
    """
    for owner in sorted({name.owner for name in state.names}):
        waves = [name for name in state.names if name.owner == owner and is_periodic(name)]
        if len(waves) < 2 or len(state.names) > rules.MAX_EFFECTS_GROWN:
            continue
        base = without(search, state, waves)
        one = [search.state([*base.names, name], base) for name in scan(base) if name.owner == owner]
        better = [s for s in one if s.bic < state.bic and not s.impossible and s.suffices >= state.suffices]
        state = min(better, key=lambda s: s.bic, default=state)
    return state


def is_one_curve(search: Search, state: SearchNode, waves: Sequence[Hypothesis]) -> bool:
    """Is one curve over their joint's position likelier than these waves of a set? One of a whole order is no curve."""
    scanned = sum(name.searched for name in waves)
    if len(waves) + scanned < 2:
        return False
    owner = waves[0].owner
    base = without(search, state, waves)
    A, r, _ = base.fit.whitened
    beside = Beside(A, r)
    turn = base.blocks.frames[owner][:, 0]
    row = base.fit.near.row
    q = search.problem.kept.q[:, place_of(owner).index]

    def evidence(functions: FloatArray) -> float:
        columns = np.zeros((len(r), functions.shape[1]))
        columns[: len(turn)] = decorrelated(search.problem, functions[row] * turn[:, np.newaxis], row)
        return beside.weigh(columns / np.sqrt(np.mean(turn**2))).evidence

    tried = {name.cause for name in search.problem.names if name.owner == owner and is_periodic(name)}
    choices = comb(len(tried), len(waves) - scanned) * (2 * periodic.MAX_ORDER * float(np.ptp(q)) / np.pi) ** scanned
    of_waves = evidence(np.column_stack([_functions(name, q) for name in waves])) - 2 * log(choices)
    scales = rules.CURVE_SCALES
    of_curve = max(evidence(_smooth(q, scale)) for scale in scales) - 2 * log(len(scales))
    return of_curve > of_waves


def without(search: Search, state: SearchNode, names: Sequence[Hypothesis]) -> SearchNode:
    """A set without some of its names."""
    rest = [name for name in state.names if name not in names]
    return search.state(rest, state) if rest else search.start


def _functions(name: Hypothesis, q: FloatArray) -> FloatArray:
    """(N, 1 or 2) of mean square about 1: sine and cosine of a wave, or the straight line of a ratio."""
    if "order" in name.entry:
        angle = float(name.entry["order"]) * q
        return np.asarray(np.sqrt(2.0) * np.column_stack([np.sin(angle), np.cos(angle)]))
    return np.asarray(((q - q.mean()) / q.std())[:, np.newaxis])


def _smooth(q: FloatArray, scale: float) -> FloatArray:
    """(N, k) features of a Gaussian process over q whose length scale is a share of its range."""
    x = q[:, np.newaxis]
    return features(x, np.array([scale * np.ptp(q)]), len(q))(x)
