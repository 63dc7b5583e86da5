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

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.alignment import measurements
from fastcal.effects.entries import full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import Kind, in_order, kinds_in, of_observation
from fastcal.measurements.observations import expected_columns, kind_of, sigma_column, sigma_field, without_kinds
from fastcal.monitoring.setups import SetUp
from fastcal.robot.calibration_record import CalibrationRecord
from fastcal.robot.robot import Robot

MOTIONS = 6  # of a base
_SAME = 1e-6  # least length, of 1, that other columns leave of one that does something of its own


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
    """The kinds of reading whose noise is known; notes on what is left out."""
    unknown = [
        kind
        for kind in kinds_in(data)
        if record.sigma(kind.name) is None and data.table(sigma_field(kind.name)) is None
    ]
    notes = [
        f"{kind.plural} are not used: neither the model nor a {sigma_column(kind.name)} column gives their standard "
        "deviation"
        for kind in unknown
    ]
    if not data.kinds:
        raise InvalidInput(f"{data.source}: no measured column; expected {expected_columns()}")
    if len(unknown) == len(data.kinds):
        raise InvalidInput(f"{data.source}: {'; '.join(notes)}")
    return without_kinds(data, [kind.name for kind in unknown]), notes


def common_noise(measured: _core.Measurements, data: Dataset, record: CalibrationRecord) -> list[float]:
    """Standard deviation of each observation [m or rad] to add to those that the rows claim.

    The calibration's rows claimed about as much as these, so that its noise is theirs and a part common to all.
    """

    def beyond(total: float, claimed: FloatArray | None) -> float:
        own = 0.0 if claimed is None else float(np.sqrt(np.nanmean(claimed**2)))
        return float(np.sqrt(max(total**2 - own**2, 0.0)))

    kinds = [kind_of(of) for of in measured.observations]
    return [beyond(record.sigma(kind) or 0.0, data.table(sigma_field(kind))) for kind in kinds]


@dataclass(frozen=True, eq=False)
class LinearRows:
    """The problem at the model's parameters.

    Attributes:
        r: (m,) measured less predicted.
        J: (m, P) by the model's parameters, SI; those of the base are 0.
        B: (m, b) by the motions of the S bases and by the observations' unknowns, those that the rows tell apart.
        motions: Which of the first base's six motions the columns of B are: (place in B, motion).
        R: (P, k) root of the parameters' covariance.
        row: (m,) row of the data.
        sigma: (m,) what each number was divided by [m or rad].
        numbers: (m,) the kind of each number and its name among those of a reading.
        readings: Of each kind, those that were read.
        bases: S.
        parameters: (P,) of the model.
        own: The first `own` of them are the arm's geometry, base and tool.
        freedom: Degrees of freedom that the noise is known with.
    """

    r: FloatArray
    J: FloatArray
    B: FloatArray
    motions: list[tuple[int, int]]
    R: FloatArray
    row: IndexArray
    sigma: FloatArray
    numbers: list[tuple[Kind, str]]
    readings: dict[Kind, int]
    bases: int
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

    @cached_property
    def kinds(self) -> list[Kind]:
        """Those that were read, positions first."""
        return in_order({kind for kind, _ in self.numbers})

    @property
    def are_of_bases(self) -> bool:
        """Are the columns of B all six motions of each base, and nothing else?"""
        return len(self.motions) == MOTIONS and self.B.shape[1] == MOTIONS * self.bases

    def of(self, kind: Kind) -> NDArray[np.bool_]:
        """(m,) is the number of this kind?"""
        return np.array([own == kind for own, _ in self.numbers], dtype=bool)

    def noise(self, kind: Kind) -> float:
        """Standard deviation of a number of a kind [m or rad], RMS."""
        return float(np.sqrt(np.mean(self.sigma[self.of(kind)] ** 2)))

    @cached_property
    def expected_rms(self) -> dict[Kind, float]:
        """RMS error of each kind [m or rad] that noise and the model's uncertainty make, the bases fitted."""
        Q = np.linalg.qr(self.B / np.linalg.norm(self.B, axis=0))[0]
        S = self.root - Q @ (Q.T @ self.root)
        square = np.sum(S**2, axis=1) * self.sigma**2
        return {kind: float(np.sqrt(square[self.of(kind)].sum() / self.readings[kind])) for kind in self.kinds}

    def base_motion(self, b: NDArray[np.floating[Any]]) -> FloatArray:
        """(6, ...) of the first base, of b (b, ...); 0 where the rows do not show it."""
        out = np.zeros((MOTIONS, *b.shape[1:]))
        for place, motion in self.motions:
            out[motion] = b[place]
        return out


