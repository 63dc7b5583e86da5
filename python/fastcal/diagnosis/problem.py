# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Fits of a robot with some effects added, and at each fit the score tests of everything that could be added next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal import _core
from fastcal.calibration import Prepared, measurements, prepare
from fastcal.conditions import build_samples
from fastcal.dataset import Dataset
from fastcal.diagnosis import generic
from fastcal.diagnosis.generic import Curves, Generic
from fastcal.diagnosis.library import LOADED, NUISANCES, Name
from fastcal.effects import build_effects, effect_owners
from fastcal.errors import InvalidInput
from fastcal.parameter_limits import has_prior
from fastcal.profile_penalty import prior_deviations
from fastcal.robot import Robot, Spec

FloatArray = NDArray[np.float64]

_ONE = " one"  # a column of ones: a regressor on it moves a frame, which gives the frame's own columns
_WEAK = 30.0  # plausible sizes: keeps a singular fit solvable, and moves nothing that the data tell
_STEPS = 15
_SETTLED = 1e-2  # change of chi square that is none, and as a share of it
_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class Noise:
    """Standard deviation of a measured number: root of its claim's square and common^2, times factor."""

    common: tuple[float, float, float]  # position [m], rotation [rad], distance [m]
    factor: float = 1.0
    freedom: float = np.inf  # degrees of freedom that it was estimated with


@dataclass(frozen=True, eq=False)
class Problem:
    """A robot, its measurements, what may be missing, and how noise and rows are taken.

    Attributes:
        start: The robot with base and tool fitted; its own effects are identified again.
        data: All rows; `used` (N,) marks those that are fitted.
        names: What may be added.
        noise: Of a measured number.
    """

    start: Prepared
    data: Dataset
    used: NDArray[np.bool_]
    names: list[Name]
    noise: Noise
    threads: int = 1

    @cached_property
    def kept(self) -> Dataset:
        """The rows that are fitted, with the column of ones."""
        kept = self.data.select(self.used)
        return replace(kept, extra={**kept.extra, _ONE: np.ones(len(kept))})

    @cached_property
    def measured(self) -> _core.Measurements:
        """What was measured in them."""
        return measurements(self.kept)

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Indices of the fitted rows in `data`."""
        return np.flatnonzero(self.used)

    @cached_property
    def own(self) -> int:
        """Parameters of the robot itself."""
        return len(self.start.model.robot.parameters)

    @cached_property
    def geometry(self) -> list[int]:
        """Those of the robot's own parameters that are identified."""
        return [i for i in self.start.asked if i < self.own]

    @cached_property
    def anchors(self) -> FloatArray:
        """(3 anchors,) places from which lengths were measured, to begin with [m]; empty where none were."""
        return np.asarray(self.start.alignment.anchors, dtype=np.float64).ravel()

    @property
    def given(self) -> list[Spec]:
        """Effects that the robot file has."""
        return list(self.start.robot.spec.get("effects") or [])

    def model(self, entries: Sequence[Spec], data: Dataset) -> tuple[_core.ErrorModel, _core.Samples]:
        """The robot with these effects at 0, and the conditions of the rows of `data`."""
        core = self.start.model.robot
        effects = build_effects([core_entry(entry) for entry in entries], core)
        model = _core.ErrorModel(core, effects).with_equilibrium(self.start.model.at_equilibrium)
        return model, build_samples([core_entry(e) for e in entries], effects, core, data.q, conditions_of(data))

    def with_rows(self, used: NDArray[np.bool_]) -> Problem:
        """The same with other rows fitted."""
        return replace(self, used=used)

    def with_noise(self, noise: Noise) -> Problem:
        """The same with other noise."""
        return replace(self, noise=noise)


def prepared_problem(robot: Robot, data: Dataset, names: list[Name], noise: Noise, threads: int) -> Problem:
    """All measured rows, base and tool fitted."""
    start = prepare(robot, data, effects="geometry", threads=threads)
    return Problem(start, data, data.measured, names, noise, threads)


def core_entry(entry: Spec) -> Spec:
    """An entry without what only the diagnosis knows."""
    return {key: value for key, value in entry.items() if key != "corner"}


def conditions_of(data: Dataset) -> dict[str, Any]:
    """The columns of a data set as `build_samples` takes them."""
    return {
        "payload": data.payload,
        "wrench": data.wrench,
        "temperature": data.temperature,
        "time": data.time,
        "station": None if data.station is None else np.array(data.station_names)[data.station],
        "mount": None if data.mount is None else np.array(data.mount_names)[data.mount],
        "approach": data.approach,
        "current": data.current,
        "extra": data.extra,
    }


