# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What whitens measured numbers beyond their standard deviations: the joints of a posture, and the rows before."""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.alignment import measurements, noise_by_observation
from fastcal.calibration.joint_noise import JointNoise
from fastcal.calibration.levers import levers
from fastcal.diagnosis.memory import without_memory
from fastcal.diagnosis.problem import Levers, Problem
from fastcal.measurements.observations import kind_of, sigma_field


def decorrelated(problem: Problem, values: FloatArray, row: IndexArray) -> FloatArray:
    """Numbers (m, ...) of measured rows without what they share; the same where the noise is white."""
    return without_memory(problem, without_joint_noise(problem, values, row), row)


def without_joint_noise(problem: Problem, values: FloatArray, row: IndexArray) -> FloatArray:
    """Numbers (m, ...) of measured rows, whitened for joints that repeat badly (`joint_noise`)."""
    k = problem.noise.repeatability
    return values if k == 0 else joint_noise(problem, row).whitened(values, k)


def joint_noise(problem: Problem, row: IndexArray) -> JointNoise:
    """Of the numbers of measured rows `row` (m,), all numbers of each row among them."""
    known = problem.joint_noises
    key = row.tobytes()
    if key not in known:
        lever = whitened_lever(problem)[problem.rows]
        number = np.arange(len(row)) - np.searchsorted(row, row)  # of those that its row has
        at = np.cumsum(~np.isnan(lever[..., 0]), axis=1)  # counts them
        place = np.argmax(at[row] > number[:, np.newaxis], axis=1)
        posture = problem.stays[problem.rows][row] if problem.noise.by_stay else row
        known[key] = JointNoise.of(lever[row, place], posture)
    return known[key]


def points_without_joint_noise(problem: Problem, away: FloatArray) -> FloatArray:
    """(N, 3) what points of all rows are away by, each row whitened on its own, in the unit it had."""
    of, lever = _levers(problem), whitened_lever(problem)
    first = next(_numbers(one) for one in of.measured.observations if one.field == "position")
    lever, moved = lever[:, first], of.moved[:, first]
    whole = np.flatnonzero(~np.isnan(lever).any(axis=(1, 2)))
    own = lever[whole].reshape(-1, lever.shape[2])
    sigma = np.linalg.norm(moved[whole], axis=2) / np.linalg.norm(lever[whole], axis=2)
    noise = JointNoise.of(own, np.repeat(np.arange(len(whole)), 3))
    out = away.copy()
    out[whole] = sigma * noise.whitened((away[whole] / sigma).ravel(), problem.noise.repeatability).reshape(-1, 3)
    return out


def whitened_lever(problem: Problem) -> FloatArray:
    """(N, numbers, n) by what each joint moves the numbers of all rows, over their deviations but for `factor`."""
    of, data, noise = _levers(problem), problem.data, problem.noise
    common = noise_by_observation(of.measured, noise.common)
    sigma = np.empty(of.moved.shape[:2])
    for observation, size in zip(of.measured.observations, common, strict=True):
        kind = kind_of(observation)
        claims = data.table(sigma_field(kind))
        own = 0.0 if claims is None else np.nan_to_num(claims.reshape(len(data), -1))
        sigma[:, _numbers(observation)] = np.hypot(own, size) * noise.scale.get(kind, 1.0)
    return np.asarray(of.moved / sigma[:, :, np.newaxis])


def joint_share(problem: Problem) -> float:
    """What joints that repeat badly add to a number of the first kind, RMS over all rows [m or rad]."""
    noise = problem.noise
    if noise.repeatability == 0:
        return 0.0
    of = _levers(problem)
    first = next((one for one in of.measured.observations if one.unit == "m"), of.measured.observations[0])
    square = np.sum(of.moved[:, _numbers(first)] ** 2, axis=2)
    return noise.factor * noise.repeatability * float(np.sqrt(np.nanmean(square)))


def _levers(problem: Problem) -> Levers:
    data, known = problem.data, problem.levers
    if id(data) not in known:
        start, measured = problem.start, measurements(data, problem.start.robot)
        moved = levers(start.model.robot, data, measured, problem.unknowns, problem.threads)
        known[id(data)] = Levers(data, measured, moved)
    return known[id(data)]


def _numbers(of: _core.Observation) -> slice:
    """Places of an observation's numbers among those of a row."""
    return slice(of.first_number, of.first_number + len(of.components))
