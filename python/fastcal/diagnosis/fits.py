# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Fits of a robot with some effects added: Levenberg-Marquardt, outliers and noise known.

What a parameter is worth is what it moves the measured numbers over these rows: its plausible size is the one at which
it alone moves them as far as the nominal robot is off, whatever its unit. Every parameter has a prior of PRIOR_WIDTH
such sizes about its start, the arm's geometry a narrower one (`priors`). That decides nothing the data show, and it
gives the directions that they do not show (the parallel axes of a cobot, a wrist's gauge) the same value in the fit as
in the tests that follow it.

Why not the core's `identify`, which takes the same priors and noise without a gauge: it ends at the same minimum, chi
square to 0.6 (this one stops where less is to be gained), but it brings loads to equilibrium in an outer loop and
works out a covariance. On 250 to 290 rows of a loaded six-axis arm with 65 parameters it takes 130 to 180 ms, this
16 ms; where no load matters 9 and 7 ms. A search makes many fits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.linalg import lapack

from fastcal import _core
from fastcal.calibration.geometry_anchoring import geometry_pulls
from fastcal.calibration.tall import gram
from fastcal.calibration.unknowns import unknowns_by_owner
from fastcal.diagnosis import priors, rules
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.fit_algebra import above, columns_of, inverse_triangle, solved
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.problem import Linearization, Problem
from fastcal.diagnosis.projection import basis, root
from fastcal.diagnosis.starting_values import carried, first_guess
from fastcal.effects.entries import traits_of
from fastcal.robot.robot import Spec

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

# Longest reach of a step along what the data hardly show [plausible sizes].
MAX_STEP = 30.0
# Linearizations of a fit at most.
MAX_ITERATIONS = 15
# Share of chi square that rounding may make of a gain or a loss.
CHI_SQUARE_SHARE = 1e-5
_WIDER = 1.3  # by which the longest reach grows with each step that succeeds, once one has failed


@dataclass(frozen=True, eq=False)
class Fit:
    """A least-squares fit with the effects `added`.

    Attributes:
        entries: All effects in the model: the robot's, the added ones, nuisances.
        theta: (P,) parameters of the model, then the observations' unknowns.
        free: Indices of those that are identified.
        prior: (P,) standard deviation of each parameter's prior; `centre` (P,) its mean.
        pull: (P,) deviation by which geometry beside curves is pulled to `centre`, which is no knowledge: no stated
            deviation counts it. Infinite where nothing pulls.
        remaining: |whitened residual|^2, priors and pulls included.
        near: Whitened Jacobian and residual at theta.
        converged: Would a further step change nothing?
        work: Numbers of Jacobians that it took.
        squares: (F, F) J^T J of the measured numbers, whitened but for `Noise.factor`, if the steps left it.
    """

    problem: Problem
    added: tuple[Hypothesis, ...]
    entries: list[Spec]
    model: _core.ErrorModel
    samples: _core.Samples
    theta: FloatArray
    free: list[int]
    prior: FloatArray
    pull: FloatArray
    centre: FloatArray
    remaining: float
    near: Linearization
    converged: bool = True
    work: int = 0
    squares: FloatArray | None = None

    @cached_property
    def covariance(self) -> FloatArray:
        """(F, F) of the free parameters, (A^T A)^-1 of the whitened rows with their priors."""
        if not np.isfinite(self.pull).any():
            return self.pulled_covariance
        return np.asarray(self._inverse @ self._inverse.T)

    @cached_property
    def pulled_covariance(self) -> FloatArray:
        """(F, F) of the free parameters, (A^T A)^-1 of `whitened`: with pulls, as curves are drawn."""
        inverse = inverse_triangle(lambda: self.whitened[0], self.normal)
        return np.asarray(inverse @ inverse.T)

    @cached_property
    def _inverse(self) -> FloatArray:
        """R^-1 of A = Q R, whose rows are the measured numbers and the priors."""
        known = 1 / self.prior[self.free]
        return inverse_triangle(lambda: above(self._measured, known), self._measured_normal + np.diag(known**2))

    def root(self, kept: list[int]) -> FloatArray:
        """Lower triangular L, L L^T the covariance of some of the free ones: no Cholesky that rounding could end."""
        R = linalg.qr(self._inverse[kept].T, mode="r", check_finite=False)[0][: len(kept)]
        return np.asarray(R.T * np.where(np.diag(R) < 0, -1.0, 1.0))

    @property
    def unknowns(self) -> dict[str, FloatArray]:
        """Those of the observations, by what they are of: the place (3,) [m] of "anchor 2"."""
        return unknowns_by_owner(self.problem.measured, self.theta[len(self.model.parameters) :])

    def value(self, name: Hypothesis) -> FloatArray:
        """Parameters of one added effect."""
        at = self.place(name)
        return self.theta[at]

    def effect(self, name: Hypothesis) -> _core.Effect:
        """One added effect as the core has it."""
        return next(
            effect for entry, effect in zip(self.entries, self.model_effects, strict=True) if entry is name.entry
        )

    def columns(self, name: Hypothesis) -> list[int]:
        """Indices of the parameters of an added effect among the free ones."""
        place = self.place(name)
        return [self.free.index(i) for i in range(place.start, place.stop)]

    def place(self, name: Hypothesis) -> slice:
        """Indices of the parameters of an added effect among all of the model's."""
        at = self.problem.own
        for entry, effect in zip(self.entries, self.model_effects, strict=True):
            if entry is name.entry:
                return slice(at, at + len(effect.parameters))
            at += len(effect.parameters)
        raise KeyError(name)

    @cached_property
    def of_setups(self) -> list[int]:
        """Indices, among all of the model's, of what says where stations and mounts stand; none: there is one of each.

        Base and tool are those of the first.
        """
        out: list[int] = []
        at = self.problem.own
        for entry, effect in zip(self.entries, self.model_effects, strict=True):
            if traits_of(entry["effect"]).labels:
                out += range(at, at + len(effect.parameters))
            at += len(effect.parameters)
        ends = [i for i in range(self.problem.own) if self.model.parameters[i].owner in ("base", "tool")]
        return [*ends, *out] if out else []

    @cached_property
    def model_effects(self) -> list[_core.Effect]:
        """The effects as the core has them."""
        return self.problem.effects(self.entries)

    @cached_property
    def whitened(self) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
        """A (m, p) of the free parameters, r (m) measured less predicted, row (m): of the data, -1 a prior's.

        Of white noise: what rows share with those measured before them is taken out.
        """
        own = self.near.row
        r = decorrelated(self.problem, -self.near.r / self.problem.noise.factor, own)
        return self._with_priors(self._measured, r)

    @cached_property
    def basis(self) -> FloatArray:
        """(m, rank) an orthonormal basis of the columns of `whitened`."""
        return basis(self.whitened[0], self.normal)

    def is_of(self, problem: Problem, entries: Sequence[Spec], theta: FloatArray) -> bool:
        """Is it a fit with these entries, that ended here, to the same rows, whitened alike but for their factor?"""
        return (
            list(entries) == self.entries
            and np.array_equal(theta, self.theta)
            and problem.start is self.problem.start
            and problem.data is self.problem.data
            and problem.weight is self.problem.weight
            and problem.arm_size == self.problem.arm_size
            and problem.repeatability == self.problem.repeatability
            and np.array_equal(problem.used, self.problem.used)
            and problem.noise.without_factor == self.problem.noise.without_factor
        )

    def beyond(self, values: FloatArray) -> FloatArray:
        """(m, k) what the parameters can't do of columns (m, k), over the rows of `whitened`."""
        A, length = self.whitened[0], np.sqrt(np.diag(self.normal))
        L = root(self.normal / np.outer(length, length)) if length.all() else None
        if L is None:
            return np.asarray(values - self.basis @ (self.basis.T @ values))
        for _ in range(2):  # the second takes what rounding left
            values = values - A @ (lapack.dpotrs(L, (A.T @ values) / length[:, np.newaxis], lower=1)[0].T / length).T
        return values

    @cached_property
    def normal(self) -> FloatArray:
        """(F, F) A^T A of `whitened`."""
        return self._measured_normal + np.diag(np.hypot(1 / self.prior, 1 / self.pull)[self.free] ** 2)

    @cached_property
    def _measured_normal(self) -> FloatArray:
        """(F, F) its part of the measured numbers."""
        return gram(self._measured) if self.squares is None else self.squares / self.problem.noise.factor**2

    @cached_property
    def standardized(self) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
        """`whitened` as it was measured, row by row: each number over its standard deviation, whatever they share."""
        factor = self.problem.noise.factor
        return self._with_priors(columns_of(self.near, self.free) / factor, -self.near.r / factor)

    def _with_priors(self, A: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.intp]]:
        deviation = priors.held(self.prior, self.pull)[self.free]
        away = (self.theta - self.centre)[self.free] / deviation
        row = np.concatenate([self.near.row, np.full(len(away), -1)])
        return above(A, 1 / deviation), np.concatenate([r, -away]), row

    @cached_property
    def on_every_row(self) -> Fit:
        """Of all measured rows, at the same parameters."""
        if np.array_equal(self.problem.used, self.problem.data.measured):
            return self
        every = self.problem.with_rows(self.problem.data.measured)
        model, samples = every.model(self.entries, every.kept)
        near = every.linearized(model, samples, self.theta)
        return replace(self, problem=every, model=model, samples=samples, near=near, squares=None)

    @property
    def _measured(self) -> FloatArray:
        """(m, F) whitened derivatives of the measured numbers."""
        J = columns_of(self.near, self.free)
        J /= self.problem.noise.factor
        return decorrelated(self.problem, J, self.near.row)

    @cached_property
    def freedom(self) -> float:
        """Degrees of freedom of the measured numbers: their count less the parameters that they determine.

        m - tr(J (J^T J + D^-2)^-1 J^T), D the deviations of priors and pulls.
        """
        hold = priors.held(self.prior, self.pull)[self.free]
        scaled = self.normal * np.outer(hold, hold)
        try:
            open_to_priors = float(np.sum(lapack.dtrtri(np.linalg.cholesky(scaled), lower=1)[0] ** 2))
        except np.linalg.LinAlgError:  # 1 + J^T J of scaled columns, whose eigenvalues rounding has put below 1
            open_to_priors = float(np.sum(1 / np.maximum(np.linalg.eigvalsh(scaled), 1.0)))
        determined = len(hold) - open_to_priors
        return max(len(self.near.r) - determined, 1.0)

    @cached_property
    def loads(self) -> FloatArray:
        """(N, n) load about or along each joint's axis [N m or N], in the settled state."""
        core = self.problem.start.robot
        theta = self.theta[: len(self.model.parameters)]
        loads = np.asarray(self.model.loads(self.samples, theta, False, self.problem.threads))
        axis = [5 if kind == "revolute" else 2 for kind in core.joint_types]
        return np.column_stack([loads[:, 2 * i + 1, axis[i]] for i in range(core.joint_count)])

    def corner_loads(self, share: float) -> FloatArray:
        """(n,) size of each joint's load below which this share of the rows stays."""
        if share not in self._corner_loads:
            self._corner_loads[share] = np.quantile(np.abs(self.loads), share, axis=0)
        return self._corner_loads[share]

    @cached_property
    def _corner_loads(self) -> dict[float, FloatArray]:
        return {}