def linear_rows(places: list[SetUp], record: CalibrationRecord, *, threads: int = 1) -> LinearRows:
    """The rows of all set-ups; each robot has the parameters of the first."""
    first = places[0].robot.error_model
    parameters = list(first.parameters)
    base = np.array([p.owner == "base" for p in first.parameters]) & (
        np.arange(len(parameters)) < len(first.robot.parameters)
    )
    parts, unknown_columns, numbers, readings = [], [], list[tuple[Kind, str]](), dict[Kind, int]()
    for s, place in enumerate(places):
        measured = measurements(place.data, place.robot)
        tau = common_noise(measured, place.data, record)
        model = place.robot.error_model
        theta = np.concatenate([model.start, place.unknowns])
        near = _core.linearize(model, place.robot.samples(place.data), measured, theta, tau, threads)
        number, row = np.asarray(near.number), np.asarray(near.row, dtype=np.intp)
        names = [(of_observation(of), name) for of in measured.observations for name in of.components]
        of_number = [k for k, of in enumerate(measured.observations) for _ in of.components]
        sigma = np.array(
            [np.hypot(measured.sigma(int(i), int(n)), tau[of_number[n]]) for i, n in zip(row, number, strict=True)]
        )
        numbers += [names[n] for n in number]
        for k in range(len(measured.observations)):
            kind = of_observation(measured.observations[k])
            own = row[np.array(of_number)[number] == k]
            readings[kind] = readings.get(kind, 0) + len(np.unique(own))
        J = np.asarray(near.J)
        B = np.zeros((len(J), MOTIONS * len(places)))
        B[:, MOTIONS * s : MOTIONS * (s + 1)] = J[:, : len(parameters)][:, base]
        unknown_columns.append(J[:, len(parameters) :])
        J = np.where(base, 0.0, J[:, : len(parameters)])
        parts.append((-np.asarray(near.r), J, B, place.rows[row], sigma))
    r, J, B, row, sigma = (np.concatenate(each) for each in zip(*parts, strict=True))
    B, motions = _told_apart(B, linalg.block_diag(*unknown_columns))
    R = covariance_root(record, [full_name(p) for p in parameters], base)
    return LinearRows(
        r, J, B, motions, R, row, sigma, numbers, readings, len(places), parameters, len(first.robot.parameters),
        float(record.degrees_of_freedom),
    )  # fmt: skip


def _told_apart(B: FloatArray, U: FloatArray) -> tuple[FloatArray, list[tuple[int, int]]]:
    """Columns of base motions B (m, 6 S) and unknowns U (m, u) of which none does what others do; the first's motions.

    Where a motion of the base does what anchors, planes or mountings do, these are kept: the base stays where it is.
    """
    if not U.size and B.any(axis=0).all():
        return B, [(k, k) for k in range(MOTIONS)]
    every = np.hstack([U, B])
    Q = np.zeros((len(B), 0))
    kept = []
    for i, length in enumerate(np.linalg.norm(every, axis=0)):
        if not length > 0:
            continue
        own = every[:, i] / length
        for _ in range(2):  # once more: what rounding has left of the others
            own = own - Q @ (Q.T @ own)
        if np.linalg.norm(own) > _SAME:
            kept.append(i)
            Q = np.column_stack([Q, own / np.linalg.norm(own)])
    first = U.shape[1]
    order = [i for i in kept if i >= first] + [i for i in kept if i < first]
    motions = [(place, i - first) for place, i in enumerate(order) if first <= i < first + MOTIONS]
    return every[:, order], motions


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
