# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Noise of joints that repeat badly: larger where the arm is stretched out, and alike in what one posture shows.

Each time a joint comes to a halt it stands off by k [rad; of slides m]. With G (s, n) what the joints move the numbers
of a posture by, each over its standard deviation, these have the covariance

    C = 1 + k^2 G G^T

besides a common factor. k is the one that makes the residuals beside a model X likeliest, whatever X takes of them
(restricted likelihood; H. Patterson, R. Thompson 1971): the least of log|C| + log|X^T C^-1 X| + nu log(r^T P r).

Whether there is any is asked before. With K = G G^T - c, c such that E r^T K r = 0 for white noise beside the model,
r^T K r has at most the variance 2 s^4 tr(K^2 M), M = 1 - h, each posture on its own; heavy tails make it larger, and
so half the sum of the squares of what the postures add, which hold what is looked for too, is taken where that is more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fastcal.arrays import FloatArray, IndexArray, IntArray
from fastcal.calibration.serial_correlation import SerialCorrelation
from fastcal.calibration.tall import gram

# Standard deviations by which the numbers of far postures must err more for k to be looked for, where no two rows are
# of one stay in a posture: of white noise in one of forty sets.
DEVIATIONS = 2.0
# Twice the log of the likelihood that k must gain: white noise gains so much in one of two thousand sets.
GAIN = 11.0
# Share of the degrees of freedom that smooth curves take beside a fit.
FREEDOM_SHARE = 0.35
_ABSORBED = 1e-3  # share of a curve that the fit leaves of it: below this it explains it
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

    def colored(self, values: FloatArray, k: float) -> FloatArray:
        """C values, values (m, ...)."""
        return self.whitened(self.whitened(values, 0.0, k), 0.0, k)

    def traces(self, k: float) -> tuple[float, float]:
        """Of C - 1 and of C^2 - 1."""
        more = [k**2 * spread for _, _, spread in self.parts]
        return float(sum(np.sum(a) for a in more)), float(sum(np.sum(2 * a + a**2) for a in more))

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


def may_repeat_badly(lever: FloatArray, left: FloatArray, of: Hats, *, has_stays: bool) -> float:
    """The k at which to look for one; 0 where residuals do not err more where joints move them far.

    Of stays with several rows each the likelihood is asked in any case: what these share says more. Arguments as of
    `grows_with_reach`.
    """
    far, near = grows_with_reach(lever, left, of)
    if far >= DEVIATIONS:
        return near
    size = float(np.sqrt(np.mean(lever**2)))
    return 1 / size if has_stays and size > 0 else 0.0


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
    error = np.sqrt(max(alike, own / 2))
    if error <= 0 or slope <= 0:
        return 0.0, 0.0
    return found / error, float(np.sqrt(max(found, 0.0) / slope / variance))


def likeliest(X: FloatArray, r: FloatArray, noise: JointNoise, near: float) -> tuple[float, float]:
    """The k at which residuals are likeliest, and by how much twice the log of the likelihood exceeds that of k = 0.

    Args:
        X: (m, p) columns of the model, about unit ones.
        r: (m,) what it is to explain.
        noise: Of these numbers.
        near: k to begin at, above 0.
    """
    both, p = np.column_stack([X, r]), X.shape[1]
    known: dict[float, float] = {}

    def misfit(k: float) -> float:
        N = gram(noise.whitened(both, k))
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


class Likeliest(NamedTuple):
    """The k that is found, over the deviation of a number, what it gains, and the postures that it is of."""

    k: float
    gain: float
    by_stay: bool
    noise: JointNoise


def likeliest_noise(
    X: FloatArray, r: FloatArray, lever: FloatArray, row: IntArray, stay: IndexArray, command: IndexArray, near: float
) -> Likeliest | None:
    """The noise of joints that stand off anew in each row, or in each stay; None where that is not clearly likelier.

    Where it is likelier that they stand off alike whenever an arm is sent to one posture, that is no noise.

    Args:
        X: (m, p) columns of the model, about unit ones.
        r: (m,) what it is to explain.
        lever: (m, n) by what each joint moves each number, over its deviation.
        row: (m,) the row that each number belongs to.
        stay: (N,) the stay in a posture of each row.
        command: (N,) the posture that was asked for.
        near: k to begin at, above 0.
    """
    groups = [row, stay[row], command[row]]
    counts = [len(np.unique(group)) for group in groups]
    best = None
    for i in (0, *(i for i in (1, 2) if counts[i] < counts[i - 1])):
        noise = JointNoise.of(lever, groups[i])
        k, gain = likeliest(X, r, noise, near)
        if gain > GAIN and (best is None or gain > best[0]):
            best = gain, i, k, noise
    return None if best is None or best[1] == 2 else Likeliest(best[2], best[0], best[1] == 1, best[3])