def fit(problem: Problem, added: Sequence[Hypothesis], start: Fit | None = None, *, pulled: bool = False) -> Fit:
    """Levenberg-Marquardt from a fit of some of the same effects; each round brings the loads to equilibrium.

    With `pulled` the geometry is pulled to that of `start`: curves of joints take what it can't (`geometry_anchoring`).
    """
    added = tuple(added)
    start = None if problem.has_nominal_arm and start is not None and not start.problem.has_nominal_arm else start
    entries = problem.complete([name.entry for name in added])
    effects = problem.effects(entries)
    model, samples = problem.model(entries, problem.kept, effects)
    places = len(problem.unknowns)
    before = problem.unknowns if start is None or places == 0 else start.theta[-places:]
    theta = np.concatenate([first_guess(problem, entries, effects, model, start), before])
    centre = np.concatenate([carried(problem, entries, effects, model, None, corners=start), problem.unknowns])
    free = [*problem.geometry, *range(problem.own, len(theta))]
    no_bound = np.full(places, np.inf)
    lower = np.concatenate([[p.lower for p in model.parameters], -no_bound])[free]
    names = [p.name for p in model.parameters] + [""] * places
    critical = np.array([name.startswith("critical") for name in names])[free]
    factor = problem.noise.factor

    memory = _core.TwistMemory()

    def linearized(theta: FloatArray, *, columns: bool = True) -> Linearization:
        return problem.linearized(model, samples, theta, memory, columns=columns)

    def white(near: Linearization, values: FloatArray) -> FloatArray:
        return decorrelated(problem, values, near.row)

    def remaining(theta: FloatArray, near: Linearization) -> float:
        r = white(near, near.r) / factor
        away = (theta - centre)[free] / deviation
        return float(r @ r + away @ away)

    def products(near: Linearization, known: FloatArray | None = None) -> tuple[FloatArray, FloatArray, FloatArray]:
        """J, J^T J, which may be `known`, and J^T r of the free parameters."""
        J = white(near, columns_of(near, free))
        return J, gram(J) if known is None else known, J.T @ white(near, near.r)

    def stepped(
        theta: FloatArray, near: tuple[FloatArray, FloatArray, FloatArray], reach: float
    ) -> tuple[FloatArray, float]:
        """The next point, and by how much chi square would fall there if the rows were linear; `near`: `products`."""
        scale = size[free]
        J, normal, along = near
        g = -along * scale / factor**2 - (theta - centre)[free] * scale / deviation**2
        step = solved(J, normal, scale / factor, np.hypot(scale / deviation, 1 / reach), g)
        out = theta.copy()
        out[free] += step * scale
        index = np.array(free)[critical]
        out[index] = np.maximum(out[index], lower[critical])
        return out, float(step @ g)

    same = start if start is not None and start.is_of(problem, entries, theta) else None
    near = linearized(theta) if same is None else same.near
    work = near.J.size
    # Near a fold of closed loops columns grow without limit: sizes there would hold the arm to the file.
    nominal = _at_the_file(problem, near, lambda: linearized(centre))
    size = priors.plausible_sizes(problem, model, nominal)
    prior = np.concatenate([priors.of_effects(problem, entries, effects, model), no_bound])
    centre[np.isfinite(prior)] = 0.0
    prior = np.where(np.isfinite(prior), prior, rules.PRIOR_WIDTH * size)
    prior = np.minimum(prior, priors.widest(problem, model, nominal, entries, effects))
    pull = _pull_to(start, model, problem.own, centre) if pulled else np.full(len(theta), np.inf)
    deviation = priors.held(prior, pull)[free]
    best = remaining(theta, near), theta, near
    reach = most = MAX_STEP
    converged = has_failed = False
    begun, once, tried = products(near, None if same is None else same.squares), near.J.size, 0
    while not converged and tried < MAX_ITERATIONS:
        tried += 1
        there, gain = stepped(best[1], begun, reach)
        converged = gain < rules.CHI_SQUARE_TOLERANCE + CHI_SQUARE_SHARE * best[0]
        if converged:
            break
        near = linearized(there, columns=not has_failed)  # a step beside one that failed may fail as well
        work += once
        left = remaining(there, near)
        has_failed = left > best[0] * (1 + CHI_SQUARE_SHARE) + rules.CHI_SQUARE_TOLERANCE
        if has_failed:
            most = reach / 2
            reach /= 4  # shortens the step along what the data hardly show, such as a wrist's gauge, and nothing else
            continue
        near = near if near.J.size else linearized(there)
        converged = best[0] - left < rules.CHI_SQUARE_TOLERANCE + CHI_SQUARE_SHARE * left
        best, begun, reach = (left, there, near), products(near), min(2 * reach, most)
        most = min(_WIDER * most, MAX_STEP)  # a reach that failed is not tried again at once
    theta, fixed = best[1], (free, prior, pull, centre)
    return Fit(problem, added, entries, model, samples, theta, *fixed, best[0], best[2], converged, work, begun[1])


def _at_the_file(problem: Problem, near: Linearization, there: Callable[[], Linearization]) -> Linearization:
    """Where sizes are taken: with closed loops `there`, at the geometry of the file, else `near`."""
    return there() if problem.start.robot.passive else near


def _pull_to(start: Fit | None, model: _core.ErrorModel, own: int, centre: FloatArray) -> FloatArray:
    """(P,) deviations by which the `own` parameters of the arm are pulled to those of a fit, which `centre` becomes."""
    pull = np.full(len(centre), np.inf)
    if start is not None:
        pull[:own] = geometry_pulls(model)
        centre[:own] = np.where(np.isfinite(pull[:own]), start.theta[:own], centre[:own])
    return pull
