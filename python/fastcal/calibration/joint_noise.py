# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise of joints that repeat badly: larger where the arm is stretched out, and alike in what one posture shows.

Each time a joint comes to a halt it stands off by k [rad; of slides m]. With G (s, n) what the joints move the numbers
of a posture by, each over its standard deviation, these have the covariance

    C = 1 + k^2 G G^T

besides a common factor. k is the one that makes the residuals beside a model X likeliest, whatever X takes of them
(restricted likelihood; H. Patterson, R. Thompson 1971): the least of log|C| + log|X^T C^-1 X| + nu log(r^T P r).

Whether there is any is asked before. With K = G G^T - c, c such that E r^T K r = 0 for white noise beside the model,
r^T K r has at most the variance 2 s^4 tr(K^2 M), M = 1 - h, each posture on its own; heavy tails make it larger, and so
the sum of the squares of what the postures add is taken where that is more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.tall import gram

# Standard deviations by which the numbers of far postures must err more for k to be looked for.
DEVIATIONS = 3.0
# Twice the log of the likelihood that k must gain: white noise gains so much in one of two thousand sets.
GAIN = 11.0
_RIDGE = 1e-9  # on unit columns
_STEP = float(np.log(2.0))  # of log k
_MOST_STEPS = 12


@dataclass(frozen=True, eq=False)
class JointNoise:
    """The numbers that share the errors of a posture's joints, posture by posture.

    Attributes:
        parts: For postures with as many numbers each, the places of these (b, s), and G G^T = U diag(l) U^T:
            U (b, s, s), l (b, s).
    """

    parts: Sequence[tuple[IndexArray, FloatArray, FloatArray]]

    @staticmethod
    def of(lever: FloatArray, group: IndexArray) -> JointNoise:
        """Of numbers whose levers are (m, n), over their deviations; `group` (m,) is the posture of each, -1: none."""
        parts = []
        for own in _postures(group):
            G = lever[own]
            values, vectors = np.linalg.eigh(G @ G.transpose(0, 2, 1))
            parts.append((own, vectors, np.maximum(values, 0.0)))
        return JointNoise(parts)

    def whitened(self, values: FloatArray, k: float, begun: float = 0.0) -> FloatArray:
        """C^-1/2 values, values (m, ...) that are whitened for the k `begun` with."""
        out = values.copy()
        for own, U, spread in self.parts:
            size = np.sqrt((1 + begun**2 * spread) / (1 + k**2 * spread))
            W = (U * size[:, np.newaxis, :]) @ U.transpose(0, 2, 1)
            at = own.ravel()
            follow = np.array_equal(at, np.arange(at[0], at[0] + len(at)))
            rows = slice(at[0], at[0] + len(at)) if follow else at
            table = values[rows].reshape(*own.shape, -1)
            out[rows] = (W @ table).reshape(len(at), *values.shape[1:])
        return out

    def log_determinant(self, k: float) -> float:
        """Of C."""
        return float(sum(np.sum(np.log1p(k**2 * spread)) for _, _, spread in self.parts))


def _postures(group: IndexArray) -> list[IndexArray]:
    """Places (b, s) of the numbers of postures, those with as many together."""
    order = np.argsort(group, kind="stable")
    order = order[np.searchsorted(group[order], 0) :]
    if len(order) == 0:
        return []
    first = np.flatnonzero(np.r_[True, np.diff(group[order]) != 0])
    count = np.diff(np.r_[first, len(order)])
    return [order[first[count == s][:, np.newaxis] + np.arange(s)] for s in np.unique(count)]


Hats = Sequence[tuple[IndexArray, FloatArray]]


def hats(Z: FloatArray, group: IndexArray) -> Hats:
    """For postures with as many numbers each, the places of these (b, s) and h = Z Z^T (b, s, s) of their rows.

    Z (m, p) is an orthonormal basis of a model's columns; `group` (m,) as of `JointNoise.of`.
    """
    return [(own, Z[own] @ Z[own].transpose(0, 2, 1)) for own in _postures(group)]


def grows_with_reach(lever: FloatArray, left: FloatArray, of: Hats) -> tuple[float, float]:
    """By how many standard deviations residuals err more where joints move them far, and k of that.

    Args:
        lever: (m, n) of each number over its deviation.
        left: (m,) what a model leaves.
        of: Its `hats`.
    """
    blocks = []
    for own, h in of:
        G = lever[own]
        blocks.append((G @ G.transpose(0, 2, 1), np.eye(own.shape[1]) - h, left[own]))
    return _excess(blocks)


def _excess(blocks: Sequence[tuple[FloatArray, FloatArray, FloatArray]]) -> tuple[float, float]:
    """The same of G G^T (b, s, s), M (b, s, s) and what is left (b, s), posture by posture."""
    freedom = sum(float(np.einsum("bii->", M)) for _, M, _ in blocks)
    if freedom <= 0:
        return 0.0, 0.0
    mean = sum(float(np.einsum("bij,bji->", K, M)) for K, M, _ in blocks) / freedom
    variance = sum(float(np.sum(r**2)) for *_, r in blocks) / freedom
    found, alike, own, slope = 0.0, 0.0, 0.0, 0.0
    for K, M, r in blocks:
        D = K - mean * np.eye(K.shape[1])
        square = np.einsum("bi,bij,bj->b", r, D, r)
        found += float(square.sum())
        alike += 2 * variance**2 * float(np.einsum("bij,bjk,bki->", D, D, M))
        own += float(np.sum((square - variance * np.einsum("bij,bji->b", D, M)) ** 2))
        slope += float(np.einsum("bij,bjk,bkl,bli->", D, M, K, M))
    error = np.sqrt(max(alike, own))
    if error <= 0 or slope <= 0:
        return 0.0, 0.0
    return found / error, float(np.sqrt(max(found, 0.0) / slope / variance))


def likeliest(
    X: FloatArray, r: FloatArray, noise: JointNoise, near: float, begun: float = 0.0
) -> tuple[float, float]:
    """K at which the residuals are likeliest, and by how much twice the log of the likelihood exceeds that of k = 0.

    Args:
        X: (m, p) unit columns of the model, priors among its rows.
        r: (m,) what it is to explain; both are whitened for the k `begun` with.
        noise: Of these numbers.
        near: k to begin at, above 0.
        begun: As in `JointNoise.whitened`.
    """
    both, p = np.column_stack([X, r]), X.shape[1]
    known: dict[float, float] = {}

    def misfit(k: float) -> float:
        N = gram(noise.whitened(both, k, begun))
        N[np.diag_indices(p)] += _RIDGE
        root = np.diag(np.linalg.cholesky(N))
        rank = int(np.sum(root[:p] ** 2 > 100 * _RIDGE))
        left = max((len(r) - rank), 1) * 2 * float(np.log(root[p]))
        return noise.log_determinant(k) + 2 * float(np.sum(np.log(root[:p]))) + left

    def at(step: float) -> float:
        if step not in known:
            known[step] = misfit(near * float(np.exp(step)))
        return known[step]

    middle = 0.0
    for _ in range(_MOST_STEPS):
        if at(middle - _STEP) < at(middle):
            middle -= _STEP
        elif at(middle + _STEP) < at(middle):
            middle += _STEP
        else:
            break
    low, high = at(middle - _STEP) - at(middle), at(middle + _STEP) - at(middle)
    vertex = middle + (0.5 * _STEP * (low - high) / (low + high) if low + high > 0 else 0.0)
    best = min((middle, vertex), key=at)
    return near * float(np.exp(best)), misfit(0.0) - at(best)
