# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Options of effects that are estimated before the fit: the row of a step, a thermal lag, a profile's curvature.

All are found near a fit of everything else, which is linearized there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.change_point import find_step
from fastcal.calibration.geometry_anchoring import pull_deviations
from fastcal.calibration.heat_lag import find_lag
from fastcal.calibration.parameter_limits import has_prior
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.smoothing import LinearProblem, choose_curvatures
from fastcal.effects.entries import label, options_of, position_option, traits_of
from fastcal.errors import InvalidInput
from fastcal.place import source_of
from fastcal.robot.plain_copy import plain_copy
from fastcal.robot.robot import Robot, Spec
from fastcal.units import from_si

_MOMENT, _MOMENT_BY_ROW = "at_s", "at_row"
_POSITION, _POSITION_OF_SLIDER = "at_deg", "at_mm"
_FEWEST = 5  # positions of the joint that decides on either side: fewer fit anything
_LAG = "lag_s"
_WEAK = 30.0  # plausible sizes: a prior that only keeps a singular problem solvable


@dataclass(frozen=True, eq=False)
class _Fit:
    """The problem near a fit of all parameters that are not open."""

    problem: CalibrationProblem
    theta: FloatArray
    noise: Sequence[float]

    def near(self, robot: Robot) -> _core.Linearization:
        """Whitened residuals and Jacobian of the same parameters in a robot whose open effects are set."""
        return self.problem.with_(robot=robot).linearize(self.theta, self.noise)


def fill_unset_options(problem: CalibrationProblem) -> CalibrationProblem:
    """The problem with the options that its robot leaves open: `at_s`, `at_deg`, `lag_s`, `curvature`."""
    robot, places = problem.robot, problem.effect_places
    entries = robot.entries
    steps = [
        k
        for k, e in enumerate(entries)
        if _MOMENT in traits_of(e["effect"]).among_parameters and not {_MOMENT, _MOMENT_BY_ROW} & set(options_of(e))
    ]
    jumps = [
        k
        for k, e in enumerate(entries)
        if _POSITION in traits_of(e["effect"]).among_parameters
        and not {_POSITION, _POSITION_OF_SLIDER} & set(options_of(e))
    ]
    curves = [
        k
        for k, (e, effect) in enumerate(zip(entries, robot.effects, strict=True))
        if effect.penalty and "curvature" not in e and not (traits_of(e["effect"]).role != "curve" and has_prior(e))
    ]
    late = [
        k
        for k, e in enumerate(entries)
        if _LAG in traits_of(e["effect"]).among_parameters and _LAG not in options_of(e)
    ]
    time = problem.data.time
    late = late if time is not None and np.ptp(time) > 0 else []
    if not steps and not jumps and not curves and not late:
        return problem
    for k in curves:
        if "prior" in entries[k]:
            raise InvalidInput(f"{label(entries[k])} takes its prior from its curvature, and prior was given")
    still = {i for k in steps + jumps + curves + late for i in places[k]}
    moving = [i for i in problem.asked if i not in still]
    found = problem.with_(asked=moving).identify()
    fit = _Fit(problem, np.asarray(found.theta), found.common_noise)
    moving += range(len(problem.model.parameters), len(fit.theta))
    entries = plain_copy(entries)
    for k in steps:
        entries[k] |= _moment(fit, entries, k, places[k], moving)
    for k in jumps:
        entries[k] |= _position(fit, entries, k, places[k], moving)
    if late and (lag := find_lag(lambda lag: _left_with_lag(fit, entries, late, moving, lag), time)):
        for k in late:
            entries[k]["parameters"] = {**(entries[k].get("parameters") or {}), _LAG: lag}
    if curves:
        _set_curvatures(fit, entries, curves, moving + [i for k in steps + jumps + late for i in places[k]])
    return problem.with_(robot=robot.with_(effects=entries))


