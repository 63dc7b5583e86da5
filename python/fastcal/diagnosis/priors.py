# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Priors of the parameters: plausible sizes and standard deviations, independent of the residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.parameter_limits import has_prior
from fastcal.calibration.smoothing import prior_deviations
from fastcal.diagnosis import rules
from fastcal.diagnosis.problem import Linearization, Problem, core_entry
from fastcal.effects.entries import curve_of, traits_of
from fastcal.robot.robot import Spec

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Share of the misfit that a parameter of its usual size must move to have an influence at all.
MIN_INFLUENCE = 1e-9
# Largest plausible size of a length or an angle of the geometry [1 mm, 1 mrad]: beyond, the tool moves along a curve.
MAX_GEOMETRY_SIZE = 30.0


def plausible_sizes(problem: Problem, model: _core.ErrorModel, near: Linearization) -> FloatArray:
    """(P,) plausible size of each parameter: it alone moves the rows by the root mean square that the start leaves.

    One that moves nothing where it is has the size that its model gives it, and lengths and angles of the geometry
    MAX_GEOMETRY_SIZE of these at most: beyond, the tool moves along a curve.
    """
    length = near.lengths
    given = _given_sizes(problem, model)
    is_nil = moves_nothing(problem, model, near)
    size = np.where(is_nil, given, problem.misfit / np.where(is_nil, 1.0, length))
    size[: problem.own] = np.minimum(size[: problem.own], MAX_GEOMETRY_SIZE * given[: problem.own])
    return size


def widest(
    problem: Problem,
    model: _core.ErrorModel,
    near: Linearization,
    entries: Sequence[Spec],
    effects: Sequence[_core.Effect],
) -> FloatArray:
    """(P,) deviation of the widest prior that a parameter may have; inf: any, and so for base and tool.

    Points alone hardly show how the last joints lie, or how a tool was turned that slipped: by a wide prior noise would
    turn the hand by degrees. For the arm, for steps and for curves of its joints it is GEOMETRY_WIDTH, of the reach for
    a length; on an arm that is far off, the size at which a usual length or angle alone moves the rows by what the
    start leaves. A problem may hold the arm closer.
    """
    out = np.full(len(model.parameters) + len(problem.unknowns), np.inf)
    length, still = near.lengths, moves_nothing(problem, model, near)
    every = model.parameters
    arm = [i for i in range(problem.own) if every[i].owner not in ("base", "tool")]
    added = list[int]()
    at = problem.own
    for entry, effect in zip(entries, effects, strict=True):
        if entry["effect"] == curve_of("joint") or traits_of(entry["effect"]).searched == "at_s":
            added += range(at, at + len(effect.parameters))
        at += len(effect.parameters)
    for unit, whole in (("m", problem.start.robot.reach), ("rad", 1.0)):
        shown = [length[i] for i in arm if every[i].unit == unit and not still[i]]
        usual = problem.misfit / float(np.median(shown)) if shown else 0.0
        own = [i for i in (*arm, *added) if every[i].unit == unit]
        out[own] = max(rules.GEOMETRY_WIDTH * whole, usual)
    if problem.arm_size:
        out[arm] = np.minimum(out[arm], problem.arm_size * _given_sizes(problem, model)[arm])
    return out


def moves_nothing(problem: Problem, model: _core.ErrorModel, near: Linearization) -> BoolArray:
    """(P,) does a parameter of the size that its model gives it move the rows by no more than rounding?

    So does the compliance of an upright axis, whose load is the rounding of sums that cancel.
    """
    length = near.lengths
    return np.asarray(length * _given_sizes(problem, model) < MIN_INFLUENCE * problem.misfit)


def _given_sizes(problem: Problem, model: _core.ErrorModel) -> FloatArray:
    """(P,) plausible sizes as the model's parameters bring them; 1 where they bring none."""
    given = np.concatenate([[p.sigma for p in model.parameters], np.ones(len(problem.unknowns))])
    return np.where(np.isfinite(given), given, 1.0)


def held(prior: FloatArray, pull: FloatArray) -> FloatArray:
    """(P,) deviation of a prior and a pull together."""
    return np.asarray(1 / np.hypot(1 / prior, 1 / pull))


def of_effects(
    problem: Problem, entries: Sequence[Spec], effects: Sequence[_core.Effect], model: _core.ErrorModel
) -> FloatArray:
    """(P,) standard deviations of what is held near 0; infinite elsewhere."""
    out = np.full(len(model.parameters), np.inf)
    at = problem.own
    for entry, effect in zip(entries, effects, strict=True):
        count = len(effect.parameters)
        if has_prior(core_entry(entry)):
            out[at : at + count] = [p.sigma for p in effect.parameters]
        elif effect.penalty and "curvature" in entry:
            out[at : at + count] = prior_deviations(float(entry["curvature"]), np.asarray(effect.penalty))
        at += count
    return out
