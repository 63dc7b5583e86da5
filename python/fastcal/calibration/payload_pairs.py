# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Compliances from poses that were measured with several payloads: whatever does not react to load cancels.

The position-distance method of the RX160L paper, equations 12 and 13: in the difference of two points of one posture
under two payloads geometry, gear errors and everything common to both cancel, which leaves the deflection due to the
difference of the loads. Here a posture may have any number of payloads, each row is compared with its posture's
mean, so that no row is used twice, and the answer is the whole model's, at equilibrium:

    sum over rows |e_i - mean e of its posture|^2 -> min over the effects' parameters,  e = p(q, payload, theta) - point
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray, thin_svd
from fastcal.calibration.calibrate import IdentifiedParameter
from fastcal.calibration.critical_loads import Corners, best_corners, open_corners, remaining, starting_values
from fastcal.calibration.problem import CalibrationProblem, prepare
from fastcal.effects.entries import edge_unit, full_name
from fastcal.effects.values import edge_values, written_parameters
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.identified_spec import moved
from fastcal.robot.robot import Robot
from fastcal.units import factor, from_si

SAME_POSTURE = 1e-6  # [rad, m] joint positions that agree to this are one posture
_ALONG = np.linspace(0.01, 0.99, 99)  # quantiles of the loads: where a corner's likelihood is looked at
_SURE = 2.0  # deviations: a corner's reaches half as far as its likelihood is within this many
_UNDETERMINED = 1e-9  # of the largest singular value: a direction that the differences do not determine


@dataclass(frozen=True, eq=False)
class PairsResult:
    """What `from_payload_pairs` found.

    Attributes:
        model: The robot with the identified effects; base and tool are the rigid fit to the data.
        parameters: Identified numbers of the effects in edge units; `covariance` (P, P) is theirs in SI, in that order.
        sigma: Noise of one measured coordinate [m], from what the differences leave.
        posture_count: Postures that were measured with more than one payload.
        row_count: Rows in them.
        before: (rows, 3) differences to the posture's mean that the robot without the effects leaves [m].
        after: The same, with them.
    """

    model: Robot
    parameters: list[IdentifiedParameter]
    covariance: FloatArray
    sigma: float
    posture_count: int
    row_count: int
    before: FloatArray
    after: FloatArray

    @property
    def sigma_mm(self) -> float:
        """`sigma` in mm."""
        return from_si(self.sigma, "mm")


def from_payload_pairs(
    robot: Robot, data: Dataset, *, effects: str | Sequence[str] = "joint_compliance", threads: int = 1
) -> PairsResult:
    """Identifies effects of load from postures that were measured with several payloads.

    Args:
        robot: Nominal or calibrated. Its geometry may be off by what a workshop makes: it enters through levers alone.
        data: Measured points; rows with equal q and different payloads (or wrenches) belong together, others are left
            out.
        effects: Names as on the command line, such as "joint_compliance_nonlinear@joint2:torque=payload".
        threads: Cores to use.

    Raises:
        InvalidInput: No posture has two payloads, no point was measured, geometry is among the effects, or the
            differences do not determine a parameter.
    """
    ready, problem = differences(robot, data, effects, threads)
    own = len(ready.model.robot.parameters)
    theta, covariance, sigma = solve(problem, open_corners(ready.robot, ready.model, ready.samples, threads))

    placed = moved(ready.robot, ready.alignment.T_world_base, ready.alignment.T_flange_tool)
    values = theta[own:]
    parameters, entries = [], []
    nominal = np.array(ready.robot.error_model.start)[own:]
    at = 0
    for entry, effect in zip(placed.entries, ready.robot.effects, strict=True):
        part = slice(at, at + len(effect.parameters))
        at = part.stop
        deviations = np.sqrt(np.diag(covariance[part, part]))
        starts = edge_values(entry, effect, nominal[part])
        for item, start, std, parameter in zip(
            edge_values(entry, effect, values[part]), starts, deviations, effect.parameters, strict=True
        ):
            size = factor(edge_unit(parameter, geometry=False))
            parameters.append(
                IdentifiedParameter(item.name, entry["owner"], item.value, float(std) / size, item.unit, start.value)
            )
        entries.append(entry | {"parameters": written_parameters(entry, effect, values[part], covariance[part, part])})
    without = np.array(ready.model.start)
    without[own:] = 0
    return PairsResult(
        model=placed.with_(effects=entries),
        parameters=parameters,
        covariance=covariance,
        sigma=sigma,
        posture_count=len(np.unique(problem.posture)),
        row_count=len(problem.posture),
        before=problem.residuals(without).reshape(-1, 3),
        after=problem.residuals(theta).reshape(-1, 3),
    )


