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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.levers import levers
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import pictures
from fastcal.robot.robot import Robot

NUMBERS = 6  # of a picture
_LEAST, _MOST = 1e-7, 1e-1  # k [rad / px]


@dataclass(frozen=True, eq=False)
class Postures:
    """How the numbers of fitted rows are taken together.

    Attributes:
        parts: For each row the places of its numbers and S^-1 Q^T.
        row: (m',) the row of each that comes out.
        number: (m',) which number of its row it is taken for.
    """

    parts: list[tuple[IndexArray, FloatArray]]
    row: IndexArray
    number: IndexArray

    def of(self, values: FloatArray) -> FloatArray:
        """(m', ...) of numbers (m, ...)."""
        return np.concatenate([W @ values[own] for own, W in self.parts])


@dataclass(frozen=True, eq=False)
class _Row:
    row: int
    own: IndexArray  # its numbers
    Q: FloatArray  # (numbers, k)
    G: FloatArray  # (k, joints)
    number: IndexArray  # (k,)


def posture_rows(
    robot: Robot, data: Dataset, measured: _core.Measurements, near: _core.Linearization, unknowns: FloatArray
) -> list[_Row]:
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
        blocks, labels = [np.eye(len(own))[:, others]], [number[own[others]]]
        for p, part in enumerate(parts):
            seen = np.flatnonzero(is_corner & (place >= 2 * part.start) & (place < 2 * part.stop))
            if len(seen) < NUMBERS:
                continue
            Q = np.zeros((len(own), NUMBERS))
            Q[seen] = np.linalg.qr(J[own[seen]])[0]
            blocks.append(Q)
            labels.append(corner.first_number + NUMBERS * p + np.arange(NUMBERS))
        Q = np.hstack(blocks)
        out.append(_Row(int(i), own, Q, Q.T @ lever[own], np.concatenate(labels)))
    return out


def postures(rows: Sequence[_Row], repeatability: float) -> Postures:
    """How the rows are taken together; `repeatability` is k for numbers in px [rad / px]."""
    parts = [(of.own, whitened(of, repeatability)) for of in rows]
    row = np.concatenate([np.full(len(of.number), of.row, dtype=np.intp) for of in rows])
    return Postures(parts, row, np.concatenate([of.number for of in rows]))


def whitened(of: _Row, repeatability: float) -> FloatArray:
    """(k, numbers) S^-1 Q^T."""
    C = np.eye(len(of.number)) + repeatability**2 * of.G @ of.G.T
    return np.asarray(linalg.solve_triangular(np.linalg.cholesky(C), of.Q.T, lower=True))


def joint_repeatability(start: CalibrationProblem) -> float:
    """K of the joints [rad / px]: at which a fit of the geometry leaves as much as its degrees of freedom."""
    found = start.identify()
    theta = np.asarray(found.theta)
    near = start.linearize(theta, [1.0] * len(start.measured.observations))
    unknowns = theta[len(start.names) :]
    rows = posture_rows(start.robot, start.data, start.measured, near, unknowns)
    r, J = np.asarray(near.r), np.asarray(near.J)[:, list(found.free)]
    inside = [(of.Q.T @ r[of.own], of.Q.T @ J[of.own], of.G) for of in rows]
    kept, total = sum(len(own) for own, _, _ in inside), sum(len(of.own) for of in rows)
    freedom = kept - len(found.free)
    if total <= kept or freedom <= 0:
        return 0.0
    squares = sum(float(r[of.own] @ r[of.own]) for of in rows) - sum(float(own @ own) for own, _, _ in inside)
    sigma = squares / (total - kept)

    def excess(log_k: float) -> float:
        k = float(np.exp(log_k))
        white = []
        for own, columns, G in inside:
            S = np.linalg.cholesky(np.eye(len(own)) + k**2 * G @ G.T)
            white.append(linalg.solve_triangular(S, np.column_stack([columns, own]), lower=True))
        A = np.concatenate(white)
        size = np.linalg.norm(A[:, :-1], axis=0)
        basis = np.linalg.qr(A[:, :-1] / np.where(size > 0, size, 1.0))[0]
        left = A[:, -1] - basis @ (basis.T @ A[:, -1])
        return float(left @ left) / sigma - freedom

    low, high = np.log(_LEAST), np.log(_MOST)
    if excess(low) <= 0:
        return 0.0
    return _MOST if excess(high) >= 0 else float(np.exp(optimize.brentq(excess, low, high, xtol=1e-3)))
