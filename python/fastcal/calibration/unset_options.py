# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What the data must tell of an effect before it can be identified: when a base step was, how curved a profile is.

Both are found near a fit of everything else, where the rest is linear.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.change_point import find_step
from fastcal.calibration.geometry_anchoring import pull_deviations
from fastcal.calibration.parameter_limits import has_prior, parameter_limits
from fastcal.calibration.smoothing import LinearProblem, choose_curvatures
from fastcal.effects.entries import label, options_of, traits_of
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec

FloatArray = NDArray[np.float64]

_MOMENT = "at_s"
_WEAK = 30.0  # plausible sizes: a prior that only keeps a singular problem solvable


@dataclass(frozen=True, eq=False)
class _Fit:
    """The problem near a fit of all parameters that are not open."""

    model: _core.ErrorModel
    samples: _core.Samples
    measured: _core.Measurements
    theta: FloatArray
    noise: Any
    threads: int

    def near(self, robot: Robot) -> _core.Linearization:
        """Whitened residuals and Jacobian of the same parameters in a robot whose open effects are set."""
        model = robot.error_model.with_robot(self.model.robot)
        return _core.linearize(model, self.samples, self.measured, self.theta, self.noise, self.threads)


def with_open_effects_set(
    robot: Robot,
    model: _core.ErrorModel,
    samples: _core.Samples,
    measured: _core.Measurements,
    asked: list[int],
    anchors: FloatArray,
    data: Dataset,
    *,
    loss: str,
    threads: int = 1,
) -> Robot:
    """The robot with `at_s` of a base step and `curvature` of profiles where its file gives none.

    Args:
        robot: With the effects to identify; it is returned where none is open.
        model: Its model with base and tool fitted to the data.
        samples: Conditions of the rows.
        measured: What was measured.
        asked: Indices of the parameters to identify.
        anchors: (anchors, 3) starting places.
        data: The measured rows.
        loss: Robust loss.
        threads: Cores to use.
    """
    entries = robot.spec.get("effects") or []
    places = _places(robot, model)
    steps = [
        k
        for k, e in enumerate(entries)
        if _MOMENT in traits_of(e["effect"]).among_parameters and _MOMENT not in options_of(e)
    ]
    curves = [
        k
        for k, (e, effect) in enumerate(zip(entries, robot.effects, strict=True))
        if effect.penalty and "curvature" not in e and not (traits_of(e["effect"]).role != "curve" and has_prior(e))
    ]
    if not steps and not curves:
        return robot
    for k in curves:
        if "prior" in entries[k]:
            raise InvalidInput(f"{label(entries[k])} takes its prior from its curvature, and prior was given")
    still = {i for k in steps + curves for i in places[k]}
    moving = [i for i in asked if i not in still]
    limits: dict[str, Any] = parameter_limits(robot, model, len(anchors), priors=False)
    found = _core.identify(
        model, samples, measured, asked=moving, anchors=anchors, loss=loss, threads=threads, **limits
    )
    fit = _Fit(model, samples, measured, np.asarray(found.theta), found.common_noise, threads)
    moving += range(len(model.parameters), len(fit.theta))
    spec = copy.deepcopy(robot.spec)
    for k in steps:
        spec["effects"][k]["parameters"] = {_MOMENT: _moment(fit, spec, k, places[k], moving, data)}
    if curves:
        _set_curvatures(fit, spec, curves, places, moving + [i for k in steps for i in places[k]])
    return Robot(spec)


def _places(robot: Robot, model: _core.ErrorModel) -> list[range]:
    """Indices of each effect's parameters in the model."""
    out, at = [], len(model.robot.parameters)
    for effect in robot.effects:
        out.append(range(at, at + len(effect.parameters)))
        at += len(effect.parameters)
    return out


def _moment(fit: _Fit, spec: Spec, k: int, own: range, others: list[int], data: Dataset) -> Spec:
    """When the step was: {value, std} [s], evenly likely between two rows."""
    before_all = copy.deepcopy(spec)
    before_all["effects"][k][_MOMENT] = -np.inf
    near = fit.near(Robot(before_all))
    J = np.asarray(near.J)
    at, gap = find_step(
        J[:, others], J[:, own], np.asarray(near.r), np.asarray(near.row, dtype=np.int64), np.asarray(data.time)
    )
    return {"value": at, "std": gap / 12**0.5}


def _set_curvatures(fit: _Fit, spec: Spec, curves: list[int], places: list[range], others: list[int]) -> None:
    robot = Robot(spec)
    near = fit.near(robot)
    chosen = [*others, *(i for k in curves for i in places[k])]
    limits = parameter_limits(robot, fit.model, (len(fit.theta) - len(fit.model.parameters)) // 3, priors=False)
    weak = np.full(len(fit.theta), np.inf)
    weak[: len(fit.model.parameters)] = _WEAK * np.array([p.sigma for p in fit.model.parameters])
    weak = np.minimum(weak, limits.get("prior_sigma", np.inf))
    weak[: len(fit.model.parameters)] = np.minimum(weak[: len(fit.model.parameters)], pull_deviations(robot, fit.model))
    weak[~np.isfinite(weak)] = 1.0  # anchors [m]
    first = np.cumsum([len(others), *(len(places[k]) for k in curves)])
    blocks = [np.arange(first[b], first[b + 1]) for b in range(len(curves))]
    penalties = [np.asarray(robot.effects[k].penalty) for k in curves]
    J, residual, row = np.asarray(near.J)[:, chosen], np.asarray(near.r), np.asarray(near.row, dtype=np.int64)
    found = choose_curvatures(LinearProblem(J, residual, row, blocks, penalties, weak[chosen]))
    for k, curvature in zip(curves, found, strict=True):
        spec["effects"][k]["curvature"] = curvature