def _moment(fit: _Fit, entries: list[Spec], k: int, own: range, others: list[int]) -> Spec:
    """When the step was: {value, std}, evenly likely between two rows; by their order where they have no time."""
    data, before_all = fit.problem.data, plain_copy(entries)
    by_row = data.time is None
    before_all[k][_MOMENT] = -np.inf
    near = fit.near(fit.problem.robot.with_(effects=before_all))
    J, row = np.asarray(near.J), np.asarray(near.row, dtype=np.int64)
    order = np.arange(len(data)) if data.row is None else data.row
    course = order.astype(float) if data.time is None else data.time
    at, gap = find_step(J[:, others], J[:, own], np.asarray(near.r), row, course)
    if by_row:
        return {"rows": len(data), "parameters": {_MOMENT_BY_ROW: {"value": float(np.ceil(at)), "std": 0.0}}}
    return {"parameters": {_MOMENT: {"value": at, "std": gap / 12**0.5}}}


def _position(fit: _Fit, entries: list[Spec], k: int, own: range, others: list[int]) -> Spec:
    """Where the joint that decides stands as another one jumps: {value, std}, evenly likely between two rows."""
    robot, joint = fit.problem.robot, source_of(entries[k]["owner"]).index
    option, unit = position_option(robot.joint_types[joint])
    beyond_all = plain_copy(entries)
    beyond_all[k][option] = -np.inf
    near = fit.near(robot.with_(effects=beyond_all))
    J, row = np.asarray(near.J), np.asarray(near.row, dtype=np.int64)
    jump = J[:, own]  # half of it stays on either side, which a step takes up with a shift of all rows
    q = fit.problem.data.q[:, joint]
    at, gap = find_step(np.hstack([J[:, others], jump]), jump, np.asarray(near.r), row, q, _FEWEST)
    return {"parameters": {option: {"value": from_si(at, unit), "std": from_si(gap / 12**0.5, unit)}}}


def _left_with_lag(fit: _Fit, entries: list[Spec], late: list[int], others: list[int], lag: float) -> float:
    """Whitened sum of squares that the thermal effects leave with a lag [s]."""
    trial = plain_copy(entries)
    for k in late:
        trial[k][_LAG] = lag
    near = fit.near(fit.problem.robot.with_(effects=trial))
    columns = [*others, *(i for k in late for i in fit.problem.effect_places[k])]
    sizes = np.array([p.sigma for p in fit.problem.model.parameters] + [1.0] * fit.problem.unknown_count)
    A = np.vstack([np.asarray(near.J)[:, columns] * sizes[columns], np.eye(len(columns)) / _WEAK])
    r = np.append(np.asarray(near.r), np.zeros(len(columns)))
    from scipy import linalg  # takes longer to import than a fit

    return float(np.sum((r - A @ linalg.lstsq(A, r, lapack_driver="gelsy", check_finite=False)[0]) ** 2))


def _set_curvatures(fit: _Fit, entries: list[Spec], curves: list[int], others: list[int]) -> None:
    robot = fit.problem.robot.with_(effects=entries)
    problem, places = fit.problem.with_(robot=robot), fit.problem.effect_places
    near = fit.near(robot)
    chosen = [*others, *(i for k in curves for i in places[k])]
    count = len(problem.model.parameters)
    weak = np.full(len(fit.theta), np.inf)
    weak[:count] = _WEAK * np.array([p.sigma for p in problem.model.parameters])
    weak = np.minimum(weak, problem.limits().get("prior_sigma", np.inf))
    weak[:count] = np.minimum(weak[:count], pull_deviations(robot, problem.model))
    weak[~np.isfinite(weak)] = 1.0  # unknowns of the observations [m, rad]
    first = np.cumsum([len(others), *(len(places[k]) for k in curves)])
    blocks = [np.arange(first[b], first[b + 1]) for b in range(len(curves))]
    penalties = [np.asarray(robot.effects[k].penalty) for k in curves]
    J, residual, row = np.asarray(near.J)[:, chosen], np.asarray(near.r), np.asarray(near.row, dtype=np.int64)
    found = choose_curvatures(LinearProblem(J, residual, row, blocks, penalties, weak[chosen]))
    for k, curvature in zip(curves, found, strict=True):
        entries[k]["curvature"] = curvature
