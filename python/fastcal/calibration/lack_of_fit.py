# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do the residuals depend on the posture? A score test that needs no further fit.

Every joint may err as a smooth function of any joint, of sums and differences of neighbours, of the payload and of the
directions of approach: columns Z, the fit's own J projected out. T = |Z^T r|^2 / |r|^2 is large where many of them, or
one of them strongly, are in the residual r. Under noise alone r points anywhere in the nu dimensions that the fit
leaves, so with G = Z^T Z its mean is tr G / nu and its variance 2 (nu tr G^2 - (tr G)^2) / (nu^2 (nu + 2)); a gamma law
with these two gives the p-value (the variance-component score test of X. Lin 1997).

Noise is not alike everywhere: joints that come back a little off make more of it where the arm is long. With a_i what
row i adds to Z^T r, noise of any size in each row gives |Z^T r|^2 the mean sum |a_i|^2 and the variance
2 (sum (a_i . a_j)^2 - sum |a_i|^4), each sign being as likely as the other (H. White 1980, by rows).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray, IntArray
from fastcal.calibration.gamma_tail import gamma_tail
from fastcal.calibration.levers import whitened_levers
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.stay_correlation import group_sums
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot


class Chance(NamedTuple):
    """How probable it is that noise makes residuals which depend so on the posture.

    Attributes:
        alike: Noise of one size.
        any_size: The larger of that and of noise of any size in each row.
    """

    alike: float
    any_size: float


Whitening = Callable[[FloatArray], FloatArray]

MANY_NUMBERS = 32  # of a row: so many and more are of pictures, as the core judges them by their mean square
_ABSORBED = 1e-3  # share of a column that the model's own leave of it: below this they explain it


def posture_features(data: Dataset, joint_types: list[str]) -> FloatArray:
    """(N, k) smooth functions of the row's joints, payload and directions, each with mean 0; constant ones left out."""
    columns: list[FloatArray] = []
    angles = []
    for q, kind in zip(data.q.T, joint_types, strict=True):
        if kind == "prismatic":
            columns += [q, q**2]
        else:
            angles.append(q)
            columns += [np.sin(q), np.cos(q), np.sin(2 * q), np.cos(2 * q)]
    for a, b in pairwise(angles):
        columns += [np.sin(a + b), np.cos(a + b), np.sin(a - b), np.cos(a - b)]
    columns.append(data.payload)
    if data.approach is not None:
        columns += list(data.approach.T)
    table = np.column_stack(columns)
    table = table - table.mean(axis=0)
    size = np.sqrt(np.mean(table**2, axis=0))
    return np.asarray(table[:, size > 1e-9] / size[size > 1e-9])


def points_depend(
    J: FloatArray,
    residual: FloatArray,
    rows: IntArray,
    robot: Robot,
    data: Dataset,
    white: Whitening | None = None,
    stay: IndexArray | None = None,
) -> Chance:
    """`posture_p_value` of the points of some rows of the data; J (3 n, p) and residual (3 n,) are theirs.

    `white` takes out of them, (3 n, ...), what rows share; rows of one `stay` (N,) count as one.
    """
    rigid = _core.ErrorModel(robot.core, [], np.zeros(0))
    lever = np.asarray(_core.joint_jacobian(rigid, _core.Samples(data.q[rows]), 1))[:, :3]
    features = posture_features(data, robot.joint_types)[rows]
    lever = lever.reshape(len(residual), -1)
    if white is not None:
        J, residual, lever = white(J), white(residual), white(lever)
    return posture_p_value(J, residual, lever, features, None if stay is None else np.repeat(stay[rows], 3))


