# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Starting values of a fit: those of an earlier fit or of the robot file, zero for new parameters."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.diagnosis.problem import Problem
from fastcal.effects.entries import same_parameters, traits_of
from fastcal.errors import InvalidInput
from fastcal.place import place_of
from fastcal.robot.robot import Spec

if TYPE_CHECKING:
    from fastcal.diagnosis.fits import Fit

FloatArray = NDArray[np.float64]
_FAR_OFF = 4.0  # plausible sizes: further off, rows near a fold of the loops lead steps from the file astray
Known = Mapping[Hashable, Mapping[str, float]]  # by `same_parameters`: values by the parameters' names


def carried(
    problem: Problem,
    entries: Sequence[Spec],
    effects: Sequence[_core.Effect],
    model: _core.ErrorModel,
    start: Fit | None,
    corners: Fit | None = None,
) -> FloatArray:
    """(P,) where to start: the values of `start`, the robot file's, 0 for what is new, corners at their quantile.

    Each value goes by its name to the entry whose parameters mean the same. Corners follow from the loads of `start`,
    or of the fit `corners`.
    """
    theta = np.array(model.start)
    if start is not None:
        theta[: problem.own] = start.theta[: problem.own]
        known = values_by_name(start.entries, start.model_effects, start.theta[problem.own :])
    else:
        file = problem.start.robot
        known = values_by_name(problem.given, file.effects, np.asarray(file.error_model.start)[problem.own :])
    for entry, own, part in _parts(entries, effects, theta[problem.own :]):
        there = known.get(same_parameters(entry))
        if there is not None:
            part[:] = [there.get(name, value) for name, value in zip(own, part, strict=True)]
        elif "corner" in entry:
            part[:] = corner_start(entry, corners or start, known)
        elif traits_of(entry["effect"]).searched == "critical" and len(part):
            part[0] = _straight(entry, known)
    return theta


def first_guess(
    problem: Problem,
    entries: Sequence[Spec],
    effects: Sequence[_core.Effect],
    model: _core.ErrorModel,
    start: Fit | None,
) -> FloatArray:
    """(P,) `carried`; with closed loops, the geometry of names that `start` lacks begins as without any.

    What lacks a name lies far along the loops' valleys, from where the way of those that have it is long. Where a
    constant of closed loops is far off, the first geometry is that of `near_the_file`.
    """
    theta = carried(problem, entries, effects, model, start)
    if not problem.start.robot.passive or problem.has_nominal_arm or _has_all(start, entries):
        return theta
    theta[: problem.own] = model.start[: problem.own]
    own = slice(problem.own)
    robust = problem.start.near_the_file[own]
    off = [
        abs(there - here) / p.sigma
        for there, here, p in zip(robust, theta[own], model.parameters[own], strict=True)
        if p.owner not in ("base", "tool")
    ]
    if max(off) > _FAR_OFF:
        theta[own] = robust
    return theta


def _has_all(start: Fit | None, entries: Sequence[Spec]) -> bool:
    """Has a fit all of these entries?"""
    return start is not None and {*map(same_parameters, entries)} <= {*map(same_parameters, start.entries)}


def values_by_name(
    entries: Sequence[Spec], effects: Sequence[_core.Effect], theta: FloatArray
) -> dict[Hashable, dict[str, float]]:
    """The values of effects, which stand in `theta` one after the other, as `carried` looks them up."""
    return {
        same_parameters(entry): dict(zip(names, map(float, part), strict=True))
        for entry, names, part in _parts(entries, effects, theta)
    }


def _parts(
    entries: Sequence[Spec], effects: Sequence[_core.Effect], theta: FloatArray
) -> Iterator[tuple[Spec, list[str], FloatArray]]:
    """Each entry with the names of its parameters and its part of `theta`."""
    at = 0
    for entry, effect in zip(entries, effects, strict=True):
        names = [f"{p.owner} {p.name}" for p in effect.parameters]
        yield entry, names, theta[at : at + len(names)]
        at += len(names)


def corner_start(entry: Spec, start: Fit | None, known: Known) -> FloatArray:
    """low, high, critical of a compliance that bends at a quantile of the loads that are met."""
    if start is None:
        raise InvalidInput(f"{entry['effect']}@{entry['owner']}: a corner follows from the loads of a fit")
    joint = place_of(entry["owner"]).index
    slope = _straight(entry, known)
    return np.array([slope, slope, start.corner_loads(entry["corner"])[joint]])


def _straight(entry: Spec, known: Known) -> float:
    """The slope of the straight law that an entry bends; 0 where that is not known."""
    simpler = [{"effect": e, "owner": entry["owner"]} for e in traits_of(entry["effect"]).generalizes]
    return next((next(iter(known[key].values())) for key in map(same_parameters, simpler) if key in known), 0.0)
