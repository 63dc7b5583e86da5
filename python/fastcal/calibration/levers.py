# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Derivative of every measured number by every joint position, by differences of its observation."""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.calibration.problem import CalibrationProblem
from fastcal.measurements.dataset import Dataset

_STEP = 1e-6  # [rad, m] of a joint


def levers(
    core: _core.RobotModel, data: Dataset, measured: _core.Measurements, unknowns: FloatArray, threads: int = 1
) -> FloatArray:
    """(N, numbers, n) change of every number by each joint, of the rigid arm; NaN where nothing was measured."""
    rigid = _core.ErrorModel(core, [], np.zeros(0))
    theta = np.concatenate([rigid.start, unknowns])

    def read(q: FloatArray) -> FloatArray:
        return np.asarray(_core.residuals(rigid, _core.Samples(np.ascontiguousarray(q)), measured, theta, threads))

    here = read(data.q)
    out = np.empty((*here.shape, data.q.shape[1]))
    for joint, step in enumerate(np.eye(data.q.shape[1]) * _STEP):
        out[:, :, joint] = (read(data.q + step) - here) / _STEP
    return out


def whitened_levers(
    problem: CalibrationProblem, found: _core.Identification, row: IntArray, number: IntArray
) -> FloatArray:
    """(m, n) of the numbers `number` (m,) in rows `row` (m,), each over its standard deviation in a fit."""
    unknowns = np.asarray(found.theta)[len(problem.model.start) :]
    moved = levers(problem.model.robot, problem.data, problem.measured, unknowns, problem.threads)[row, number]
    return np.asarray(moved / number_sigma(problem.measured, found.common_noise, row, number)[:, np.newaxis])


def number_sigma(measured: _core.Measurements, common: list[float], row: IntArray, number: IntArray) -> FloatArray:
    """(m,) standard deviation of each number: its own claim and the noise common to its observation."""
    of_number = np.array([k for k, of in enumerate(measured.observations) for _ in of.components])
    claimed = np.array([measured.sigma(int(i), int(c)) for i, c in zip(row, number, strict=True)])
    return np.asarray(np.hypot(claimed, np.asarray(common)[of_number[number]]))