def differences(
    robot: Robot, data: Dataset, effects: str | Sequence[str], threads: int
) -> tuple[CalibrationProblem, Differences]:
    """The rows whose posture has several payloads; arguments and errors as of `from_payload_pairs`."""
    data, position, posture = rows_in_pairs(data)
    ready = prepare(robot, data, effects=effects, threads=threads)
    own = len(ready.model.robot.parameters)
    if any(i < own and ready.model.parameters[i].owner not in ("base", "tool") for i in ready.asked):
        raise InvalidInput("geometry cancels between payloads; ask for effects of load alone")
    if len(ready.model.parameters) == own:
        raise InvalidInput("there is no effect to identify")
    return ready, Differences(ready.model, ready.samples, position, posture, threads)


def rows_in_pairs(data: Dataset) -> tuple[Dataset, FloatArray, IntArray]:
    """The rows whose posture has several payloads, their points (N, 3) [m] and the number (N,) of their posture.

    Raises:
        InvalidInput: No point was measured, or no posture has two payloads.
    """
    if data.position is None:
        raise InvalidInput(f"{data.source}: payload pairs need measured points x_mm y_mm z_mm")
    load = data.payload[:, None] if data.wrench is None else np.column_stack([data.payload, data.wrench])
    posture = same_posture(data.q, load, ~np.isnan(data.position).any(axis=1))
    position, rows, posture = data.position[posture >= 0], data.select(posture >= 0), posture[posture >= 0]
    if not len(rows):
        raise InvalidInput(f"{data.source}: no posture was measured with two payloads")
    return rows, position, posture


def same_posture(q: FloatArray, load: FloatArray, known: ArrayLike) -> IntArray:
    """(N,) number of each row's posture, counted from 0; -1 for rows that are not known or whose posture has one load.

    Args:
        q: (N, n) joint positions.
        load: (N, k) payload, and wrench where there is one.
        known: (N,) was the point measured?
    """
    rounded = np.round(q / SAME_POSTURE).astype(np.int64)
    _, number = np.unique(rounded, axis=0, return_inverse=True)
    known = np.asarray(known, dtype=bool)
    out = np.full(len(q), -1, dtype=np.int64)
    count = 0
    for posture in np.unique(number[known]):
        rows = np.flatnonzero((number == posture) & known)
        if len(np.unique(load[rows], axis=0)) > 1:
            out[rows] = count
            count += 1
    return out


@dataclass(frozen=True, eq=False)
class Differences:
    """Residuals of all rows, less their posture's mean."""

    model: _core.ErrorModel
    samples: _core.Samples
    position: FloatArray
    posture: IntArray
    threads: int

    def centered(self, rows: FloatArray) -> FloatArray:
        """Rows (N, ...) less the mean of the rows of their posture."""
        count = np.bincount(self.posture)
        mean = np.zeros((len(count), *rows.shape[1:]))
        np.add.at(mean, self.posture, rows)
        shape = (-1,) + (1,) * (rows.ndim - 1)
        return rows - (mean / count.reshape(shape))[self.posture]

    def residuals(self, theta: ArrayLike) -> FloatArray:
        """(3 N,) predicted less measured."""
        T = np.asarray(self.model.predict(self.samples, np.asarray(theta), self.threads))
        return self.centered(T[:, :3, 3] - self.position).ravel()

    def jacobian(self, theta: ArrayLike) -> FloatArray:
        """(3 N, P) by the effects' parameters."""
        J = np.asarray(self.model.parameter_jacobian(self.samples, np.asarray(theta), 3, self.threads))
        own = len(self.model.robot.parameters)
        return self.centered(J[:, :, own:]).reshape(-1, len(self.model.parameters) - own)

    def freedom(self) -> int:
        """Measured numbers less the means of the postures and the parameters."""
        rows, postures = len(self.posture), int(self.posture.max()) + 1
        return 3 * (rows - postures) - (len(self.model.parameters) - len(self.model.robot.parameters))


