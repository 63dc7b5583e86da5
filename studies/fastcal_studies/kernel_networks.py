# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""General regression and radial basis function networks, with which the RX160L paper compares its own (figure 12)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from sklearn.cluster import KMeans

from fastcal.correction.inputs import Inputs, Scaling
from fastcal.networks.options import Options
from fastcal.networks.problem import Problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

WIDTHS = (0.3, 0.5, 0.8, 1.2, 2.0, 3.0)
CENTRES = 200
RIDGE = 1e-3


@dataclass(frozen=True, eq=False)
class KernelNetwork:
    """d = K(x, centres) W, K normal of a width, its rows brought to sum 1 where `normalized` (GRNN)."""

    scaling: Scaling
    centres: FloatArray
    weights: FloatArray
    width: float
    normalized: bool

    def displacement(self, inputs: Inputs) -> FloatArray:
        """(N, 3) [m]."""
        return kernel(self.scaling(inputs), self.centres, self.width, self.normalized) @ self.weights


def kernel(x: FloatArray, centres: FloatArray, width: float, normalized: bool) -> FloatArray:
    """(N, C)."""
    squares = cdist(x, centres, "sqeuclidean") / (2 * width**2)
    if normalized:
        squares -= squares.min(axis=1, keepdims=True)  # a row far from all would else be 0 / 0
    K = np.exp(-squares)
    return np.asarray(K / K.sum(axis=1, keepdims=True) if normalized else K)


def fit_grnn(problem: Problem, rows: Sequence[IntArray], options: Options) -> list[KernelNetwork]:
    """Specht 1991: the mean of all training rows, weighted by nearness; the width of least error on a tenth of them."""
    return [_with_width(problem, own, options, normalized=True) for own in rows]


def fit_rbf(problem: Problem, rows: Sequence[IntArray], options: Options) -> list[KernelNetwork]:
    """Centres by k-means, weights by ridge regression; the width of least error on a tenth of the rows."""
    return [_with_width(problem, own, options, normalized=False) for own in rows]


def _with_width(problem: Problem, own: IntArray, options: Options, normalized: bool) -> KernelNetwork:
    order = np.random.default_rng((options.seed, 7)).permutation(own)
    judged, learnt = order[: max(1, len(own) // 10)], order[len(own) // 10 :]
    inputs = problem.inputs.select(judged)
    errors = []
    for width in WIDTHS:
        predicted = _network(problem, learnt, width, normalized, options.seed).displacement(inputs)
        errors.append(float(np.mean((predicted - problem.residuals[judged]) ** 2)))
    return _network(problem, own, WIDTHS[int(np.argmin(errors))], normalized, options.seed)


def _network(problem: Problem, own: IntArray, width: float, normalized: bool, seed: int) -> KernelNetwork:
    inputs = problem.inputs.select(own)
    scaling = Scaling.of(inputs)
    x = scaling(inputs)
    if normalized:
        return KernelNetwork(scaling, x, problem.residuals[own], width, True)
    centres = KMeans(min(CENTRES, len(own)), n_init=1, max_iter=20, random_state=seed).fit(x).cluster_centers_
    K = kernel(x, centres, width, False)
    G = K.T @ K + RIDGE * np.eye(K.shape[1])
    weights: FloatArray = np.asarray(np.linalg.solve(G, K.T @ problem.residuals[own]), dtype=np.float64)
    return KernelNetwork(scaling, centres, weights, width, False)
