# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is known from poses measured already: each kind of reading counts by its own numbers.

With A the whitened and scaled columns of the parameters that the design identifies, and U those of what these readings
have of their own and no later pose reads, such as where a wire ends,

    M = A^T A - A^T U (U^T U + 1 / KNOWN_TO^2)^-1 U^T A.
"""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.design.instruments import SIGMA_TILT
from fastcal.design.linear import KNOWN_TO, LinearProblem
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POSE
from fastcal.measurements.observations import kind_of, kinds_of, plurals, without_kinds


def information_of(problem: LinearProblem, data: Dataset) -> tuple[FloatArray, list[str]]:
    """(p, p) of the free parameters, scaled, and what is not counted, a sentence each.

    Data of which nothing was measured or touched are a plan, of which every pose counts with all that it will read.
    """
    if not data.measured.any():
        done = problem.planned_rows(data)
        return np.asarray(done.T @ done), []
    data, notes = _countable(problem, data)
    p = len(problem.free)
    if not kinds_of(data):
        return np.zeros((p, p)), notes
    model = problem.model.error_model
    measured = measurements(data, problem.model)
    places = {(u.owner, u.name): k for k, u in enumerate(measured.parameters)}
    theta = np.concatenate([model.start, _own_values(problem, data, places)])
    noise = [0.0 if of.claims_sigma else _sigma(problem, of) for of in measured.observations]
    near = _core.linearize(model, problem.model.samples(data), measured, theta, noise, problem.threads)
    J, own = np.asarray(near.J), len(model.parameters)
    A = np.zeros((len(J), p))
    taken = set()
    for column, (i, size) in enumerate(zip(problem.free, problem.sizes, strict=True)):
        parameter = problem.parameters[i]
        at = i if i < own else own + places.get((parameter.owner, parameter.name), len(places))
        if at < J.shape[1]:
            A[:, column] = J[:, at] * size
            taken.add(at)
    others = [own + k for k in range(len(places)) if own + k not in taken]
    U = J[:, others] * np.array([measured.parameters[k - own].sigma for k in others])
    by_own = A.T @ U
    return np.asarray(A.T @ A - by_own @ np.linalg.solve(U.T @ U + np.eye(len(others)) / KNOWN_TO**2, by_own.T)), notes


def _countable(problem: LinearProblem, data: Dataset) -> tuple[Dataset, list[str]]:
    """Without orientations where the design has none, and without kinds of which too little was measured."""
    notes = []
    if data.rotation is not None and problem.sigma_rotation is None:
        data = without_kinds(data, ["orientation"])
        notes.append("orientations measured already are not counted: the design has no sigma of a measured orientation")
    others = without_kinds(data, POSE)
    if kinds_of(others):
        found = _aligned(problem, others)
        if not found.found:
            notes.append(f"{' and '.join(plurals(others))} measured already are not counted: {found.message}")
            data = without_kinds(data, kinds_of(others))
    return data, notes


def _aligned(problem: LinearProblem, data: Dataset) -> _core.Alignment:
    arm = problem.model
    return _core.align(arm.error_model, arm.samples(data), measurements(data, arm), problem.threads)


def _own_values(problem: LinearProblem, data: Dataset, places: dict[tuple[str, str], int]) -> FloatArray:
    """Anchors, planes and mountings as the nominal arm finds them."""
    values = np.zeros(len(places))
    others = without_kinds(data, POSE)
    if kinds_of(others):
        found = np.asarray(_aligned(problem, others).unknowns)
        for parameter, value in zip(measurements(others, problem.model).parameters, found, strict=True):
            values[places[parameter.owner, parameter.name]] = value
    return values


def _sigma(problem: LinearProblem, of: _core.Observation) -> float:
    """Noise of a number whose rows claim none [m or rad]: the design's own, that of the calibration, a usual one."""
    kind = kind_of(of)
    if kind == "position":
        return problem.sigma
    if kind == "orientation" and problem.sigma_rotation is not None:
        return problem.sigma_rotation
    if kind == "tilt" and problem.readings is not None:
        return problem.readings.sigma_tilt
    known = problem.model.record.sigma(kind) if problem.model.record is not None else None
    return known or (SIGMA_TILT if of.unit == "rad" else problem.sigma)
