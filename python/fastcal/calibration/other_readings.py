# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Simulated readings of instruments other than a tracker: levels, wires, touched planes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kinds_of
from fastcal.robot.robot import Robot

_STEP = 1e-6  # [rad, m] of a joint in a difference
_ROUNDS = 20
_ON = 1e-12  # [m] as exact as a touch is made


def other_readings(
    robot: Robot, data: Dataset, unknowns: Mapping[str, ArrayLike], random: np.random.Generator, threads: int = 1
) -> Dataset:
    """The data without points and orientations, all other numbers as read in the postures q.

    A number is what the model predicts, with a normal error of the data's own sigma.

    Raises:
        InvalidInput: `unknowns` of something that is not observed, or not as many numbers as it has.
    """
    bare = replace(data, position=None, rotation=None)
    if not kinds_of(bare):
        return bare
    measured = measurements(bare, robot)
    values = _values(measured, unknowns)
    for _ in range(_ROUNDS):  # a residual is the change of its number to first order
        r = np.nan_to_num(_residuals(robot, bare, measured, values, threads))
        bare = changed(bare, measured, r)
        measured = measurements(bare, robot)
        if np.abs(r).max() < _ON:
            break
    sigma = np.array([[measured.sigma(i, c) for c in range(r.shape[1])] for i in range(len(bare))])
    return changed(bare, measured, sigma * random.standard_normal(r.shape))


def changed(data: Dataset, measured: _core.Measurements, change: FloatArray) -> Dataset:
    """The data with `change` (N, numbers) added to what was read; what is not read, such as a touch, stays."""
    observed, distance = dict(data.observed), data.distance
    for of in measured.observations:
        part = change[:, of.first_number : of.first_number + len(of.components)]
        if of.field in observed:
            observed[of.field] = observed[of.field] + part
        elif of.field == "distance" and distance is not None:
            distance = distance + part[:, 0]
    return replace(data, observed=observed, distance=distance)


def touching(robot: Robot, data: Dataset, unknowns: Mapping[str, ArrayLike], threads: int = 1) -> Dataset:
    """The data with postures moved, as little as may be, to where the tool touches what its labels name.

    Raises:
        InvalidInput: A plane cannot be reached from a posture.
    """
    if not data.observed_labels:
        return data
    bare = replace(data, position=None, rotation=None, distance=None, observed={})
    if not kinds_of(bare):
        return data
    measured = measurements(bare, robot)
    values = _values(measured, unknowns)
    q = bare.q.copy()
    for _ in range(_ROUNDS):
        r = _residuals(robot, replace(bare, q=q), measured, values, threads)[:, 0]
        off = np.abs(np.nan_to_num(r)) > _ON
        if not off.any():
            return replace(data, q=q)
        slope = np.empty_like(q)
        for j in range(q.shape[1]):
            there = q.copy()
            there[:, j] += _STEP
            slope[:, j] = (_residuals(robot, replace(bare, q=there), measured, values, threads)[:, 0] - r) / _STEP
        steepness = np.sum(slope**2, axis=1)
        q[off] -= (r / np.where(steepness > 0, steepness, 1.0))[off, np.newaxis] * slope[off]
    row = int(np.argmax(off))
    raise InvalidInput(f"row {row} of {data.source} cannot touch its plane; choose a posture nearer to it")


def _residuals(
    robot: Robot, data: Dataset, measured: _core.Measurements, values: FloatArray, threads: int
) -> FloatArray:
    theta = np.concatenate([robot.error_model.start, values])
    return np.asarray(_core.residuals(robot.error_model, robot.samples(data), measured, theta, threads))


def _values(measured: _core.Measurements, unknowns: Mapping[str, ArrayLike]) -> FloatArray:
    """The unknowns in the order of the measurements; 0 where they are not given."""
    owners = [p.owner for p in measured.parameters]
    values = np.zeros(len(owners))
    for owner, given in unknowns.items():
        own = [k for k, name in enumerate(owners) if name == owner]
        numbers = np.atleast_1d(np.asarray(given, dtype=np.float64))
        if own and numbers.shape != (len(own),):
            raise InvalidInput(f"'{owner}' has {len(own)} unknowns, got shape {numbers.shape}")
        values[own] = numbers if own else 0.0
    return values
