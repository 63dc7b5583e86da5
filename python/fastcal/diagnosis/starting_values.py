# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a fit begins: at the values of an earlier fit or of the robot file, at zero for what is new."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.diagnosis.problem import Problem
from fastcal.effects.entries import traits_of
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Spec

if TYPE_CHECKING:
    from fastcal.diagnosis.fits import Fit

FloatArray = NDArray[np.float64]


def carried(
    problem: Problem,
    entries: Sequence[Spec],
    effects: Sequence[_core.Effect],
    model: _core.ErrorModel,
    start: Fit | None,
    corners: Fit | None = None,
) -> FloatArray:
    """(P,) where to start: the values of `start`, the robot file's, 0 for what is new, corners at their quantile.

    Corners follow from the loads of `start`, or of the fit `corners`.
    """
    theta = np.array(model.start)
    known: dict[int, FloatArray] = {}
    if start is not None:
        theta[: problem.own] = start.theta[: problem.own]
        at = problem.own
        for entry, effect in zip(start.entries, start.model_effects, strict=True):
            known[identity_of(entry)] = start.theta[at : at + len(effect.parameters)]
            at += len(effect.parameters)
    else:
        file = problem.start.robot.error_model
        at = problem.own
        for entry, effect in zip(problem.given, problem.start.robot.effects, strict=True):
            known[identity_of(entry)] = np.asarray(file.start)[at : at + len(effect.parameters)]
            at += len(effect.parameters)
    at = problem.own
    for entry, effect in zip(entries, effects, strict=True):
        count = len(effect.parameters)
        if identity_of(entry) in known:
            theta[at : at + count] = known[identity_of(entry)]
        elif "corner" in entry:
            theta[at : at + count] = corner_start(entry, corners or start, known)
        at += count
    return theta


def identity_of(entry: Spec) -> Any:
    """Equal for entries that share their parameters' values."""
    return (
        entry["effect"],
        entry["owner"],
        entry.get("order"),
        entry.get("side"),
        entry.get("at_s"),
        entry.get("corner"),
        entry.get("torque"),
    )


def corner_start(entry: Spec, start: Fit | None, known: dict[Any, FloatArray]) -> FloatArray:
    """low, high, critical of a compliance that bends at a quantile of the loads that are met."""
    if start is None:
        raise InvalidInput(f"{entry['effect']}@{entry['owner']}: a corner follows from the loads of a fit")
    joint = int(entry["owner"].removeprefix("joint")) - 1
    simpler = [{"effect": e, "owner": entry["owner"]} for e in traits_of(entry["effect"]).generalizes]
    slope = next((float(known[key][0]) for key in map(identity_of, simpler) if key in known), 0.0)
    return np.array([slope, slope, start.corner_loads(entry["corner"])[joint]])
