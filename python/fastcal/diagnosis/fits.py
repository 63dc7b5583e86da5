# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Fits of a robot with some effects added: Gauss-Newton, outliers and noise known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal import _core
from fastcal.calibration.parameter_limits import has_prior
from fastcal.calibration.smoothing import prior_deviations
from fastcal.diagnosis.library import Name
from fastcal.diagnosis.problem import Problem, core_entry, with_nuisances
from fastcal.effects.entries import build_effects
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Spec

FloatArray = NDArray[np.float64]

_FAR, _NEAR = 30.0, 1e-3  # plausible sizes that a step may reach along what the data do not tell, at most and least
_STEPS = 15
_SETTLED = 1e-2  # change of chi square that is none, and as a share of it
_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Fit:
    """A least-squares fit with the effects `added`.

    Attributes:
        entries: All effects in the model: the robot's, the added ones, nuisances.
        theta: (P,) parameters of the model, then the anchors' places.
        free: Indices of those that are identified.
        remaining: |whitened residual|^2, priors included.
        near: Whitened Jacobian and residual at theta.
    """

    problem: Problem
    added: tuple[Name, ...]
    entries: list[Spec]
    model: _core.ErrorModel
    samples: _core.Samples
    theta: FloatArray
    free: list[int]
    prior: FloatArray
    remaining: float
    near: _core.Linearization

    def value(self, name: Name) -> FloatArray:
        """Parameters of one added effect."""
        at = self.place(name)
        return self.theta[at]

    def place(self, name: Name) -> slice:
        """Where they stand."""
        at = self.problem.own
        for entry, effect in zip(self.entries, self.model_effects, strict=True):
            if entry is name.entry:
                return slice(at, at + len(effect.parameters))
            at += len(effect.parameters)
        raise KeyError(name)

    @cached_property
    def model_effects(self) -> list[_core.Effect]:
        """The effects as the core has them."""
        return build_effects([core_entry(entry) for entry in self.entries], self.problem.start.model.robot)

    @cached_property
    def whitened(self) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
        """A (m, p) of the free parameters, r (m) measured less predicted, row (m): of the data, -1 a prior's."""
        A = np.asarray(self.near.J)[:, self.free] / self.problem.noise.factor
        r = -np.asarray(self.near.r) / self.problem.noise.factor
        held = np.flatnonzero(np.isfinite(self.prior[self.free]))
        prior = np.zeros((len(held), len(self.free)))
        deviation = self.prior[self.free][held]
        prior[np.arange(len(held)), held] = 1 / deviation
        row = np.concatenate([np.asarray(self.near.row, dtype=np.intp), np.full(len(held), -1)])
        return np.vstack([A, prior]), np.concatenate([r, -self.theta[self.free][held] / deviation]), row

    @cached_property
    def loads(self) -> FloatArray:
        """(N, n) load about or along each joint's axis [N m or N], in the settled state."""
        core = self.problem.start.robot
        theta = self.theta[: len(self.model.parameters)]
        loads = np.asarray(self.model.loads(self.samples, theta, False, self.problem.threads))
        axis = [5 if kind == "revolute" else 2 for kind in core.joint_types]
        return np.column_stack([loads[:, 2 * i + 1, axis[i]] for i in range(core.joint_count)])


