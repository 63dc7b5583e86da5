# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The design problem as a linear one: rows of derivatives, divided by noise, of the identifiable parameters.

Columns are scaled by plausible sizes. Beforehand each parameter is taken as known to ten plausible sizes, as the gauge
of a calibration takes it: a parameter that data can't determine better than that is held.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.problem import asked_parameters
from fastcal.design.candidates import Candidates
from fastcal.design.instruments import Instruments
from fastcal.design.readings import Readings
from fastcal.effects.entries import Spec, full_name, identity
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

KNOWN_TO = 10.0  # plausible sizes, GaugeOptions::practical_limit of the core
_CHUNK = 8192  # candidates whose full Jacobian is in memory at a time
_SAMPLE = 2000  # candidates by which the gauge is chosen


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """The information of a measured posture on a model's parameters.

    Attributes:
        model: The robot with the effects to identify.
        sigma: Standard deviation of a measured coordinate [m].
        sigma_rotation: Of the orientation about each axis [rad]; None: positions alone are measured.
        free: Indices of the model's parameters that are identified.
        unidentifiable: What all candidates together can't determine, in words.
        threads: Cores to use.
        points: Whether points (and orientations) are measured, except in touches.
        readings: Levels and touches; None: there are none.
    """

    model: Robot
    sigma: float
    sigma_rotation: float | None
    free: list[int]
    unidentifiable: list[str]
    threads: int
    points: bool = True
    readings: Readings | None = None

    @property
    def point_rows(self) -> int:
        """Numbers of a posture that are of its point and orientation."""
        return 0 if not self.points else 3 if self.sigma_rotation is None else 6

    @property
    def row_count(self) -> int:
        """Numbers that a posture gives, k."""
        return self.point_rows + (0 if self.readings is None else self.readings.count)

    @property
    def parameters(self) -> list[_core.Parameter]:
        """Those of the model, then the unknowns of the instruments."""
        return [*self.model.error_model.parameters, *([] if self.readings is None else self.readings.parameters)]

    @property
    def names(self) -> list[str]:
        """Of the free parameters."""
        every = [full_name(parameter) for parameter in self.parameters]
        return [every[i] for i in self.free]

    @property
    def sizes(self) -> FloatArray:
        """Plausible sizes of the free parameters, SI."""
        parameters = self.parameters
        return np.array([parameters[i].sigma for i in self.free])

    @property
    def known_before(self) -> FloatArray:
        """Information (p, p) that is there before anything is measured."""
        return np.asarray(np.eye(len(self.free)) / KNOWN_TO**2)

    def places_of(self, causes: list[list[Spec]]) -> list[list[int]]:
        """Indices of the model's parameters that belong to each cause, a list of entries of the robot file."""
        of_entry, at = {}, len(self.model.core.parameters)
        for entry, effect in zip(self.model.entries, self.model.effects, strict=True):
            of_entry[identity(entry)] = list(range(at, at + len(effect.parameters)))
            at += len(effect.parameters)
        return [[i for entry in cause for i in of_entry[identity(entry)]] for cause in causes]

    def rows(self, candidates: Candidates, columns: list[int] | None = None) -> FloatArray:
        """(N k, p) derivatives of what is measured, whitened and scaled, by the free parameters or by `columns`."""
        wanted = self.free if columns is None else columns
        if self.readings is None:
            return self._points(candidates, wanted, self.point_rows)
        scale = np.array([parameter.sigma for parameter in self.parameters])[wanted]
        k = self.point_rows
        out = np.zeros((len(candidates), self.row_count, len(wanted)))
        for first in range(0, len(candidates), _CHUNK):
            part = candidates.select(slice(first, first + _CHUNK))
            own = out[first : first + len(part)]
            own[:, k:] = self.readings.rows(part)[:, :, wanted] * scale
            if k:
                own[:, :k] = self._points(part, wanted, k).reshape(len(part), k, -1)
                own[part.touching, :k] = 0.0  # a touch is no measured point
        return out.reshape(-1, len(wanted))

    def planned_rows(self, data: Dataset) -> FloatArray:
        """(N k, p) the same of a plan, whose touches are named in its column `plane`."""
        if self.readings is None:
            return self.rows(Candidates(data.q, data.payload, data.approach))
        codes, names = data.label_codes("plane")
        plane = np.full(len(data), "", dtype=object)
        for label in self.readings.planes:
            if label in names:
                plane[codes == names.index(label)] = label
        return self.rows(Candidates(data.q, data.payload, data.approach, plane))

    def target_information(self, targets: Candidates) -> FloatArray:
        """B (p, p) with tr(C B) the mean variance of a predicted coordinate over targets [m^2], C = M^-1."""
        B = np.zeros((len(self.free), len(self.free)))
        for first in range(0, len(targets), _CHUNK):
            J = self._points(targets.select(slice(first, first + _CHUNK)), self.free, 3)
            B += J.T @ J
        return np.asarray(B * self.sigma**2 / (3 * len(targets)))

    def _points(self, candidates: Candidates, columns: list[int], rows: int) -> FloatArray:
        """(N rows, len(columns)) of points, and of orientations where `rows` is 6; 0 by what only readings have."""
        parameters = self.parameters
        own = len(self.model.error_model.parameters)
        known = np.array([i < own for i in columns], dtype=bool)
        scale = np.array([parameters[i].sigma for i in columns]) * known
        at = np.where(known, columns, 0)
        noise = np.repeat([self.sigma, self.sigma_rotation or 1.0], 3)[:rows, None]
        out = np.empty((len(candidates), rows, len(columns)))
        for first in range(0, len(candidates), _CHUNK):
            part = candidates.select(slice(first, first + _CHUNK))
            J = self.model.parameter_jacobian(part.q, rows=rows, threads=self.threads, **part.conditions())
            out[first : first + len(part)] = J[:, :, at] * (scale / noise)
        return out.reshape(-1, len(columns))


def linear_problem(
    model: Robot,
    candidates: Candidates,
    count: int,
    *,
    geometry: bool,
    sigma: float,
    sigma_rotation: float | None,
    seed: int,
    threads: int,
    instruments: Instruments,
) -> LinearProblem:
    """The problem of choosing `count` candidates; the gauge is that of as many average ones."""
    asked = asked_parameters(model.error_model, geometry, turned=sigma_rotation is not None, placed=True)
    readings = None if instruments.only_points else Readings(model, instruments, sigma, threads)
    whole = LinearProblem(model, sigma, sigma_rotation, asked, [], threads, instruments.points, readings)
    own = len(model.error_model.parameters)
    asked = [*asked, *range(own, len(whole.parameters))]
    whole = replace(whole, free=asked)
    some = _core.draw_design(len(candidates), min(_SAMPLE, len(candidates)), seed)
    R = np.asarray(np.linalg.qr(whole.rows(candidates.select(some)) * np.sqrt(count / len(some)), mode="r"))
    if len(R) < len(asked):
        R = np.vstack([R, np.zeros((len(asked) - len(R), len(asked)))])
    free, directions = _core.free_parameters(R, [whole.parameters[i] for i in asked])
    return replace(whole, free=[asked[i] for i in free], unidentifiable=list(directions))
