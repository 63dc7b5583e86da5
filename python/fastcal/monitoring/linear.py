# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""New measurements of a calibrated arm as a linear problem, with what the model's own calibration knows as the prior.

    r = B b + J (R z + k) + e,    e ~ N(0, 1),  z ~ N(0, 1)

r (m,) measured less predicted, each number divided by its standard deviation; b the motions of the bases, of which
nothing is known; R R^T the covariance that the model keeps of its parameters (its base left out, what was held by the
gauge with its plausible size); k the change since. Without a change r is N(B b, V), V = 1 + J R (J R)^T: the noise of
the new rows and what the old ones left open, so old and new noise are each counted once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal import _core
from fastcal.calibration.alignment import measurements, noise_by_observation
from fastcal.effects.entries import full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.setups import SetUp
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.robot import Robot
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

MOTIONS = 6  # of a base


def record_of(model: Robot) -> CalibrationRecord:
    """What the model keeps of its calibration; InvalidInput where it keeps nothing."""
    record = model.record
    if record is None or not record.parameters:
        raise InvalidInput(
            f"{model.name} keeps no covariance of its parameters; expected a model.yaml of `fastcal calibrate`, got a "
            "nominal robot"
        )
    return record


def as_known(data: Dataset, record: CalibrationRecord) -> tuple[Dataset, list[str]]:
    """The points, and the orientations where their noise is known; notes on what is left out."""
    notes = []
    if data.rotation is not None and record.sigma_deg is None and data.sigma_rotation is None:
        notes.append(
            "orientations are not used: neither the model nor a sigma_rot_deg column gives their standard deviation"
        )
        data = replace(data, rotation=None, rotation_angles=None)
    if data.distance is not None or data.observed or data.observed_labels:
        notes.append("only points and orientations are used")
    return replace(data, distance=None, anchor=None, anchor_names=(), observed={}, observed_labels={}), notes


def noise(data: Dataset, record: CalibrationRecord) -> tuple[float, float, float]:
    """Standard deviations (positions [m], turns [rad], other lengths [m]) to add to those that the rows claim.

    The calibration's rows claimed about as much as these, so that its noise is theirs and a part common to all.
    """

    def beyond(total: float, claimed: FloatArray | None) -> float:
        own = 0.0 if claimed is None else float(np.sqrt(np.nanmean(claimed**2)))
        return float(np.sqrt(max(total**2 - own**2, 0.0)))

    point = beyond(to_si(record.sigma_mm or 0.0, "mm"), data.sigma_position)
    turn = 0.0 if record.sigma_deg is None else beyond(to_si(record.sigma_deg, "deg"), data.sigma_rotation)
    return point, turn, point


@dataclass(frozen=True, eq=False)
class LinearRows:
    """The problem at the model's parameters.

    Attributes:
        r: (m,) measured less predicted.
        J: (m, P) by the model's parameters, SI; those of the base are 0.
        B: (m, 6 S) by the motions of the S bases.
        R: (P, k) root of the parameters' covariance.
        row: (m,) row of the data.
        sigma: (m,) what each number was divided by [m or rad].
        is_point: (m,) is it a coordinate of a point?
        parameters: (P,) of the model.
        own: The first `own` of them are the arm's geometry, base and tool.
        freedom: Degrees of freedom that the noise is known with.
    """

    r: FloatArray
    J: FloatArray
    B: FloatArray
    R: FloatArray
    row: IntArray
    sigma: FloatArray
    is_point: NDArray[np.bool_]
    parameters: list[_core.Parameter]
    own: int
    freedom: float

    @cached_property
    def root(self) -> FloatArray:
        """(m, m) lower triangular L, V = L L^T.

        Raises:
            InvalidInput: The model's covariance is too large for doubles to hold the noise beside it.
        """
        M = self.J @ self.R
        try:
            return np.asarray(linalg.cholesky(np.eye(len(M)) + M @ M.T, lower=True))
        except (np.linalg.LinAlgError, ValueError):
            largest = float(np.abs(self.R).max())
            raise InvalidInput(
                f"the model's calibration block is damaged: it has standard deviations of up to {largest:.1g} (SI), "
                "with which nothing can be predicted"
            ) from None

    def whitened(self, columns: FloatArray) -> FloatArray:
        """L^-1 columns."""
        return np.asarray(linalg.solve_triangular(self.root, columns, lower=True))

    @property
    def expected_rms(self) -> float:
        """[m] RMS distance of the points that noise and the model's uncertainty make, the bases fitted."""
        Q = np.linalg.qr(self.B / np.linalg.norm(self.B, axis=0))[0]
        S = self.root - Q @ (Q.T @ self.root)
        square = np.sum(S**2, axis=1) * self.sigma**2
        rows = len(np.unique(self.row[self.is_point]))
        return float(np.sqrt(square[self.is_point].sum() / rows))


def linear_rows(places: list[SetUp], record: CalibrationRecord, *, threads: int = 1) -> LinearRows:
    """The rows of all set-ups; each robot has the parameters of the first."""
    first = places[0].robot.error_model
    parameters = list(first.parameters)
    base = np.array([p.owner == "base" for p in first.parameters]) & (
        np.arange(len(parameters)) < len(first.robot.parameters)
    )
    parts = []
    for s, place in enumerate(places):
        measured = measurements(place.data, place.robot)
        tau = noise_by_observation(measured, noise(place.data, record))
        model = place.robot.error_model
        near = _core.linearize(model, place.robot.samples(place.data), measured, model.start, tau, threads)
        number, row = np.asarray(near.number), np.asarray(near.row, dtype=np.intp)
        sigma = np.array(
            [
                np.hypot(measured.sigma(int(i), int(n)), tau[_observation(measured, int(n))])
                for i, n in zip(row, number, strict=True)
            ]
        )
        point = np.array([measured.observations[_observation(measured, int(n))].field == "position" for n in number])
        J = np.asarray(near.J)
        B = np.zeros((len(J), MOTIONS * len(places)))
        B[:, MOTIONS * s : MOTIONS * (s + 1)] = J[:, base]
        J = np.where(base, 0.0, J[:, : len(parameters)])
        parts.append((-np.asarray(near.r), J, B, place.rows[row], sigma, point))
    r, J, B, row, sigma, point = (np.concatenate(each) for each in zip(*parts, strict=True))
    names = [full_name(p) for p in parameters]
    R = covariance_root(record, names, base)
    return LinearRows(
        r, J, B, R, row, sigma, point, parameters, len(first.robot.parameters), float(record.degrees_of_freedom)
    )


def covariance_root(record: CalibrationRecord, names: list[str], base: NDArray[np.bool_]) -> FloatArray:
    """(P, k) R of the model's parameters `names`; rows of the base are 0, as its new place is not the old one."""
    at = {name: i for i, name in enumerate(names) if not base[i]}
    known, held = record.root, record.directions
    R = np.zeros((len(names), known.shape[1] + held.shape[1]))
    for k, name in enumerate(record.parameters):
        if name in at:
            R[at[name], : known.shape[1]] = known[k]
    for k, name in enumerate(record.moved):
        if name in at:
            R[at[name], known.shape[1] :] = held[k]
    return R


def _observation(measured: _core.Measurements, number: int) -> int:
    """The observation that a number of a row belongs to."""
    return next(
        k
        for k, of in enumerate(measured.observations)
        if of.first_number <= number < of.first_number + len(of.components)
    )
