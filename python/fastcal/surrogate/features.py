# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A Gaussian process by inducing points: a kernel's features at a few nodes, so that its functions are linear in w.

k(x, y) = exp(-|(x - y) / width|^2 / 2) is approximated by phi(x) . phi(y), phi = K_xu V / sqrt(eigenvalues) of
K_uu = V diag(eigenvalues) V^T over the nodes u (C. Williams, M. Seeger, "Using the Nystroem method to speed up kernel
machines", 2001). g(x) = phi(x) . w with w ~ N(0, a^2) is a Gaussian process of standard deviation a; its weights at the
nodes are `at_nodes` @ w.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray

_LEAST = 1e-6  # of the largest eigenvalue: below, a feature is rounding
_APART = 0.6  # widths: nodes nearer to each other add nothing


@dataclass(frozen=True, eq=False)
class Features:
    """Features of one kernel.

    Attributes:
        width: (d,) length scales of the inputs.
        nodes: (k, d).
        at_nodes: (k, f) weights at the nodes of one unit of each feature.
    """

    width: FloatArray
    nodes: FloatArray
    at_nodes: FloatArray

    def __call__(self, x: FloatArray) -> FloatArray:
        """(N, f) of inputs x (N, d)."""
        return np.asarray(_kernel(x / self.width, self.nodes / self.width) @ self.at_nodes)


def features(x: FloatArray, width: FloatArray, most: int) -> Features:
    """Features over inputs x (N, d) with length scales width (d,): at most `most` nodes, far from each other."""
    scaled = np.asfortranarray(x / width)
    middle = int(np.argmin(((scaled - scaled.mean(axis=0)) ** 2).sum(axis=1)))
    nodes = x[_core.spread_points(scaled, middle, most, _APART)]
    eigenvalues, V = np.linalg.eigh(_kernel(nodes / width, nodes / width))
    kept = eigenvalues > _LEAST * eigenvalues[-1]
    return Features(width, nodes, V[:, kept] / np.sqrt(eigenvalues[kept]))


def _kernel(a: FloatArray, b: FloatArray) -> FloatArray:
    square = (a**2).sum(axis=1)[:, np.newaxis] + (b**2).sum(axis=1) - 2 * a @ b.T
    return np.asarray(np.exp(-0.5 * np.maximum(square, 0.0)))
