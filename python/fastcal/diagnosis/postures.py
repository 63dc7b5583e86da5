# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures reduced to six numbers each, with the repeatability of the posture included in their noise.

All that moves a camera against a board moves the corners of a picture along L (K, 6), what a small motion of the arm's
base does to them, each corner over its standard deviation. With L = Q R, Q^T r (6,) holds all that the picture says of
arm, camera and board; the rest of r is noise of pixels. All corners of a picture show alike how well its joints stood
still: with the levers G = Q^T dr/dq of the joints the six numbers have the covariance

    C = 1 + k^2 G G^T

k being the joints' repeatability over the pixels' noise. They are whitened by C = S S^T: S^-1 Q^T r. All pictures of a
row are of the same joints, and are whitened together. k is that at which a fit of the geometry leaves as much as its
degrees of freedom.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg, optimize

from fastcal import _core
from fastcal.arrays import BoolArray, FloatArray, IndexArray
from fastcal.calibration.levers import levers
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import pictures
from fastcal.robot.robot import Robot

NUMBERS = 6  # of a picture
_LEAST, _MOST = 1e-7, 1e-1  # k [rad / px]


@dataclass(frozen=True, eq=False)
class PostureRow:
    """A fitted row whose pictures are turned into what they say; its other numbers stay.

    Attributes:
        row: Which of the fitted rows.
        own: (m,) places of its numbers among all.
        Q: (m, k) orthonormal, Q^T r what is taken for them.
        G: (k, joints) what the joints move of that.
        number: (k,) which number of its row each is taken for.
        is_picture: (k,) is it one of the six of a picture?
        corner_numbers: Numbers of corners among `own`.
    """

    row: int
    own: IndexArray
    Q: FloatArray
    G: FloatArray
    number: IndexArray
    is_picture: BoolArray
    corner_numbers: int


@dataclass(frozen=True, eq=False)
class Postures:
    """How the numbers of fitted rows are taken together; `repeatability` is k for numbers in px [rad / px]."""

    rows: list[PostureRow]
    repeatability: float

    @cached_property
    def row(self) -> IndexArray:
        """(m',) the row of each number that comes out."""
        return np.concatenate([np.full(len(of.number), of.row, dtype=np.intp) for of in self.rows])

    @cached_property
    def number(self) -> IndexArray:
        """(m',) which number of its row it is taken for."""
        return np.concatenate([of.number for of in self.rows])

    def of(self, values: FloatArray) -> FloatArray:
        """(m', ...) S^-1 Q^T v of numbers v (m, ...)."""
        return np.concatenate([W @ values[of.own] for of, W in zip(self.rows, self._whitening, strict=True)])

    def whitened(self, values: FloatArray) -> FloatArray:
        """(m', ...) S^-1 Q^T v of Q^T v (m', ...)."""
        parts = zip(self._roots, self._by_row(values), strict=True)
        return np.concatenate([linalg.solve_triangular(S, part, lower=True) for S, part in parts])

    def as_seen(self, values: FloatArray) -> FloatArray:
        """(m', ...) Q^T v of S^-1 Q^T v (m', ...)."""
        parts = zip(self._roots, self._by_row(values), strict=True)
        return np.concatenate([S @ part for S, part in parts])

    def joint_share(self, k: float) -> float:
        """What joints that repeat to k add to a number of a corner, RMS over all, over the noise of pixels."""
        moved = sum(float(np.sum(of.G[of.is_picture] ** 2)) for of in self.rows)
        return k * float(np.sqrt(moved / sum(of.corner_numbers for of in self.rows)))

    def _by_row(self, values: FloatArray) -> list[FloatArray]:
        return np.split(values, np.cumsum([len(of.number) for of in self.rows])[:-1])

    @cached_property
    def _roots(self) -> list[FloatArray]:
        k = self.repeatability
        return [np.asarray(np.linalg.cholesky(np.eye(len(of.G)) + k**2 * of.G @ of.G.T)) for of in self.rows]

    @cached_property
    def _whitening(self) -> list[FloatArray]:
        return [
            np.asarray(linalg.solve_triangular(S, of.Q.T, lower=True))
            for of, S in zip(self.rows, self._roots, strict=True)
        ]


