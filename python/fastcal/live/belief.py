# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the rows so far say of the arm: all its parameters at once, linear about the placed nominal arm.

With J the whitened derivatives of the measured points, r the whitened misfits and P what is known before,

    M = J^T J + P,   theta = M^-1 J^T r,   C = s^2 M^-1

s being how many times the misfits exceed the stated noise. A new point at J_n is expected with covariance
J_n C J_n^T + s^2 sigma^2 I, which is what a row is judged by; the mean of tr(J_t C J_t^T) / 3 over where the arm may
work is the variance that a session is to bring down (the criterion of `design_poses`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.problem import asked_parameters
from fastcal.calibration.realign import realign
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

FEWEST = 4  # rows that place the arm: base and the tool's point are nine numbers
KNOWN_TO = 3.0  # plausible sizes, of the geometry
PLACED_TO = 100.0  # of base and tool, which nobody knows before
STATED_DEGREES = 6.0  # numbers that the stated noise is worth, beside those that were measured


@dataclass(frozen=True, eq=False)
class Belief:
    """The arm as N rows show it.

    Attributes:
        robot: The nominal arm, with the base and tool that fit the rows.
        data: The rows.
        sigma: Stated noise of a coordinate [m].
    """

    robot: Robot
    data: Dataset
    sigma: float

    @classmethod
    def of(cls, nominal: Robot, data: Dataset, sigma: float) -> Belief | None:
        """What the rows say; None where they do not place the arm.

        Raises:
            Undetermined: The postures fix no base.
        """
        return cls(realign(nominal, data), data, sigma) if len(data) >= FEWEST else None

    @cached_property
    def columns(self) -> list[int]:
        """The parameters that are taken as unknown."""
        return asked_parameters(self.robot.error_model, geometry=True, turned=False, placed=True)

    @cached_property
    def known(self) -> FloatArray:
        """(p,) information on each parameter, in units of its plausible size, before anything was measured."""
        owners = [self.robot.error_model.parameters[i].owner for i in self.columns]
        return np.array([1.0 / (PLACED_TO if owner in ("base", "tool") else KNOWN_TO) ** 2 for owner in owners])

    def derivatives(self, data: Dataset) -> FloatArray:
        """(N, 3, p) of points by parameters, both in units of noise and plausible sizes."""
        sizes = np.array([self.robot.error_model.parameters[i].sigma for i in self.columns])
        J = self.robot.parameter_jacobian(data.q, payload=data.payload)
        return np.asarray(J[:, :, self.columns] * (sizes / self.sigma))

    @cached_property
    def _rows(self) -> tuple[FloatArray, FloatArray]:
        """(3N, p) derivatives and (3N,) misfits of the rows."""
        r = (self.data.points - self.robot.poses(self.data)[:, :3, 3]) / self.sigma
        return self.derivatives(self.data).reshape(-1, len(self.columns)), r.ravel()

    @cached_property
    def root(self) -> FloatArray:
        """(p, p) with root root^T = M^-1."""
        J, _ = self._rows
        return np.asarray(np.linalg.inv(np.linalg.cholesky(J.T @ J + np.diag(self.known))).T)

    @cached_property
    def theta(self) -> FloatArray:
        """(p,) the parameters, in plausible sizes."""
        J, r = self._rows
        return np.asarray(self.root @ (self.root.T @ (J.T @ r)))

    @cached_property
    def deleted(self) -> FloatArray:
        """(N,) square of each row's misfit from what all others say, in units of the stated noise."""
        J, r = self._rows
        e = (r - J @ self.theta).reshape(-1, 3)
        A = (J @ self.root).reshape(len(e), 3, -1)
        left = np.eye(3) - A @ np.transpose(A, (0, 2, 1))
        return np.asarray(np.sum(e * np.linalg.solve(left, e[:, :, None])[:, :, 0], axis=1))

    @cached_property
    def misfit(self) -> tuple[float, float]:
        """Sum of the squares that are left, prior and all, and the numbers that are left to judge them by."""
        J, r = self._rows
        e = r - J @ self.theta
        square = float(e @ e + self.theta @ (self.known * self.theta))
        return square, max(float(len(r) - np.sum((J @ self.root) ** 2)), 0.0)

    @property
    def degrees(self) -> float:
        """Numbers that say how large the noise is."""
        return STATED_DEGREES + self.misfit[1]

    @property
    def scale(self) -> float:
        """s, at least 1."""
        return float(np.sqrt(max(1.0, (STATED_DEGREES + self.misfit[0]) / self.degrees)))

    def predicted(self, data: Dataset) -> tuple[FloatArray, FloatArray]:
        """Where the points of some rows are expected (N, 3) [m], and with which covariance, noise included [m^2]."""
        J = self.derivatives(data)
        point = self.robot.poses(data)[:, :3, 3] + self.sigma * (J @ self.theta)
        A = J @ self.root
        return point, (self.scale * self.sigma) ** 2 * (A @ np.transpose(A, (0, 2, 1)) + np.eye(3))

    def deviation(self, targets: FloatArray) -> float:
        """Standard deviation of a predicted coordinate [m], root of the mean square over `targets` (T, 3, p)."""
        A = targets.reshape(-1, targets.shape[-1]) @ self.root
        return self.scale * self.sigma * float(np.sqrt(np.mean(np.sum(A**2, axis=1))))

    def gains(self, candidates: FloatArray, targets: FloatArray) -> FloatArray:
        """(K,) by how much each of `candidates` (K, 3, p), once measured, would lower the mean variance at targets."""
        C = self.root @ self.root.T
        B = targets.reshape(-1, targets.shape[-1])
        CBC = C @ (B.T @ B / len(B)) @ C
        inside = np.eye(3) + candidates @ C @ np.transpose(candidates, (0, 2, 1))
        lowered = candidates @ CBC @ np.transpose(candidates, (0, 2, 1))
        return np.asarray((self.scale * self.sigma) ** 2 * np.trace(np.linalg.solve(inside, lowered), axis1=1, axis2=2))
