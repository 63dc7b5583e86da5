# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cell near where it is, as normal equations in which all numbers of a posture share the errors of its joints.

Residuals r of a posture, whitened by the noise of a reading, with E = dr/dq of the joints that turn (columns of r's
own derivative), err alike by how well these repeat: with s and t to be found,

    r = E e + n,    e ~ N(0, (s t)^2),  n ~ N(0, s^2),    cov r = s^2 (1 + t^2 E E^T).

By E = U S V^T the six or fewer directions U^T r have the variances s^2 (1 + t^2 S^2), all others s^2: only these are
kept one by one, of the rest the sums. Of parameters u ~ N(mean, 1 / precision) what is left after integrating them out
is the evidence for s, t and the precisions (D. Harville, "Maximum likelihood approaches to variance component
estimation", 1977).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, optimize

from fastcal import _core
from fastcal.arrays import thin_svd
from fastcal.cells.asked import Priors
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.monitoring.hypotheses import zero_direction
from fastcal.robot.identified_spec import Solution, Values

FloatArray = NDArray[np.float64]

_ROUNDS = 10
_SETTLED = 1e-2  # standard deviations: less of a step is none
_SCALES = (0.05, 20.0)  # bounds of s
_REPEATS = (1e-8, 1e-2)  # [rad] bounds of what joints repeat to
_BEYOND = 0.5  # of the greatest
_REPEATS_START = 1e-5
_HELD = (0.05, 20.0)  # bounds of how far the geometry may be off, in plausible sizes


@dataclass(frozen=True)
class SharedNoise:
    """What was found of the noise.

    Attributes:
        scale: s, of what the readings were whitened by.
        repeats: s t [rad], how well the joints come back.
        held: Plausible sizes within which the geometry is off what the file says; None: free.
    """

    scale: float
    repeats: float
    held: float | None

    @property
    def is_beyond(self) -> bool:
        """Do joints seem to repeat worse than any that was looked for? Then something else is what readings share."""
        return self.repeats > _BEYOND * _REPEATS[1] * self.scale

    def precision(self, of_one: FloatArray, geometry: NDArray[np.bool_]) -> FloatArray:
        """(u,) of what is known, from that with the geometry at one plausible size."""
        return np.where(geometry, of_one / (self.held or 1.0) ** 2, of_one)


@dataclass(frozen=True, eq=False)
class Near:
    """Readings at one place of the cell, linear in u: theta = theta_there + G u.

    Attributes:
        H, c, q, count: J^T J, J^T r, r^T r and number of what no joint moves.
        J, r, S: (k, u), (k,), (k,) of the directions in which joints move it.
    """

    H: FloatArray
    c: FloatArray
    q: float
    count: int
    J: FloatArray
    r: FloatArray
    S: FloatArray

    @staticmethod
    def of(
        cell: Cell,
        measured: _core.Measurements,
        readings: Readings,
        theta: FloatArray,
        G: FloatArray,
        noise: list[float],
        threads: int = 1,
    ) -> Near:
        """At theta (T,), by columns G (T, u), whitened by `noise` of each kind of observation."""
        near = _core.linearize(cell.model, readings.samples(cell), measured, theta, noise, threads)
        r, row, J = np.asarray(near.r), np.asarray(near.row), np.asarray(near.J)
        zeros = [column for _, _, kind, column in joint_zeros(cell, len(theta)) if kind == "revolute"]
        E, J = J @ np.reshape(zeros, (-1, len(theta))).T, J @ G
        parts = []
        for k in np.unique(row):
            own = row == k
            U, S, _ = thin_svd(E[own])
            parts.append((U.T @ J[own], U.T @ r[own], S))
        along, along_r, S = (np.concatenate(part) for part in zip(*parts, strict=True))
        H, c, q = J.T @ J - along.T @ along, J.T @ r - along.T @ along_r, float(r @ r - along_r @ along_r)
        return Near(H, c, q, len(r) - len(S), along, along_r, S)

    @property
    def numbers(self) -> int:
        """That were read."""
        return self.count + len(self.r)

    def posterior(self, scale: float, ratio: float, mean: FloatArray, precision: FloatArray) -> Posterior:
        """Of u, with the noise s = scale, t = ratio.

        Raises:
            LinAlgError: Such noise leaves nothing of a parameter.
        """
        variance = scale**2 * (1 + (ratio * self.S) ** 2)
        weighed = self.J / variance[:, np.newaxis]
        H = self.H / scale**2 + weighed.T @ self.J + np.diag(precision)
        c = precision * mean - self.c / scale**2 - weighed.T @ self.r
        if not (np.diag(H) > 0).all():
            raise linalg.LinAlgError  # nothing is left of a parameter, or it is NaN
        size = 1 / np.sqrt(np.diag(H))
        factor = linalg.cho_factor(H * np.outer(size, size), lower=True)
        u = size * linalg.cho_solve(factor, size * c)
        cost = self.q / scale**2 + float(self.r @ (self.r / variance)) + float(precision @ mean**2) - float(c @ u)
        known = precision[precision > 0]
        log_det = 2 * float(np.log(np.diag(factor[0])).sum() - np.log(size).sum()) - float(np.log(known).sum())
        log_noise = self.count * np.log(scale**2) + float(np.log(variance).sum())
        return Posterior(u, factor, size, cost, cost + log_det + log_noise)


@dataclass(frozen=True, eq=False)
class Posterior:
    """Parameters u, their covariance, what is left (chi square), and -2 log of the evidence but for a constant."""

    u: FloatArray
    factor: tuple[FloatArray, bool]
    size: FloatArray
    cost: float
    evidence: float

    @property
    def is_at_rest(self) -> bool:
        """Is the step u none, in standard deviations?"""
        return bool(np.abs(self.u / np.sqrt(np.diag(self.covariance))).max() < _SETTLED)

    @property
    def covariance(self) -> FloatArray:
        """(u, u)."""
        inverse = np.asarray(linalg.cho_solve(self.factor, np.eye(len(self.u))))
        return inverse * np.outer(self.size, self.size)


def joint_zeros(cell: Cell, count: int) -> list[tuple[str, int, str, FloatArray]]:
    """Arm, number from 0, type and how the parameters (T,) move when its zero is off by 1 rad or m, of each joint."""
    first = {branch.name: branch.first_parameter for branch in cell.core.branches}
    out = []
    for arm in cell.arms:
        for joint, kind in enumerate([] if arm.of_poses else arm.robot.joint_types):
            own = zero_direction(arm.robot, joint)[: len(arm.robot.core.nominal)]
            column = np.zeros(count)
            column[first[arm.name] : first[arm.name] + len(own)] = own
            out.append((arm.name, joint, kind, column))
    return out


def settled(
    cell: Cell, readings: Readings, found: _core.Identification, known: Priors, threads: int = 1
) -> tuple[Solution, SharedNoise | None]:
    """A fit of a cell once more, with the noise that the readings of a posture share; as it was, and None, far off.

    Args:
        cell: Before the fit.
        readings: Without gross rows.
        found: The fit, as if all numbers erred alone.
        known: What is known beforehand, the geometry within one plausible size where it is held.
        threads: Cores.
    """
    theta, free = np.array(found.theta), list(found.free)
    measured, G = readings.measured(cell), np.eye(len(theta))[:, free]
    precision, held = known.sigma[free] ** -2.0, known.geometry[free]
    for _ in range(_ROUNDS):
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # where the steps lead ever farther off
                near = Near.of(cell, measured, readings, theta, G, list(found.common_noise), threads)
                mean = (known.mean - theta)[free]
                noise = most_likely(near, mean, precision, held)
                there = near.posterior(noise.scale, noise.repeats / noise.scale, mean, noise.precision(precision, held))
        except linalg.LinAlgError:
            return found, None
        theta[free] += there.u
        if there.is_at_rest:
            break
    return Values(theta, free, there.covariance), noise


def most_likely(near: Near, mean: FloatArray, precision: FloatArray, held: NDArray[np.bool_]) -> SharedNoise:
    """The noise, and the size of what is held, that make the readings most likely.

    Args:
        near: The readings.
        mean: (u,) of what is known of the parameters.
        precision: (u,) of it, that of the geometry at one plausible size.
        held: (u,) which are the geometry's, if any.
    """

    def noise(x: FloatArray) -> SharedNoise:
        scale, ratio, *sizes = np.exp(x).tolist()
        return SharedNoise(scale, scale * ratio, sizes[0] if sizes else None)

    def cost(x: FloatArray) -> float:
        of = noise(x)
        try:
            return near.posterior(of.scale, of.repeats / of.scale, mean, of.precision(precision, held)).evidence
        except linalg.LinAlgError:  # such noise leaves nothing of a parameter but rounding
            return np.inf

    bounds = np.log([_SCALES, _REPEATS, _HELD][: 3 if held.any() else 2])
    start = np.log([1.0, _REPEATS_START, 1.0])[: len(bounds)]
    simplex = np.vstack([start, start - np.eye(len(start))])
    options = {"initial_simplex": simplex, "xatol": 1e-2, "fatol": 1e-2}
    return noise(optimize.minimize(cost, start, method="Nelder-Mead", bounds=bounds, options=options).x)