def posture_rows(
    robot: Robot, data: Dataset, measured: _core.Measurements, near: _core.Linearization, unknowns: FloatArray
) -> list[PostureRow]:
    """The fitted rows, each with the numbers of its pictures turned into what they say; other numbers stay.

    Args:
        robot: The arm, with base and tool fitted.
        data: The rows that are fitted.
        measured: What was measured in them.
        near: The linearized problem of these rows; its first six columns are the base's.
        unknowns: Of the observations.
    """
    corner = next(of for of in measured.observations if of.field == CORNERS)
    row, number = np.asarray(near.row, dtype=np.intp), np.asarray(near.number, dtype=np.intp)
    J = np.asarray(near.J)[:, :NUMBERS]
    lever = levers(robot.core, data, measured, unknowns)[row, number]
    parts = list(pictures(robot.description).values())
    out = []
    for i in np.unique(row):
        own = np.flatnonzero(row == i)
        place = number[own] - corner.first_number
        is_corner = (place >= 0) & (place < 2 * parts[-1].stop)
        others = np.flatnonzero(~is_corner)
        blocks, labels, seen_corners = [np.eye(len(own))[:, others]], [number[own[others]]], 0
        for p, part in enumerate(parts):
            seen = np.flatnonzero(is_corner & (place >= 2 * part.start) & (place < 2 * part.stop))
            if len(seen) < NUMBERS:
                continue
            Q = np.zeros((len(own), NUMBERS))
            Q[seen] = np.linalg.qr(J[own[seen]])[0]
            blocks.append(Q)
            labels.append(corner.first_number + NUMBERS * p + np.arange(NUMBERS))
            seen_corners += len(seen)
        Q = np.hstack(blocks)
        is_picture = np.arange(Q.shape[1]) >= len(others)
        out.append(PostureRow(int(i), own, Q, Q.T @ lever[own], np.concatenate(labels), is_picture, seen_corners))
    return out


def joint_repeatability(start: CalibrationProblem) -> float:
    """K of the joints [rad / px]: at which a fit of the geometry leaves as much as its degrees of freedom."""
    found = start.identify()
    theta = np.asarray(found.theta)
    near = start.linearize(theta, [1.0] * len(start.measured.observations))
    unknowns = theta[len(start.names) :]
    as_seen = Postures(posture_rows(start.robot, start.data, start.measured, near, unknowns), 0.0)
    r, inside = np.asarray(near.r), as_seen.of(np.asarray(near.r))
    total = sum(len(of.own) for of in as_seen.rows)
    freedom = len(inside) - len(found.free)
    if total <= len(inside) or freedom <= 0:
        return 0.0
    squares = sum(float(r[of.own] @ r[of.own]) for of in as_seen.rows) - float(inside @ inside)
    sigma = float(np.sqrt(squares / (total - len(inside))))
    columns = as_seen.of(np.asarray(near.J)[:, list(found.free)])
    return likeliest_repeatability(as_seen, inside / sigma, columns, freedom)


def likeliest_repeatability(as_seen: Postures, r: FloatArray, J: FloatArray, freedom: float) -> float:
    """K [rad / px] at which a fit leaves as much as its degrees of freedom.

    Args:
        as_seen: The rows, with `repeatability` 0.
        r: (m',) Q^T of what the fit leaves, over the noise of pixels.
        J: (m', p) Q^T of the columns of what was fitted.
        freedom: Of these numbers.
    """
    both = np.column_stack([J, r])

    def excess(log_k: float) -> float:
        k = float(np.exp(log_k))
        A = Postures(as_seen.rows, k).whitened(both)
        size = np.linalg.norm(A[:, :-1], axis=0)
        basis = np.linalg.qr(A[:, :-1] / np.where(size > 0, size, 1.0))[0]
        left = A[:, -1] - basis @ (basis.T @ A[:, -1])
        return float(left @ left) - freedom

    low, high = np.log(_LEAST), np.log(_MOST)
    if excess(low) <= 0:
        return 0.0
    return _MOST if excess(high) >= 0 else float(np.exp(optimize.brentq(excess, low, high, xtol=1e-3)))
