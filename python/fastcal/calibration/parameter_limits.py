# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Prior knowledge of parameters: their bounds, and Gaussian priors if requested."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.smoothing import prior_deviations
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot, Spec

PRIOR_SIZES = 3.0  # standard deviation of a prior that `priors` asks for, in plausible sizes


def has_prior(entry: Spec) -> bool:
    """Is an effect a nuisance (`prior: yes`), each parameter held where it is expected, within its plausible size?"""
    answers = {True: True, "yes": True, False: False, "no": False}
    prior = entry.get("prior", False)
    if not isinstance(prior, str | bool) or prior not in answers:
        raise InvalidInput(f"{entry['effect']}@{entry['owner']}: prior is yes or no, got {prior!r}")
    return answers[prior]


def bounds_of(parameters: Sequence[_core.Parameter], unknowns: int) -> dict[str, FloatArray]:
    """`lower` and `upper` of parameters and of the unknowns behind them, which have none; empty where nothing has."""
    lower, upper = np.array([p.lower for p in parameters]), np.array([p.upper for p in parameters])
    if not np.isfinite(lower).any() and not np.isfinite(upper).any():
        return {}
    infinite = np.full(unknowns, np.inf)
    return {"lower": np.concatenate([lower, -infinite]), "upper": np.concatenate([upper, infinite])}


def parameter_limits(
    robot: Robot, model: _core.ErrorModel, known_within: FloatArray, *, priors: bool
) -> dict[str, FloatArray]:
    """Keyword arguments of the core's `identify`, SI: one number a parameter of the model and an observation's unknown.

    Args:
        robot: Its effects say which of them are nuisances (`prior: yes`): each parameter is held near what the robot
            file says, which is 0 but for the scale of a structure, with its plausible size as standard deviation.
        model: The model of `robot` with base and tool fitted.
        known_within: Standard deviation within which each unknown of the observations is known to be 0, SI; infinite
            where nothing is known of it.
        priors: Hold all parameters but base and tool where the model starts (a scale that starts at 0: where it is
            expected), with PRIOR_SIZES plausible sizes.

    Returns:
        lower, upper: empty where nothing is bounded. prior_mean, prior_sigma: empty where there are no priors.
    """
    parameters = model.parameters
    infinite = np.full(len(known_within), np.inf)
    limits = bounds_of(parameters, len(known_within))
    if not priors and not robot.effects and not np.isfinite(known_within).any():
        return limits
    size = np.array([p.sigma for p in parameters])
    expected = np.array([p.expected for p in parameters])
    mean = np.where(model.start == 0, expected, model.start)
    sigma = np.full(len(parameters), np.inf)
    if priors:
        held = np.array([p.owner not in ("base", "tool") for p in parameters])
        sigma[held] = PRIOR_SIZES * size[held]
    at = len(model.robot.nominal)
    for entry, effect in zip(robot.entries, robot.effects, strict=True):
        own = slice(at, at + len(effect.parameters))
        if has_prior(entry):
            mean[own], sigma[own] = expected[own], size[own]
        if effect.penalty and "curvature" in entry:
            mean[own], sigma[own] = 0.0, prior_deviations(float(entry["curvature"]), np.asarray(effect.penalty))
        at = own.stop
    if np.isfinite(sigma).any() or np.isfinite(known_within).any():
        limits["prior_mean"] = np.concatenate([mean, np.zeros(len(infinite))])
        limits["prior_sigma"] = np.concatenate([sigma, known_within])
    return limits
