# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The design problem as a linear one: rows of derivatives, divided by noise, of the identifiable parameters.

Columns are scaled by plausible sizes. Beforehand each parameter is taken as known to ten plausible sizes, as the gauge
of a calibration takes it: a parameter that data can't determine better than that is held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.problem import asked_parameters, parameter_names
from fastcal.design.candidates import Candidates
from fastcal.effects.entries import Spec, identity
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

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
    """

    model: Robot
    sigma: float
    sigma_rotation: float | None
    free: list[int]
    unidentifiable: list[str]
    threads: int

    @property
    def row_count(self) -> int:
        """Numbers that a posture gives, k."""
        return 3 if self.sigma_rotation is None else 6

    @property
    def names(self) -> list[str]:
        """Of the free parameters."""
        every = parameter_names(self.model.error_model)
        return [every[i] for i in self.free]

    @property
    def sizes(self) -> FloatArray:
        """Plausible sizes of the free parameters, SI."""
        return np.array([self.model.error_model.parameters[i].sigma for i in self.free])

    @property
    def known_before(self) -> FloatArray:
        """Information (p, p) that is there before anything is measured."""
        return np.asarray(np.eye(len(self.free)) / KNOWN_TO**2)

    def places_of(self, causes: list[list[Spec]]) -> list[list[int]]:
        """Indices of the model's parameters that belong to each cause, a list of entries of the robot file."""
        of_entry, at = {}, len(self.model.core.parameters)
        for entry, effect in zip(self.model.spec["effects"], self.model.effects, strict=True):
            of_entry[identity(entry)] = list(range(at, at + len(effect.parameters)))
            at += len(effect.parameters)
        return [[i for entry in cause for i in of_entry[identity(entry)]] for cause in causes]

    def rows(self, candidates: Candidates, columns: list[int] | None = None) -> FloatArray:
        """(N k, p) derivatives of what is measured, whitened and scaled, by the free parameters or by `columns`."""
        return self._rows(candidates, self.free if columns is None else columns, self.row_count)

    def target_information(self, targets: Candidates) -> FloatArray:
        """B (p, p) with tr(C B) the mean variance of a predicted coordinate over targets [m^2], C = M^-1."""
        B = np.zeros((len(self.free), len(self.free)))
        for first in range(0, len(targets), _CHUNK):
            J = self._rows(targets.select(slice(first, first + _CHUNK)), self.free, 3)
            B += J.T @ J
        return np.asarray(B * self.sigma**2 / (3 * len(targets)))

    def _rows(self, candidates: Candidates, columns: list[int], rows: int) -> FloatArray:
        parameters = self.model.error_model.parameters
        scale = np.array([parameters[i].sigma for i in columns])
        noise = np.repeat([self.sigma, self.sigma_rotation or 1.0], 3)[:rows, None]
        out = np.empty((len(candidates), rows, len(columns)))
        for first in range(0, len(candidates), _CHUNK):
            part = candidates.select(slice(first, first + _CHUNK))
            J = self.model.parameter_jacobian(part.q, rows=rows, threads=self.threads, **part.conditions())
            out[first : first + len(part)] = J[:, :, columns] * (scale / noise)
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
) -> LinearProblem:
    """The problem of choosing `count` candidates; the gauge is that of as many average ones."""
    asked = asked_parameters(model.error_model, geometry, turned=sigma_rotation is not None, placed=True)
    whole = LinearProblem(model, sigma, sigma_rotation, asked, [], threads)
    some = _core.draw_design(len(candidates), min(_SAMPLE, len(candidates)), seed)
    R = np.asarray(np.linalg.qr(whole.rows(candidates.select(some)) * np.sqrt(count / len(some)), mode="r"))
    if len(R) < len(asked):
        R = np.vstack([R, np.zeros((len(asked) - len(R), len(asked)))])
    parameters = model.error_model.parameters
    free, directions = _core.free_parameters(R, [parameters[i] for i in asked])
    return LinearProblem(model, sigma, sigma_rotation, [asked[i] for i in free], list(directions), threads)
