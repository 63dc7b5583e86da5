# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Residuals of every kind of reading, linearized and whitened."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import BoolArray, FloatArray
from fastcal.calibration.problem import CalibrationProblem
from fastcal.measurements.kinds import Kind, in_order, of_observation


@dataclass(frozen=True, eq=False)
class Residuals:
    """The problem near a fit.

    Attributes:
        J: (m, P) whitened columns of all parameters.
        residual: (m,) whitened, predicted less measured.
        row: (m,) the row that each number belongs to, ascending.
        number: (m,) which number of its row.
        free: Columns of the identified parameters.
        kept: (m,) is its row no outlier?
        kind_of_number: The kind of each number of a row.
        kind: The one that sizes are told of: points where they were measured.
        scales: [m or rad] what a whitened 1 of each kind stands for.
        theta, noise: Where, and the noise common to all rows by observation.
        place: (m,) of each number among those of the linearized problem.
    """

    J: FloatArray
    residual: FloatArray
    row: NDArray[np.int64]
    number: NDArray[np.int64]
    free: list[int]
    kept: BoolArray
    kind_of_number: list[Kind]
    kind: Kind
    scales: dict[Kind, float]
    theta: FloatArray
    noise: list[float]
    place: NDArray[np.int64]

    @property
    def scale(self) -> float:
        """[m or rad] what a whitened 1 of `kind` stands for."""
        return self.scales[self.kind]

    def scale_of(self, kind: Kind) -> float:
        """[m or rad] what a whitened 1 of a kind stands for."""
        return self.scales[kind]

    def of(self, kind: Kind) -> BoolArray:
        """(m,) is the number of this kind?"""
        return np.array([each == kind for each in self.kind_of_number], dtype=bool)[self.number]

    def only(self, kind: Kind) -> Residuals:
        """The numbers of one kind."""
        own = self.of(kind)
        if own.all():
            return self
        parts = {name: getattr(self, name)[own] for name in ("J", "residual", "row", "number", "kept", "place")}
        return replace(self, kind=kind, **parts)


def near_fit(problem: CalibrationProblem, found: _core.Identification) -> Residuals | None:
    """The linearized problem; None where nothing was identified or nothing is left."""
    observations = problem.measured.observations
    sigma = {of_observation(of): float(s) for of, s in zip(reversed(observations), reversed(found.sigma), strict=True)}
    kind = in_order(sigma)[0]
    if not found.free or not sigma[kind] > 0:
        return None
    theta, noise = np.asarray(found.theta), list(found.common_noise)
    near = problem.linearize(theta, noise)
    row = np.asarray(near.row, dtype=np.int64)
    number = np.asarray(near.number, dtype=np.int64)
    kept = ~np.isin(row, found.outliers)
    kinds = [of_observation(of) for of in observations for _ in of.components]
    J, r, place = np.asarray(near.J), np.asarray(near.r), np.arange(len(row))
    return Residuals(J, r, row, number, list(found.free), kept, kinds, kind, sigma, theta, noise, place)