def solve(problem: Differences, corners: list[Corners]) -> tuple[FloatArray, FloatArray, float]:
    """Parameters (all of the model), covariance of the effects', noise of a coordinate [m]."""
    model = problem.model
    own = len(model.robot.parameters)
    effects = model.parameters[own:]
    if problem.freedom() < 1:
        raise InvalidInput(f"{len(problem.posture)} rows are too few for {len(effects)} parameters")
    scale = np.array([p.sigma for p in effects])
    bounds = np.array([[p.lower for p in effects], [p.upper for p in effects]]) / scale
    theta = starting_values(model, corners)

    def fit(theta: FloatArray, moving: list[int]) -> FloatArray:
        """The best values of the effects' parameters `moving`; in plausible sizes, as everywhere."""

        def whole(x: FloatArray) -> FloatArray:
            there = theta.copy()
            there[[own + k for k in moving]] = x * scale[moving]
            return there

        start = np.clip(theta[[own + k for k in moving]] / scale[moving], *bounds[:, moving])
        found = optimize.least_squares(
            lambda x: problem.residuals(whole(x)),
            start,
            lambda x: problem.jacobian(whole(x))[:, moving] * scale[moving],
            bounds=bounds[:, moving],
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-14,
            gtol=1e-14,
        )
        return whole(found.x)

    if corners:
        bent = {i - own for group in corners for i in group.indices}
        straight = [k for k in range(len(effects)) if k not in bent]
        theta = best_corners(
            corners,
            fit(theta, straight),
            lambda there: remaining(problem.jacobian(there)[:, straight], problem.residuals(there)),
        )
    everything = list(range(len(effects)))
    theta = fit(theta, everything)
    theta = deepest(problem, theta, corners, lambda there: fit(there, everything))
    J = problem.jacobian(theta) * scale
    _, singular, directions = thin_svd(J)
    if singular[-1] <= _UNDETERMINED * singular[0]:
        parameter = effects[int(np.argmax(np.abs(directions[-1])))]
        raise InvalidInput(f"the payloads do not determine {full_name(parameter)}: leave its effect out")
    r = problem.residuals(theta)
    sigma = float(np.sqrt(r @ r / problem.freedom()))
    root = (directions.T / singular) * scale[:, None] * sigma
    root *= widening(problem, theta, corners, np.linalg.norm(root, axis=1), sigma)[:, None]
    return theta, root @ root.T, sigma


def deepest(
    problem: Differences, theta: FloatArray, corners: list[Corners], fit: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """The fit, or the one that begins in a valley of a corner's profile that is deeper."""
    for group in corners:
        for index in group.indices:
            at, rise = profile(problem, theta, index, group.loads)
            if rise.min() < 0:
                there = theta.copy()
                there[index] = at[np.argmin(rise)]
                theta = min((theta, fit(there)), key=lambda t: float(np.sum(problem.residuals(t) ** 2)))
    return theta


def widening(
    problem: Differences, theta: FloatArray, corners: list[Corners], deviation: FloatArray, sigma: float
) -> FloatArray:
    """(P,) by how much the linear deviations (P,) of the effects' parameters are too small, for corners: 1 or more."""
    own = len(problem.model.robot.parameters)
    out = np.ones(len(deviation))
    for group in corners:
        for index in group.indices:
            at, rise = profile(problem, theta, index, group.loads)
            reach = np.max(np.abs(at - theta[index])[rise <= (_SURE * sigma) ** 2], initial=0.0)
            out[index - own] = max(1.0, float(reach) / _SURE / deviation[index - own])
    return out


def profile(problem: Differences, theta: FloatArray, index: int, loads: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rise of the sum of squares [m^2] with a corner elsewhere, all else fitted anew: places (K,) [N m], rises (K,).

    This curve, not its curvature at the bottom, says how far off a corner may be: rows change piece as it moves, and a
    weak one has more than one valley.
    """
    own = len(problem.model.robot.parameters)
    others = [k for k in range(len(theta) - own) if k != index - own]
    least = float(np.sum(problem.residuals(theta) ** 2))
    at = np.unique(np.quantile(loads, _ALONG))
    rises = []
    for place in at:
        there = theta.copy()
        there[index] = place
        rises.append(remaining(problem.jacobian(there)[:, others], problem.residuals(there)) - least)
    return at, np.array(rises)
