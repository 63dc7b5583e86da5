# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What poses of a board err by, and what those of the arm that carries it: a fit weighed by both.

An arm that is known by its poses has errors of its own, and those of its turns move the board that a sensor sees at a
distance p by w x p: position and turn err together. With residuals r (m,) of a row, [m] and [rad], A = dr/dw of turns
of the flange in its own axes (m, 3),

    cov r = diag(s_axis^2, s_turn^2) + t^2 A A^T,

s of each axis of each view's positions, of its turns, and t of the arm's turns: the variances are the most likely ones
after integrating the places out (REML: D. Harville, "Maximum likelihood approaches to variance component estimation",
1977), the places the weighed least squares. Shifts of the flange count among those of the sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, optimize

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.cells.asked import Priors
from fastcal.cells.cell import Cell
from fastcal.cells.pose_arm import turned_joints
from fastcal.cells.readings import Readings
from fastcal.robot.identified_spec import Values

_FEWEST = 12  # rows: the variances of fewer are known too coarsely to weigh by
_STEP = 1e-6  # [rad] of a turn of the flange
_ROUNDS, _SETTLED = 4, 1e-2  # of weighing anew; standard deviations of a step that is none
_EXACT = 1e-9  # [m, rad]: what is left of exact poses is rounding
_LEAST, _MOST = 1e-3, 30.0  # times what is left of all: bounds of a standard deviation


@dataclass(frozen=True, eq=False)
class _Rows:
    """Residuals of N rows of the same m numbers: r (N, m), J (N, m, u), A (N, m, 3); of which variance each is (m,)."""

    r: FloatArray
    J: FloatArray
    A: FloatArray
    part: IntArray

    def covariance(self, log_sigma: FloatArray) -> FloatArray:
        """(N, m, m), of log standard deviations of the parts, and of the arm's turns."""
        variance = np.exp(2 * log_sigma)
        return np.asarray(np.diag(variance[self.part]) + variance[-1] * self.A @ self.A.transpose(0, 2, 1))

    def weighed(
        self, log_sigma: FloatArray, precision: FloatArray, mean: FloatArray
    ) -> tuple[float, FloatArray, FloatArray]:
        """-2 log of the restricted likelihood but for a constant; the step u, and its covariance."""
        root = np.linalg.cholesky(self.covariance(log_sigma))
        white = np.linalg.solve(root, np.concatenate([self.J, self.r[..., np.newaxis]], axis=2))
        J, r = white[..., :-1].reshape(-1, self.J.shape[2]), white[..., -1].ravel()
        H, c = J.T @ J + np.diag(precision), precision * mean - J.T @ r
        size = 1 / np.sqrt(np.diag(H))
        factor = linalg.cho_factor(H * np.outer(size, size), lower=True)
        u = size * linalg.cho_solve(factor, size * c)
        left = float(r @ r + precision @ mean**2 - c @ u)
        log_det = 2 * float(np.log(np.diagonal(root, axis1=1, axis2=2)).sum())
        log_det += 2 * float(np.log(np.diag(factor[0])).sum() - np.log(size).sum())
        return left + log_det, u, np.asarray(linalg.cho_solve(factor, np.eye(len(u)))) * np.outer(size, size)


def settled_poses(
    cell: Cell, readings: Readings, found: _core.Identification, known: Priors, threads: int = 1
) -> Values | None:
    """A fit of a cell whose arms are known by poses once more, weighed by the noise of both.

    None where more than poses was read, where standard deviations were given, or from too few rows.

    Args:
        cell: Before the fit.
        readings: Without gross rows.
        found: The fit, as if position and turn erred alone.
        known: What is known of the places beforehand.
        threads: Cores.
    """
    if readings.labels or any(name.partition("@")[0] not in ("position", "rotation") for name in readings.tables):
        return None
    theta, free = np.array(found.theta), list(found.free)
    precision = known.sigma[free] ** -2.0
    log_sigma: FloatArray | None = None
    for _ in range(_ROUNDS):
        rows = _rows(cell, readings, theta, free, threads)
        if rows is None:
            return None
        mean = (known.mean - theta)[free]
        log_sigma = _most_likely(rows, precision, mean, log_sigma)
        _, u, covariance = rows.weighed(log_sigma, precision, mean)
        theta[free] += u
        if np.all(np.abs(u) < _SETTLED * np.sqrt(np.diag(covariance))):
            break
    return Values(theta, free, covariance)