def fit(problem: Problem, added: Sequence[Name], start: Fit | None = None) -> Fit:
    """Levenberg-Marquardt from a fit of some of the same effects; each round brings the loads to equilibrium."""
    added = tuple(added)
    entries = with_nuisances([*problem.given, *(name.entry for name in added)], problem.start.robot)
    model, samples = problem.model(entries, problem.kept)
    places = np.ones(len(problem.anchors))  # [m] their plausible size
    before = problem.anchors if start is None or len(places) == 0 else start.theta[-len(places) :]
    theta = np.concatenate([_carried(problem, entries, model, start), before])
    free = [*problem.geometry, *range(problem.own, len(theta))]
    prior = np.concatenate([_priors(problem, entries, model), np.inf * places])
    scale = np.concatenate([[p.sigma for p in model.parameters], places])[free]
    lower = np.concatenate([[p.lower for p in model.parameters], -np.inf * places])[free]
    names = [p.name for p in model.parameters] + [""] * len(places)
    critical = np.array([name.startswith("critical") for name in names])[free]
    deviation = prior[free]
    held_rows = np.diag(np.where(np.isfinite(deviation), scale / deviation, 0.0))
    factor = problem.noise.factor

    def remaining_at(theta: FloatArray) -> tuple[float, FloatArray, _core.Linearization]:
        near = _core.linearize(model, samples, problem.measured, theta, list(problem.noise.common), problem.threads)
        r = np.asarray(near.r) / factor
        held = theta[free] / deviation
        return float(r @ r + held @ held), theta, near

    def stepped(theta: FloatArray, near: _core.Linearization, reach: float) -> FloatArray:
        A = np.vstack([np.asarray(near.J)[:, free] * scale / factor, np.eye(len(free)) / reach, held_rows])
        held = np.where(np.isfinite(deviation), theta[free] / deviation, 0.0)
        b = np.concatenate([-np.asarray(near.r) / factor, np.zeros(len(free)), -held])
        out = theta.copy()
        out[free] += _solve(A, b) * scale
        index = np.array(free)[critical]
        out[index] = np.maximum(out[index], np.maximum(lower[critical], 1e-6))
        return out

    best = remaining_at(theta)
    reach = _FAR
    for _ in range(_STEPS):
        now = remaining_at(stepped(best[1], best[2], reach))
        if now[0] > best[0] * (1 + _SHARE) + _SETTLED:
            reach /= 4  # shortens the step along what the data hardly tell, such as a wrist's gauge, and nothing else
            if reach < _NEAR:
                break
            continue
        settled = best[0] - now[0] < _SETTLED + _SHARE * now[0]
        best, reach = now, min(2 * reach, _FAR)
        if settled:
            break
    return Fit(problem, added, entries, model, samples, best[1], free, prior, best[0], best[2])


def _solve(A: FloatArray, b: FloatArray) -> FloatArray:
    """Least squares by a complete orthogonal factorization."""
    return np.asarray(linalg.lstsq(A, b, lapack_driver="gelsy", check_finite=False)[0])


def _priors(problem: Problem, entries: Sequence[Spec], model: _core.ErrorModel) -> FloatArray:
    """(P,) standard deviations of what is held near 0; infinite elsewhere."""
    out = np.full(len(model.parameters), np.inf)
    at = problem.own
    for entry, effect in zip(
        entries, build_effects([core_entry(e) for e in entries], problem.start.model.robot), strict=True
    ):
        count = len(effect.parameters)
        if has_prior(core_entry(entry)):
            out[at : at + count] = [p.sigma for p in effect.parameters]
        elif effect.penalty and "curvature" in entry:
            out[at : at + count] = prior_deviations(float(entry["curvature"]), np.asarray(effect.penalty))
        at += count
    return out


def _carried(problem: Problem, entries: Sequence[Spec], model: _core.ErrorModel, start: Fit | None) -> FloatArray:
    """(P,) where to start: the values of `start`, the robot file's, 0 for what is new, corners at their quantile."""
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
    for entry, effect in zip(entries, build_effects([core_entry(e) for e in entries], model.robot), strict=True):
        count = len(effect.parameters)
        if identity_of(entry) in known:
            theta[at : at + count] = known[identity_of(entry)]
        elif "corner" in entry:
            theta[at : at + count] = corner_start(entry, effect, start, known)
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


def corner_start(entry: Spec, effect: _core.Effect, start: Fit | None, known: dict[Any, FloatArray]) -> FloatArray:
    """low, high, critical of a compliance that bends at a quantile of the loads that are met."""
    if start is None:
        raise InvalidInput(f"{entry['effect']}@{entry['owner']}: a corner follows from the loads of a fit")
    joint = int(entry["owner"].removeprefix("joint")) - 1
    linear = known.get(identity_of({"effect": "joint_compliance", "owner": entry["owner"]}))
    slope = 0.0 if linear is None else float(linear[0])
    return np.array([slope, slope, np.quantile(np.abs(start.loads[:, joint]), entry["corner"])])