def with_nuisances(entries: Sequence[Spec], robot: Robot) -> list[Spec]:
    """The entries, and where one of them follows loads the errors of masses and centres, held by priors."""
    loaded = any(entry["effect"] in LOADED or entry.get("side") == "load" for entry in entries)
    there = {(entry["effect"], entry["owner"]) for entry in entries}
    out = list(entries)
    if loaded:
        out += [
            {"effect": effect, "owner": owner, "prior": "yes"}
            for effect in NUISANCES
            for owner in effect_owners(effect, robot.core)
            if (effect, owner) not in there and _has_mass(robot, owner)
        ]
    return out


def _has_mass(robot: Robot, owner: str) -> bool:
    link = robot.spec["joints"][int(owner.removeprefix("link")) - 1].get("link") or {}
    return float(link.get("mass_kg", 0.0)) > 0


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
    """Gauss-Newton from a fit of some of the same effects; each round brings the loads to equilibrium."""
    added = tuple(added)
    entries = with_nuisances([*problem.given, *(name.entry for name in added)], problem.start.robot)
    model, samples = problem.model(entries, problem.kept)
    places = np.ones(len(problem.anchors))  # [m] their plausible size
    before = problem.anchors if start is None or len(places) == 0 else start.theta[-len(places) :]
    theta = np.concatenate([_carried(problem, entries, model, start), before])
    free = [*problem.geometry, *range(problem.own, len(theta))]
    prior = np.concatenate([_priors(problem, entries, model), np.inf * places])
    scale = np.concatenate([[p.sigma for p in model.parameters], places])[free]
    weak = _WEAK * scale
    lower = np.concatenate([[p.lower for p in model.parameters], -np.inf * places])[free]
    names = [p.name for p in model.parameters] + [""] * len(places)
    critical = np.array([name.startswith("critical") for name in names])[free]
    deviation = prior[free]
    best = (np.inf, theta, _core.linearize(model, samples, problem.measured, theta, list(problem.noise.common), 1))
    damping = 1.0
    step = np.zeros(len(free))
    for _ in range(_STEPS):
        near = _core.linearize(model, samples, problem.measured, theta, list(problem.noise.common), problem.threads)
        r = np.asarray(near.r) / problem.noise.factor
        held = theta[free] / deviation
        remaining = float(r @ r + held @ held)
        if remaining > best[0] * (1 + _SHARE) + _SETTLED:
            damping /= 4
            if damping < 1e-3:
                break
            theta = best[1].copy()
            theta[free] += damping * step
            continue
        settled = best[0] - remaining < _SETTLED + _SHARE * remaining
        best = (remaining, theta.copy(), near)
        if settled:
            break
        J = np.asarray(near.J)[:, free] * scale / problem.noise.factor
        inverse = np.diag(scale / weak)
        own = np.diag(np.where(np.isfinite(deviation), scale / deviation, 0.0))
        A = np.vstack([J, inverse, own])
        b = np.concatenate([-r, np.zeros(len(free)), np.where(np.isfinite(deviation), -held, 0.0)])
        step = _solve(A, b) * scale
        damping = 1.0
        theta = theta.copy()
        theta[free] += step
        if critical.any():
            at = np.flatnonzero(critical)
            index = np.array(free)[at]
            theta[index] = np.maximum(theta[index], np.maximum(lower[at], 1e-6))
    return Fit(problem, added, entries, model, samples, best[1], free, prior, best[0], best[2])


def _solve(A: FloatArray, b: FloatArray) -> FloatArray:
    """Least squares by normal equations; the weak priors keep them positive definite."""
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
            known[_identity(entry)] = start.theta[at : at + len(effect.parameters)]
            at += len(effect.parameters)
    else:
        file = problem.start.robot.error_model
        at = problem.own
        for entry, effect in zip(problem.given, problem.start.robot.effects, strict=True):
            known[_identity(entry)] = np.asarray(file.start)[at : at + len(effect.parameters)]
            at += len(effect.parameters)
    at = problem.own
    for entry, effect in zip(entries, build_effects([core_entry(e) for e in entries], model.robot), strict=True):
        count = len(effect.parameters)
        if _identity(entry) in known:
            theta[at : at + count] = known[_identity(entry)]
        elif "corner" in entry:
            theta[at : at + count] = _corner_start(entry, effect, start, known)
        at += count
    return theta


def _identity(entry: Spec) -> Any:
    return (
        entry["effect"],
        entry["owner"],
        entry.get("order"),
        entry.get("side"),
        entry.get("at_s"),
        entry.get("corner"),
        entry.get("torque"),
    )


def _corner_start(entry: Spec, effect: _core.Effect, start: Fit | None, known: dict[Any, FloatArray]) -> FloatArray:
    """low, high, critical of a compliance that bends at a quantile of the loads that are met."""
    if start is None:
        raise InvalidInput(f"{entry['effect']}@{entry['owner']}: a corner follows from the loads of a fit")
    joint = int(entry["owner"].removeprefix("joint")) - 1
    linear = known.get(_identity({"effect": "joint_compliance", "owner": entry["owner"]}))
    slope = 0.0 if linear is None else float(linear[0])
    return np.array([slope, slope, np.quantile(np.abs(start.loads[:, joint]), entry["corner"])])