def _most_likely(rows: _Rows, precision: FloatArray, mean: FloatArray, start: FloatArray | None) -> FloatArray:
    """Log standard deviations of the parts and of the arm's turns."""
    count = int(rows.part.max()) + 1
    left = np.array([np.sqrt(np.mean(rows.r[:, rows.part == k] ** 2)) for k in range(count)])
    turns = float(np.sqrt(np.mean(np.sum(rows.r**2, axis=1)) / np.mean(np.sum(rows.A**2, axis=(1, 2)))))
    size = np.log(np.maximum([*left, turns], _EXACT))
    bounds = [(of + np.log(_LEAST), of + np.log(_MOST)) for of in size]
    begin = size - np.log(2) / 2 if start is None else np.clip(start, *np.transpose(bounds))

    def cost(x: FloatArray) -> float:
        return rows.weighed(x, precision, mean)[0]

    return np.asarray(optimize.minimize(cost, begin, method="L-BFGS-B", bounds=bounds).x)


def _rows(cell: Cell, readings: Readings, theta: FloatArray, free: Sequence[int], threads: int) -> _Rows | None:
    """At theta (T,), of the rows that hold all numbers; None from too few."""
    measured = readings.measured(cell)
    near = _core.linearize(
        cell.model, readings.samples(cell), measured, theta, [1.0] * len(measured.observations), threads
    )
    row, number = (np.asarray(of, dtype=np.intp) for of in (near.row, near.number))
    count = int(number.max(initial=-1)) + 1
    whole = np.flatnonzero(np.bincount(row, minlength=len(readings)) == count)
    if len(whole) < _FEWEST:
        return None
    kept = np.isin(row, whole)
    shape = (len(whole), count)
    r, J = np.asarray(near.r)[kept].reshape(shape), np.asarray(near.J)[kept][:, free].reshape(*shape, len(free))
    return _Rows(r, J, _turned(cell, readings, measured, theta, threads)[whole][:, :count], _parts(measured, count))


def _parts(measured: _core.Measurements, count: int) -> IntArray:
    """(m,) of which variance each number of a row is: each axis of a position, all of a turn."""
    out, parts = np.zeros(count, dtype=np.intp), 0
    for of in measured.observations:
        own = np.arange(len(of.components))
        out[of.first_number + own] = parts + (0 if of.unit == "rad" else own)
        parts = int(out.max()) + 1
    return out


def _turned(
    cell: Cell, readings: Readings, measured: _core.Measurements, theta: FloatArray, threads: int
) -> FloatArray:
    """(N, m, 3) how each number moves as the flange of each arm of poses turns in its own axes, all arms alike."""
    here = np.asarray(_core.residuals(cell.model, readings.samples(cell), measured, theta, threads))
    out = np.zeros((*here.shape, 3))
    firsts = {of.name: of.first_joint for of in cell.core.branches}
    for arm in cell.arms:
        own = slice(firsts[arm.name], firsts[arm.name] + arm.robot.joint_count)
        for axis in range(3) if arm.of_poses else ():
            q = readings.q.copy()
            q[:, own] = turned_joints(readings.q[:, own], _STEP * np.eye(3)[axis])
            samples = replace(readings, q=q).samples(cell)
            there = np.asarray(_core.residuals(cell.model, samples, measured, theta, threads))
            out[:, :, axis] += (there - here) / _STEP
    return out
