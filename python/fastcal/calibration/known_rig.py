# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Places of cameras and boards of one arm that its file knows, held against what the pictures say (`contradicted`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.contradicted import SURE_DEG, SURE_MM, Told, contradicted, or_others, place_sentence
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.unknowns import CORNERS, unknowns_found
from fastcal.errors import FastcalError
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import PLACEMENT, with_found
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Spec
from fastcal.units import to_si

_KEYS = ("fixed", "sigma_mm", "sigma_deg")  # that say how surely a place is known
_KINDS = {"camera": "cameras", "board": "boards"}
_OPEN = 10.0  # plausible sizes within which all is known that no picture shows


def without_contradicted_places(
    robot: Robot, data: Dataset, prepared: Callable[[Robot], CalibrationProblem], *, looks: bool = True
) -> tuple[Robot, list[str]]:
    """The robot without what its file knows of cameras and boards and the pictures contradict; a sentence on each.

    Args:
        robot: With its cameras and boards.
        data: Pictures.
        prepared: The problem of a robot by these.
        looks: False: as it is.
    """
    known = {(kind, name): of for kind, name, of in _members(robot) if any(of.get(key) for key in _KEYS)}
    if not looks or not known or CORNERS not in data.kinds:
        return robot, []
    try:
        problem = prepared(_without(robot, list(known)))
        found = problem.identify()
    except FastcalError:  # the pictures alone place nothing: what is known is needed
        return robot, []
    if found.status != "converged":
        return robot, []
    own, parameters = len(problem.model.start), problem.measured.parameters
    told = list(_told(known, parameters, np.asarray(found.theta), own))
    wrong = contradicted(told, _covariance(problem, found))
    places, std = unknowns_found(found, own, np.asarray(found.covariance))
    there = with_found(problem.robot.spec, parameters, places, std)
    notes: list[str] = [
        or_others(place_sentence(of.label, known[of.of], there[_KINDS[of.of[0]]][of.label]), others)
        for of, others in wrong
    ]
    return _without(robot, [of.of for of, _ in wrong]) if wrong else robot, notes


def _members(robot: Robot) -> Iterator[tuple[str, str, Spec]]:
    rig = robot.description
    for kind, members in (("camera", rig.cameras), ("board", rig.boards)):
        for name, of in members.items():
            yield kind, name, of


def _without(robot: Robot, members: list[tuple[str, str]]) -> Robot:
    """The robot that does not know where these are."""
    rig: dict[str, dict[str, Spec]] = {key: {} for key in _KINDS.values()}
    for kind, name, of in _members(robot):
        is_open = (kind, name) in members
        rig[_KINDS[kind]][name] = {key: value for key, value in of.items() if not (is_open and key in _KEYS)}
    return robot.with_(**rig)


def _told(
    known: dict[tuple[str, str], Spec], parameters: list[_core.Parameter], theta: FloatArray, own: int
) -> Iterator[Told]:
    """What the file says; unknowns, behind `own` parameters of the arm, are changes of it."""
    for (kind, name), of in known.items():
        sure = {"sigma_mm": SURE_MM, "sigma_deg": SURE_DEG} if of.get("fixed") else of
        within = {axis: sure.get("sigma_deg" if axis.startswith("r") else "sigma_mm") for axis in PLACEMENT}
        at, sigma = list[int](), list[float]()
        for k, parameter in enumerate(parameters):
            size = within.get(parameter.name) if parameter.owner == f"{kind} {name}" else None
            if size is not None:
                at.append(own + k)
                sigma.append(to_si(float(size), "deg" if parameter.name.startswith("r") else "mm"))
        if at:
            yield Told((kind, name), name, np.eye(len(theta))[at], -theta[at], np.array(sigma))


def _covariance(problem: CalibrationProblem, found: _core.Identification) -> FloatArray:
    """(T, T) of the parameters and unknowns without the gross rows, what no picture shows within _OPEN sizes."""
    near = problem.linearize(np.asarray(found.theta), list(found.common_noise))
    every = [*problem.model.parameters, *problem.measured.parameters]
    own = [*problem.asked, *range(len(problem.model.parameters), len(every))]
    size = np.array([every[i].sigma for i in own])
    kept = ~np.isin(np.asarray(near.row), list(found.outliers))
    J = np.asarray(near.J)[kept][:, own] * size
    out = np.zeros((len(every), len(every)))
    out[np.ix_(own, own)] = np.linalg.inv(J.T @ J + np.eye(len(own)) / _OPEN**2) * np.outer(size, size)
    return out
