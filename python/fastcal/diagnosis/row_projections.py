# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Whitened rows of a fit reduced to one number per pose: a joint angle, a motion, a length along a signature.

With y the whitened partial residual of pose k and c_k its column, the least-squares size is c_k y_k / (c_k c_k).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.diagnosis.fits import Fit
from fastcal.measurements.instrument import beam_axes

# Leverage of a pose below which it shows next to nothing of an effect [of the 90th percentile].
MIN_LEVERAGE = 0.25


@dataclass(frozen=True, eq=False)
class Reading:
    """What each of K poses contributes to an effect, component by component.

    Attributes:
        kept: (K,) fitted rows that show it.
        after: (K, d) what the data leave with the effect in the model.
        fitted: (K, d) the effect's own share; before is the sum of the two.
        deviation: (K, d) standard deviation of `fitted`.
    """

    kept: NDArray[np.intp]
    after: FloatArray
    fitted: FloatArray
    deviation: FloatArray

    @property
    def before(self) -> FloatArray:
        """(K, d) the residual with the effect put back."""
        return self.after + self.fitted


@dataclass(frozen=True, eq=False)
class Effect:
    """Columns C (m, p) of an effect in a fit, its size theta (p,) with covariance (p, p), and r (m,) what remains."""

    fit: Fit
    C: FloatArray
    theta: FloatArray
    covariance: FloatArray
    r: FloatArray

    @staticmethod
    def fitted(fit: Fit, place: slice) -> Effect:
        """Of parameters that are in the fit."""
        A, r, row = fit.standardized
        own = [fit.free.index(i) for i in range(place.start, place.stop)]
        measured = row >= 0
        covariance = fit.pulled_covariance[np.ix_(own, own)]
        return Effect(fit, np.take(A, own, axis=1)[measured], fit.theta[place], covariance, r[measured])

    @staticmethod
    def added(fit: Fit, C: FloatArray) -> Effect:
        """Of a block (m, p) that is not in the fit, by one linear step; rows of priors are in C, as zeros."""
        _A, r, row = fit.whitened
        both = fit.beyond(np.column_stack([C, r]))
        beyond, left = both[:, :-1], both[:, -1]
        theta = np.asarray(np.linalg.lstsq(beyond, left, rcond=1e-9)[0], dtype=np.float64)
        measured = row >= 0
        return Effect(fit, C[measured], theta, _inverse(beyond), (left - beyond @ theta)[: len(row)][measured])

    @cached_property
    def row(self) -> NDArray[np.intp]:
        """(m,) fitted row of each measured number, ascending."""
        return self.fit.near.row

    @property
    def count(self) -> int:
        """Fitted rows."""
        return len(self.fit.problem.kept)

    def dot(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """(N,) product of two columns (m,), pose by pose."""
        return np.asarray(np.bincount(self.row, a * b, self.count), dtype=np.float64)

    def along(self, c: FloatArray) -> Reading:
        """Sizes along a column c (m,), such as a joint's."""
        square = self.dot(c, c)
        length = np.sqrt(square)
        kept = np.flatnonzero(length > MIN_LEVERAGE * np.quantile(length, 0.9))
        factor = 1 / square[kept, np.newaxis]
        g = np.column_stack([self.dot(c, column)[kept] for column in self.C.T]) * factor
        after = self.dot(c, self.r)[kept, np.newaxis] * factor
        return self._reading(kept, after, g[:, np.newaxis, :])

    def along_itself(self) -> Reading:
        """Displacement [m] along the effect's own signature in each pose; fitted is never negative."""
        s = self.C @ self.theta
        length = np.sqrt(self.dot(s, s))
        kept = np.flatnonzero(length > 1e-9 * max(length.max(initial=0.0), 1e-300))
        scale = np.zeros(self.count)
        scale[kept] = length[kept] * self._sigma.mean(axis=1)[kept]
        square = np.where(length > 0, length**2, 1.0)
        g = np.column_stack([self.dot(s, column) for column in self.C.T]) * (scale / square)[:, np.newaxis]
        after = self.dot(s, self.r) * scale / square
        return self._reading(kept, after[kept, np.newaxis], g[kept, np.newaxis, :])

    def motion(self, groups: list[FloatArray]) -> Reading:
        """Motion [m] of the middle of the measured points, along x, y, z of the measuring frame.

        Args:
            groups: (N,) courses h of the effect: its columns are h times a motion that depends on the place alone.
        """
        kept, at = self.points
        C = self._metres(kept, self.C[at])
        g = np.zeros_like(C)
        for course in groups:
            h = course[kept, np.newaxis, np.newaxis]
            square = float(np.sum(h * h))
            if square > 0:
                g += h * (np.sum(h * C, axis=0) / square)
        return self._reading(kept, self._metres(kept, self.r[at]), g)

    def motion_by(self, directions: FloatArray, courses: FloatArray) -> Reading:
        """Motion as above, of a block whose columns are each of its directions (m, d) times courses (N, k)."""
        kept, at = self.points
        middle = self._metres(kept, directions[at]).mean(axis=0)
        g = middle[np.newaxis, :, :, np.newaxis] * courses[kept, np.newaxis, np.newaxis, :]
        return self._reading(kept, self._metres(kept, self.r[at]), g.reshape(len(kept), 3, -1))

    def in_frame(self, frame: FloatArray) -> Reading:
        """Shift [m] along the three translations of a frame whose columns are (m, 3 or 6)."""
        kept, at = self.points
        inverse = np.linalg.inv(frame[at][:, :, :3])
        return self._reading(kept, np.einsum("kij,kj->ki", inverse, self.r[at]), inverse @ self.C[at])

    def displacement(self) -> Reading:
        """Displacement [m] of each measured point along x, y, z of the measuring frame."""
        kept, at = self.points
        return self._reading(kept, self._metres(kept, self.r[at]), self._metres(kept, self.C[at]))

    def _metres(self, kept: NDArray[np.intp], whitened: FloatArray) -> FloatArray:
        """Whitened numbers (K, 3, ...) of points in the measuring frame [m]."""
        data = self.fit.problem.kept
        size = np.einsum("ki,ki...->ki...", self._sigma[kept], whitened)
        if data.instrument is None or data.position is None:
            return np.asarray(size)
        return np.asarray(np.einsum("kij,ki...->kj...", beam_axes(data.position[kept], data.instrument[kept]), size))

    @cached_property
    def points(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """(K,) fitted rows whose point is whole, and (K, 3) the places of its x, y, z among the measured numbers."""
        kept = np.flatnonzero(np.isfinite(self.fit.problem.kept.points).all(axis=1))
        return kept, np.searchsorted(self.row, kept)[:, np.newaxis] + np.arange(3)

    @cached_property
    def _sigma(self) -> FloatArray:
        """(N, 3) standard deviation of a coordinate or a length [m] with which the rows are whitened."""
        data, noise = self.fit.problem.kept, self.fit.problem.noise
        claims = np.zeros((self.count, 3)) if data.sigma_position is None else np.nan_to_num(data.sigma_position)
        common = noise.common[0 if data.position is not None else 2]
        return np.hypot(np.broadcast_to(claims.reshape(self.count, -1), (self.count, 3)), common) * noise.factor

    def _reading(self, kept: NDArray[np.intp], after: FloatArray, g: FloatArray) -> Reading:
        """`g` (K, d, p): derivatives of what is drawn by theta."""
        variance = np.sum((g @ self.covariance) * g, axis=2)
        return Reading(kept, after, g @ self.theta, np.sqrt(np.maximum(variance, 0.0)))


def _inverse(C: FloatArray) -> FloatArray:
    length = np.linalg.norm(C, axis=0)
    length[length == 0] = 1.0
    return np.asarray(
        np.linalg.pinv((C / length).T @ (C / length), rcond=1e-14, hermitian=True) / np.outer(length, length)
    )