@dataclass(frozen=True, eq=False)
class Blocks:
    """What could be added to a fit: names first, then blocks without a name, and their score tests."""

    names: list[Name]
    generics: list[Generic]
    tests: _core.ScoreTests
    columns: FloatArray
    sizes: list[int]
    frames: dict[str, FloatArray]  # (m, k) columns of a motion of base, joints, tool; rows of priors are not in them

    def columns_of(self, index: int) -> FloatArray:
        """(m, k) of one block."""
        first = sum(self.sizes[:index])
        return self.columns[:, first : first + self.sizes[index]]

    def title(self, index: int) -> str:
        """A block in words."""
        return repr(self.names[index] if index < self.count else self.generics[index - self.count])

    @property
    def count(self) -> int:
        """Of names; generic blocks have the indices from there on."""
        return len(self.names)


def blocks(at: Fit, extra_names: Sequence[Name] = ()) -> Blocks:
    """Columns and score tests of all names and generic blocks at a fit."""
    problem = at.problem
    there = {_identity(name.entry) for name in at.added}
    taken = {name.key for name in at.added if name.effect in ("joint_compliance_nonlinear", "base_step")}
    names = [n for n in [*problem.names, *extra_names] if _identity(n.entry) not in there and n.key not in taken]
    frames = _frames(problem)
    entries = [*at.entries, *(n.entry for n in names), *frames]
    model, samples = problem.model(entries, problem.kept)
    count = len(at.model.parameters)
    theta = np.concatenate([at.theta[:count], np.zeros(len(model.parameters) - count), at.theta[count:]])
    effects = build_effects([core_entry(e) for e in entries], model.robot)
    sizes = [len(e.parameters) for e in effects]
    first = problem.own + np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    offset = len(at.entries)
    for k, name in enumerate(names):
        if "corner" in name.entry:
            part = slice(first[offset + k], first[offset + k + 1])
            known = {
                _identity({"effect": n.effect, "owner": n.owner}): at.value(n)
                for n in at.added
                if n.effect == "joint_compliance"
            }
            theta[part] = _corner_start(name.entry, effects[offset + k], at, known)
            theta[part.start : part.start + 2] = 0.0
    near = _core.linearize(model, samples, problem.measured, theta, list(problem.noise.common), problem.threads)
    J = np.asarray(near.J) / problem.noise.factor
    A, r, _row = at.whitened
    n_measured = len(near.row)
    columns = [J[:, first[offset + k] : first[offset + k + 1]] for k in range(len(names))]
    frame_columns = {
        entry["owner"]: J[:, first[offset + len(names) + k] : first[offset + len(names) + k + 1]]
        for k, entry in enumerate(frames)
    }
    generics, generic_columns = _generic_columns(at, frame_columns, np.asarray(near.row))
    columns += generic_columns
    C = np.zeros((len(r), sum(c.shape[1] for c in columns)))
    C[:n_measured] = np.hstack(columns)
    sizes = [c.shape[1] for c in columns]
    return Blocks(names, generics, _core.ScoreTests(A, C, r, sizes), C, sizes, frame_columns)


def _frames(problem: Problem) -> list[Spec]:
    robot = problem.start.robot
    out: list[Spec] = [{"effect": "regressor", "owner": "base", "column": _ONE}]
    for i, kind in enumerate(robot.joint_types):
        out.append(
            {
                "effect": "regressor",
                "owner": f"joint{i + 1}",
                "column": _ONE,
                "axis": "rz" if kind == "revolute" else "z",
            }
        )
    return [*out, {"effect": "regressor", "owner": "tool", "column": _ONE}]


def _generic_columns(
    at: Fit, frame: dict[str, FloatArray], row: NDArray[Any]
) -> tuple[list[Generic], list[FloatArray]]:
    problem, data = at.problem, at.problem.kept
    robot = problem.start.robot
    turns = [kind == "revolute" for kind in robot.joint_types]
    found: list[Generic] = []
    columns: list[FloatArray] = []

    def add(owner: str, curves: Curves, direction: FloatArray) -> None:
        if curves.values.shape[1] == 0:
            return
        values = curves.values[row]
        block = (direction[:, :, np.newaxis] * values[:, np.newaxis, :]).reshape(len(row), -1)
        found.append(Generic(owner, curves))
        columns.append(block)

    for joint in range(robot.joint_count):
        for curves in generic.joint_curves(joint, data, at.loads, turns):
            add(f"joint{joint + 1}", curves, frame[f"joint{joint + 1}"])
    for curves in generic.frame_curves(data):
        add("base", curves, frame["base"])
        add("tool", curves, frame["tool"])
    if data.position is not None:
        point = np.asarray(at.model.predict(at.samples, at.theta[: len(at.model.parameters)], problem.threads, None))[
            :, :3, 3
        ]
        add("workspace", generic.field_curves(point), frame["base"][:, :3])
    return found, columns