@dataclass(frozen=True, eq=False)
class JointRepeatability:
    """How badly joints repeat, and what that makes of a fit by least squares.

    Attributes:
        k: [rad; of slides m].
        by_stay: Do rows of one stay share the errors of its joints?
        over_noise: The same over the standard deviation of the whitened numbers without it.
        noise: Of the numbers.
        fit: Covariance, noise and degrees of freedom of the fit; `rho` is 0.
    """

    k: float
    by_stay: bool
    over_noise: float
    noise: JointNoise
    fit: SerialCorrelation

    def whitened(self, values: FloatArray) -> FloatArray:
        """C^-1/2 values, values (m, ...)."""
        return self.noise.whitened(values, self.over_noise)


def joint_repeatability(
    J: FloatArray,
    residual: FloatArray,
    lever: FloatArray,
    curves: FloatArray,
    row: IntArray,
    stay: IndexArray,
    command: IndexArray,
) -> JointRepeatability | None:
    """What joints that repeat badly make of a fit; None where they need not.

    k is found beside the fit's columns and as many of the smooth `curves` of its joints as FREEDOM_SHARE allows, those
    that do most first: what the model lacks is no noise. The covariance is s^2 H C H^T, H = (J^T J)^-1 J^T, with
    s^2 = |r|^2 / tr(M C), and degrees of freedom are F. Satterthwaite's, as in `serial_correlation`.

    Args:
        J: (m, p) whitened columns of the free parameters, of full rank.
        residual: (m,) whitened.
        lever: (m, n) by what each joint moves each number, over its deviation.
        curves: (m, c) smooth functions of the posture, by the row of each number.
        row: (m,) the row that each number belongs to, ascending.
        stay: (N,) the stay in a posture of each row.
        command: (N,) the posture that was asked for.
    """
    Q, R = np.linalg.qr(J)
    r = residual - Q @ (Q.T @ residual)
    freedom = len(r) - len(R)
    near = may_repeat_badly(lever, r, hats(Q, row), has_stays=len(np.unique(stay[row])) < len(np.unique(row)))
    if near == 0 or freedom < 3:
        return None
    X = np.hstack([Q, _smooth(Q, lever, curves, int(FREEDOM_SHARE * freedom))])
    found = likeliest_noise(X, residual, lever, row, stay, command, near)
    if found is None:
        return None
    k, noise = found.k, found.noise
    CQ = noise.colored(Q, k)
    B = Q.T @ CQ
    more, square = noise.traces(k)
    trace = len(r) + more - float(np.trace(B))
    squares = len(r) + square - 2 * float(np.sum(CQ**2)) + float(np.sum(B * B))
    inverse, size = np.linalg.inv(R), float(r @ r) / trace
    usual = np.sqrt(size * (1 + more / len(r)) / (float(r @ r) / freedom))
    fit = SerialCorrelation(0.0, inverse @ B @ inverse.T * size, float(usual), trace**2 / squares)
    return JointRepeatability(k * float(np.sqrt(size)), found.by_stay, k, noise, fit)


def _smooth(Q: FloatArray, lever: FloatArray, curves: FloatArray, most: int) -> FloatArray:
    """(m, k) orthonormal, `most` at most: what smooth errors of the joints do beyond Q (m, p), the largest first."""
    Z = (lever[:, :, np.newaxis] * curves[:, np.newaxis]).reshape(len(lever), -1)
    before = np.linalg.norm(Z, axis=0)
    Z = Z - Q @ (Q.T @ Z)
    after = np.linalg.norm(Z, axis=0)
    is_seen = after > _ABSORBED * before
    values, vectors = np.linalg.eigh(gram(Z[:, is_seen] / after[is_seen]))
    kept = np.argsort(-values, kind="stable")[:most]
    kept = kept[values[kept] > _RIDGE * values.max(initial=0.0)]
    return np.asarray(np.linalg.qr((Z[:, is_seen] / after[is_seen]) @ vectors[:, kept])[0])
