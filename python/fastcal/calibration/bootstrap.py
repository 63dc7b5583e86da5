# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Bootstrap of a calibration: spread of the parameters when the signs of the residuals are flipped at random.

The wild bootstrap: row i gets x_i* = f_i + v_i k (x_i - f_i), f the fit, v_i = +1 or -1 by chance, k^2 the measured
numbers over the degrees of freedom, since a fit leaves less than the noise; of several kinds of reading each has its k.
Poses, loads and history stay as they are, and so does how precise each row is, whatever its law (C. Wu 1986; R.
Davidson, E. Flachaire 2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.levers import levers
from fastcal.calibration.other_readings import changed
from fastcal.calibration.processes import workers
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kind_of
from fastcal.measurements.rotations import quaternions
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.robot import Robot

_BATCH = 20  # draws that a worker takes at once


@dataclass(frozen=True, eq=False, repr=False)
class Bootstrap:
    """A calibration, and what the same calibration finds in draws of its errors.

    Attributes:
        result: Of the rows as they are.
        values: (B, P) of its parameters in edge units, a draw a row; NaN where a draw did not identify one.
        not_converged: Draws that did not converge; they are not in `values`.
    """

    result: CalibrationResult
    values: FloatArray
    not_converged: int

    @property
    def std(self) -> FloatArray:
        """(P,) standard deviation of each parameter in edge units, beside `std` of `result.parameters`."""
        return np.asarray(np.nanstd(self.values, axis=0, ddof=1))

    def __repr__(self) -> str:
        failed = f", {self.not_converged} more did not converge" if self.not_converged else ""
        return f"<Bootstrap: {len(self.values)} draws of {len(self.result.parameters)} parameters{failed}>"

    def interval(self, level: float = 0.95) -> FloatArray:
        """(P, 2) quantiles of each parameter in edge units that hold this share of the draws."""
        return np.asarray(np.nanquantile(self.values, [(1 - level) / 2, (1 + level) / 2], axis=0).T)


def bootstrap(
    robot: RobotLike,
    data: DataLike,
    *,
    draws: int = 200,
    seed: int = 0,
    block: int = 1,
    jobs: int = 1,
    cluster: str | None = None,
    **options: Any,
) -> Bootstrap:
    """Calibrates, and calibrates draws of the errors that are left.

    Args:
        robot: As for `calibrate`.
        data: Measured rows, of any kind.
        draws: How many; 200 know a standard deviation to 5 %, and limits of 95 % want 1,000.
        seed: The same seed gives the same draws, whatever `jobs` and `cluster` are.
        block: Successive rows that are turned together, where the noise has a memory of so many.
        jobs: Processes.
        cluster: Address of a Dask scheduler in their place.
        **options: effects, loss, priors ... of `calibrate`.

    Raises:
        InvalidInput: Fewer than two draws, a block of no row, a calibration that does not converge, or a cluster that
            can't be reached.
    """
    if draws < 2 or block < 1:
        raise InvalidInput(f"a bootstrap needs at least two draws and blocks of one row, got {draws} and {block}")
    robot = as_robot(robot)
    data = as_data(data, robot)
    result = calibrate(robot, data, **options)
    if result.status != "converged":
        raise InvalidInput(f"{data.source}: there is nothing to draw around, the calibration ended: {result.message}")
    errors = _Errors.of(result, data)
    work = partial(_batch, robot=robot, errors=errors, seed=seed, block=block, options={**options, "checks": False})
    parts = [range(at, min(at + _BATCH, draws)) for at in range(0, draws, _BATCH)]
    with workers(jobs, cluster) as side_by_side:
        found = [values for part in side_by_side.results(work, parts) for values in part]
    kept = [values for values in found if values is not None]
    names = [(p.owner, p.name) for p in result.parameters]
    table = np.array([[values.get(name, np.nan) for name in names] for values in kept]).reshape(len(kept), len(names))
    return Bootstrap(result, table, draws - len(kept))


@dataclass(frozen=True, eq=False)
class _Errors:
    """Rows, what the fit makes of them, and k."""

    data: Dataset
    model: Robot
    T: FloatArray  # (N, 4, 4) predicted
    theta: FloatArray  # (P + U,) of the fit
    r: FloatArray  # (N, numbers) predicted less measured, of the observations
    touch: dict[str, FloatArray]  # (N, n) by kind: change of the joints that takes a touch onto its plane
    k: dict[str, float]  # by kind

    @staticmethod
    def of(result: CalibrationResult, data: Dataset) -> _Errors:
        model = result.model
        measured = measurements(data, model)
        known = {owner: iter(values) for owner, values in result.unknowns.items()}
        unknowns = np.array([float(next(known[p.owner])) for p in measured.parameters])
        core = model.error_model
        theta = np.concatenate([core.start, unknowns])
        r = np.asarray(_core.residuals(core, model.samples(data), measured, theta))
        k = _growth(result, measured, r)
        touch = _onto(measured, r, levers(model.core, data, measured, unknowns))
        return _Errors(data, model, model.poses(data), theta, r, touch, k)

    @cached_property
    def measured(self) -> _core.Measurements:
        """The rows as the core reads them, which no process can send to another."""
        return measurements(self.data, self.model)

    def turned(self, sign: FloatArray) -> Dataset:
        """The rows with errors of these signs (N,)."""
        data, v = self.data, sign[:, np.newaxis]
        along = {kind: k * v for kind, k in self.k.items()}
        q = data.q + sum(((1 - along[kind]) * change for kind, change in self.touch.items()), np.zeros(data.q.shape))
        T, r = self.T, self.r
        if self.touch:
            there = replace(data, q=q)
            T, core = self.model.poses(there), self.model.error_model
            r = np.asarray(_core.residuals(core, self.model.samples(there), self.measured, self.theta))
        p, moved = T[:, :3, 3], T[:, :3, 3] - self.T[:, :3, 3]
        r = r.copy()
        for of in self.measured.observations:
            own = slice(of.first_number, of.first_number + len(of.components))
            r[:, own] -= along[kind_of(of)] * self.r[:, own]
        return replace(
            changed(data, self.measured, r),
            q=q,
            position=None if data.position is None else p + along["position"] * (data.position + moved - p),
            rotation=None if data.rotation is None else self._turned(data.rotation, along["orientation"][:, 0]),
            rotation_angles=None,
        )

    def _turned(self, rotation: FloatArray, along: FloatArray) -> FloatArray:
        out = np.full(rotation.shape, np.nan)
        known = np.flatnonzero(~np.isnan(rotation).any(axis=1))
        turned = np.empty((len(known), 3, 3))
        for place, i in enumerate(known):
            R = self.T[i, :3, :3]
            turned[place] = R @ _core.exp_so3(along[i] * _core.log_so3(R.T @ _core.quaternion_to_rotation(rotation[i])))
        out[known] = quaternions(turned)
        return out


def _growth(result: CalibrationResult, measured: _core.Measurements, r: FloatArray) -> dict[str, float]:
    """K of each kind: what its noise is over what the fit leaves of it, by its own degrees of freedom where several."""
    kinds = [kind_of(of) for of in measured.observations]
    if len(kinds) == 1:
        return {kinds[0]: float(np.sqrt(np.sum(~np.isnan(r)) / max(result.degrees_of_freedom, 1)))}
    kept = np.delete(r, result.outliers, axis=0)
    out = {}
    for kind in dict.fromkeys(kinds):
        own = np.concatenate(
            [
                kept[:, of.first_number : of.first_number + len(of.components)].ravel()
                for of in measured.observations
                if kind_of(of) == kind
            ]
        )
        left = float(np.sqrt(np.nanmean(own**2))) if not np.isnan(own).all() else 0.0
        known = result.noise.get(kind)
        out[kind] = known.value / left if known is not None and left > 0 else 1.0
    return out


def _onto(measured: _core.Measurements, r: FloatArray, by_joint: FloatArray) -> dict[str, FloatArray]:
    """(N, n) by kind, least change of the joints that takes what is not read, such as a height over a plane, to 0.

    Such a number is an error of where the tool was when it touched: a draw of it is another posture.
    """
    out: dict[str, FloatArray] = {}
    for of in measured.observations:
        if of.field:
            continue
        change = out.setdefault(kind_of(of), np.zeros((len(r), by_joint.shape[2])))
        for c in range(of.first_number, of.first_number + len(of.components)):
            slope = by_joint[:, c]
            there = ~np.isnan(r[:, c]) & (np.sum(slope**2, axis=1) > 0)
            change[there] -= (r[there, c] / np.sum(slope[there] ** 2, axis=1))[:, np.newaxis] * slope[there]
    return out


def _batch(
    draws: Sequence[int], *, robot: Robot, errors: _Errors, seed: int, block: int, options: dict[str, Any]
) -> list[dict[tuple[str, str], float] | None]:
    """Values by owner and name of each draw; None where it did not converge."""
    found: list[dict[tuple[str, str], float] | None] = []
    count = len(errors.data)
    for draw in draws:
        blocks = np.random.default_rng([seed, draw]).choice([-1.0, 1.0], -(-count // block))
        result = calibrate(robot, errors.turned(np.repeat(blocks, block)[:count]), **options)
        values = {(p.owner, p.name): p.value for p in result.parameters}
        found.append(values if result.status == "converged" else None)
    return found