def readings_depend(
    problem: CalibrationProblem,
    found: _core.Identification,
    J: FloatArray,
    residual: FloatArray,
    row: IntArray,
    number: IntArray,
    white: Whitening | None = None,
    stay: IndexArray | None = None,
) -> Chance:
    """The same of any numbers: J (m, p) and residual (m,) of number `number` (m,) in row `row` (m,)."""
    lever = whitened_levers(problem, found, row, number)
    if white is not None:
        J, residual, lever = white(J), white(residual), white(lever)
    J, residual, lever, row = pictures_as_postures(J, residual, lever, row)
    features = posture_features(problem.data, problem.robot.joint_types)[row]
    return dependence_p_value(J, residual, lever, features, row if stay is None else stay[row])


def pictures_as_postures(
    J: FloatArray, residual: FloatArray, lever: FloatArray, row: IntArray
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Rows of very many numbers by what these say of the joints: Q^T of each, Q R the row's levers.

    A hundred corners of a picture all show how well its joints stood still: that is noise of a posture, and not of a
    number. Other rows stay as they are.
    """
    count = np.bincount(row)
    if not (count > MANY_NUMBERS).any():
        return J, residual, lever, row
    parts = []
    for i in np.flatnonzero(count):
        own = row == i
        if count[i] <= MANY_NUMBERS:
            parts.append((J[own], residual[own], lever[own], row[own]))
            continue
        Q = np.linalg.qr(lever[own])[0]
        parts.append((Q.T @ J[own], Q.T @ residual[own], Q.T @ lever[own], np.full(Q.shape[1], i)))
    whole = [np.concatenate(part) for part in zip(*parts, strict=True)]
    return whole[0], whole[1], whole[2], whole[3]


def posture_p_value(
    J: FloatArray, residual: FloatArray, lever: FloatArray, features: FloatArray, row: IntArray | None = None
) -> Chance:
    """`dependence_p_value` of points: three numbers of each row, for which it has the features (N, k)."""
    own = np.repeat(np.arange(len(features)), 3) if row is None else row
    return dependence_p_value(J, residual, lever, np.repeat(features, 3, axis=0), own)


def dependence_p_value(
    J: FloatArray, residual: FloatArray, lever: FloatArray, features: FloatArray, row: IntArray
) -> Chance:
    """The probability that noise makes residuals which depend so on the posture.

    Args:
        J: (m, p) whitened columns of the fit.
        residual: (m,) whitened.
        lever: (m, n) how each number moves with each joint.
        features: (m, k) of its row.
        row: (m,) which row that is, or which stay.
    """
    nu = len(residual) - J.shape[1]
    if nu < 3 or features.shape[1] == 0:
        return Chance(1.0, 1.0)
    Q = np.linalg.qr(J)[0]
    r = residual - Q @ (Q.T @ residual)
    Z = (lever[:, :, np.newaxis] * features[:, np.newaxis]).reshape(len(residual), -1)
    before = np.linalg.norm(Z, axis=0)
    Z = Z - Q @ (Q.T @ Z)
    after = np.linalg.norm(Z, axis=0)
    Z = Z[:, after > _ABSORBED * before] / after[after > _ABSORBED * before]
    if Z.shape[1] == 0 or not r @ r > 0:
        return Chance(1.0, 1.0)
    G = Z.T @ Z
    trace, square = float(np.trace(G)), float(np.sum(G * G))
    mean = trace / nu
    variance = 2 * (nu * square - trace**2) / (nu**2 * (nu + 2))
    T = float(np.sum((Z.T @ r) ** 2))
    if not variance > 0:
        return Chance(1.0, 1.0)
    alike = gamma_tail(mean**2 / variance, T / float(r @ r) * mean / variance)
    A = group_sums(Z * r[:, np.newaxis], row) * np.sqrt(len(r) / nu)  # with what the fit took of the noise
    AA = A.T @ A
    mean, variance = float(np.trace(AA)), 2 * float(np.sum(AA * AA) - np.sum(np.sum(A * A, axis=1) ** 2))
    any_size = gamma_tail(mean**2 / variance, T * mean / variance) if variance > 0 else alike
    return Chance(alike, max(alike, any_size))
