# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The identified parameters as a table for the result, and the correlated ones."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.bounds import Bound, Side
from fastcal.calibration.result import IdentifiedParameter
from fastcal.effects.entries import edge_name, edge_unit
from fastcal.effects.values import polar_pairs
from fastcal.robot.robot import Robot
from fastcal.units import factor, from_si

CORRELATED = 0.95


def parameter_table(
    start: Robot,
    model: _core.ErrorModel,
    found: _core.Identification,
    covariance: FloatArray,
    reached: Mapping[int, tuple[Side, float]],
) -> tuple[list[IdentifiedParameter], FloatArray]:
    """Identified numbers in edge units and their covariance in SI; harmonics as amplitude and phase.

    `covariance` (P, P) is that of the free parameters as the model has them; `reached` as `bounds_reached` finds it.

    The turns of base and tool are those from nominal to identified, about their own axes.
    """
    own, count = len(model.robot.nominal), len(model.start)
    parameters, free = found.parameters if len(found.theta) > count else model.parameters, found.free
    nominal = np.concatenate([start.error_model.start, np.zeros(len(parameters) - count)])
    theta = np.array(found.theta)
    for first, T, T_nominal in zip(
        (0, own - 6), model.robot.base_and_tool(theta[:own]), start.core.base_and_tool(start.core.nominal), strict=True
    ):
        theta[first + 3 : first + 6] = _core.log_so3(T_nominal[:3, :3].T @ T[:3, :3])
    names: dict[int, str] = {}  # of harmonics
    place = {i: k for k, i in enumerate(free)}
    slope = np.eye(len(place))
    for pair in polar_pairs(start.entries, start.effects, own, theta):
        if all(i in place for i in pair.indices):
            at = [place[i] for i in pair.indices]
            slope[np.ix_(at, at)] = pair.slope
            theta[pair.indices], nominal[pair.indices] = pair.values, pair.polar_of(nominal[pair.indices])
            names |= dict(zip(pair.indices, pair.names, strict=True))
    covariance = slope @ covariance.reshape(slope.shape) @ slope.T
    out = []
    values, values_before = theta.tolist(), nominal.tolist()
    for i, deviation in zip(free, np.sqrt(np.diag(covariance)).tolist(), strict=True):
        parameter, geometry = parameters[i], i < own or i >= count
        unit = edge_unit(parameter, geometry=geometry)
        value, before = from_si(values[i], unit), from_si(values_before[i], unit)
        std, bound = deviation / factor(unit), None
        if i in reached:
            side, unbounded = reached[i]
            bound = Bound(side, from_si(unbounded, unit), std)
        name = names.get(i) or edge_name(parameter, geometry=geometry)
        out.append(
            IdentifiedParameter(name, parameter.owner, value, std if bound is None else None, unit, before, bound)
        )
    return out, covariance


def correlated_pairs(names: list[str], covariance: FloatArray) -> list[tuple[str, str, float]]:
    """Pairs whose estimates move together, strongest first."""
    if len(names) < 2:
        return []
    scale = np.sqrt(np.diag(covariance))
    r = covariance / np.outer(scale, scale)
    i, j = np.nonzero(np.abs(r) > CORRELATED)
    i, j = i[i < j], j[i < j]
    order = np.argsort(-np.abs(r[i, j]), kind="stable")
    return [(names[i[k]], names[j[k]], float(r[i[k], j[k]])) for k in order]
