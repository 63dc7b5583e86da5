# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Empirical Bayes prior of the geometry: it is held near nominal with a strength estimated from the measurements.

Few poses or a coarse instrument leave a free fit of the geometry farther from the truth than the nominal arm is. So the
arm's errors x, in plausible sizes, are taken as drawn from N(0, s^2), and s is estimated: a free fit finds x with the
covariance C (base, tool and effects besides, as they are), so the deviations found are N(0, C + s^2) and say how likely
each s is (empirical Bayes: B. Efron, C. Morris 1975; with base and tool integrated out it is the restricted likelihood
of D. Harville 1977). Of s only its order of magnitude is taken as known, evenly within LEAST to MOST plausible sizes;
the mean of s^2 is used, which does not vanish where the data cannot tell s from 0.

With the eigenvalues of C, c_i, the fit no longer spends  sum c_i / (s^2 + c_i)  parameters on noise. Where these are a
small share of all, poses are rich: nothing is held, and the fit is the free one.

C rests on the model of the noise. Numbers of a pose that err together, such as a camera's, look like errors of the arm.
So s must also predict: of all s that one is sought with which each pose is best predicted by the others (the ridge's
closed form: D. Allen 1974), touches of an unknown place by those of other places (`touched_places`), and the smaller of
the two holds the fit. Stated deviations are those of a fit held by the smaller of arms that are off by the larger:
K = C (C + s^2)^-1 is what is taken back of the deviations found, and (1 - K) C (1 - K)^T + K s_larger^2 K^T its
covariance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import BoolArray, FloatArray, IndexArray, IntArray
from fastcal.calibration.consensus import GROSS
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.touched_places import beside_own, touched_places

LEAST, MOST = 0.01, 30.0  # plausible sizes: ten micrometres to three centimetres
_STEPS = 32
_MOST_NUMBERS = 3000  # measured: of more no pose is held out
_FREE = 1e4  # plausible sizes: base, tool and effects are anywhere
WORTH = 0.1  # of the parameters' share in the noise of a prediction: less is not worth a second fit


@dataclass(frozen=True, eq=False)
class Shrinkage:
    """How the geometry is held.

    Attributes:
        size: The arm's errors (RMS), by which it is held, in plausible sizes.
        variances: (k,) eigenvalues of C.
        mean, deviations: (P,) of theta: where each parameter is held, and by which standard deviation, SI; inf: free.
        off: (P,) by which standard deviation it is off, as far as is known: no less.
    """

    size: float
    variances: FloatArray
    mean: FloatArray
    deviations: FloatArray
    off: FloatArray

    @property
    def spared(self) -> float:
        """Parameters that are no longer spent on noise."""
        return float(np.sum(self.variances / (self.variances + self.size**2)))

    def eased(self) -> Shrinkage:
        """Held half as firmly."""
        size = 2 * self.size
        off = np.maximum(self.off, 2 * self.deviations)
        return replace(self, size=size, deviations=2 * self.deviations, off=off)

    @property
    def pull(self) -> dict[str, FloatArray]:
        """Options of `CalibrationProblem.identify`: what is told of identifiability stays that of a free fit."""
        return {"pull_mean": self.mean, "pull_sigma": self.deviations}

    def posterior(self, covariance: FloatArray, free: list[int], freedom: float) -> tuple[FloatArray, float, float]:
        """The (p, p) covariance of the held fit, the factor of its noise, and its degrees of freedom.

        Args:
            covariance: (p, p) of the free parameters as the measurements alone fix them, where the fit came to.
            free: Their indices in theta.
            freedom: Degrees of freedom of a free fit, by which its noise was found; this one spends `spared` fewer.
        """
        noise = float(np.sqrt(freedom / (freedom + self.spared))) if freedom > 0 else 1.0
        own = covariance * noise**2
        held = np.flatnonzero(np.isfinite(self.deviations[free]))
        both = own[np.ix_(held, held)] + np.diag(self.deviations[free][held] ** 2)
        back = np.linalg.solve(both, own[held]).T
        left = np.eye(len(own))
        left[:, held] -= back
        out = left @ own @ left.T + (back * self.off[free][held] ** 2) @ back.T
        return (out + out.T) / 2, noise, freedom + self.spared

    @property
    def note(self) -> str:
        """A sentence for a reader."""
        return (
            f"few measurements for the errors that remain: the arm's parameters are held near the robot file's, as far "
            f"as these are off ({self.size:.2g} mm and mrad, RMS, by the measurements); without that: --no-priors"
        )


def shrinkage(problem: CalibrationProblem, found: _core.Identification) -> Shrinkage | None:
    """How to hold the geometry near nominal; None where the data fix it well enough without, or it was not asked for.

    Args:
        problem: What was fitted.
        found: Its free fit.
    """
    parameters, free = problem.parameters, list(found.free)
    own = len(problem.model.robot.nominal)
    arm = [k for k, i in enumerate(free) if i < own and parameters[i].owner not in ("base", "tool")]
    if found.status != "converged" or len(arm) < 2:
        return None
    indices = [free[k] for k in arm]
    size = np.array([parameters[i].sigma for i in indices])
    off = (np.asarray(found.theta) - start_of(problem))[indices] / size
    C = np.asarray(found.covariance)[np.ix_(arm, arm)] / np.outer(size, size)
    known, spared = errors_size(off, C)
    places = touched_places(problem.data, problem.measured)
    if places is None and spared < WORTH * len(free):
        return None
    s = min(known, predicting_size(problem, found, np.isin(np.arange(len(free)), arm), places))
    values = np.maximum(np.linalg.eigvalsh(C), 0.0)
    if np.sum(values / (values + s**2)) < WORTH * len(free):
        return None
    sizes = np.full(len(found.theta), np.inf)
    for i in range(own):
        if parameters[i].owner not in ("base", "tool"):
            sizes[i] = parameters[i].sigma
    mean = start_of(problem)
    return Shrinkage(s, values, mean, s * sizes, known * sizes)


def errors_size(off: FloatArray, covariance: FloatArray) -> tuple[float, float]:
    """The arm's errors s (RMS) and the parameters that holding them so spares; all in plausible sizes.

    Args:
        off: (k,) how far a free fit puts each parameter off nominal.
        covariance: (k, k) of these.
    """
    values, vectors = np.linalg.eigh(covariance)
    values = np.maximum(values, 0.0)
    along = vectors.T @ off
    tried = np.geomspace(LEAST, MOST, _STEPS)
    spread = values + tried[:, np.newaxis] ** 2
    cost = 0.5 * np.sum(along**2 / spread + np.log(spread), axis=1)
    weight = np.exp(cost.min() - cost)
    square = float(weight @ tried**2 / weight.sum())
    return float(np.sqrt(square)), float(np.sum(values / (values + square)))


def start_of(problem: CalibrationProblem) -> FloatArray:
    """(P,) theta of the nominal arm, base and tool fitted, and where the observations' unknowns start."""
    return np.append(problem.model.start, problem.alignment.unknowns)


def predicting_size(
    problem: CalibrationProblem, found: _core.Identification, arm: BoolArray, places: IndexArray | None = None
) -> float:
    """The s with which points (where there are none: all numbers) of each pose are best predicted by the other poses.

    `arm` (p,) says which of the free parameters are held. Where rows touch unknown `places` (N,), those of each place
    are predicted by the others. Infinite where there are too many rows to hold each out.
    """
    near = problem.linearize(start_of(problem), found.common_noise)
    free, row = list(found.free), np.asarray(near.row, dtype=np.int64)
    every = problem.parameters
    size = np.array([every[i].sigma if i < len(every) else 1.0 for i in free])
    J, residual, number = np.asarray(near.J)[:, free], np.asarray(near.r), np.asarray(near.number, dtype=np.int64)
    if places is not None:
        used = (places[row] >= 0) & ~np.isin(row, _gross(problem, found))
        of_place = np.array(free) >= len(every)
        return _predicting_other_places((J * size)[used], residual[used], places[row][used], arm, of_place)
    count = np.bincount(row)
    width = int(np.bincount(count[count > 0]).argmax())
    used = (count[row] == width) & ~np.isin(row, _gross(problem, found))
    if not 0 < used.sum() <= _MOST_NUMBERS:
        return np.inf
    A = (J * size)[used].reshape(-1, width, len(free))
    r = residual[used].reshape(-1, width)
    judged = number[used].reshape(-1, width)[0] < 3
    judged = judged if judged.any() and problem.data.position is not None else np.ones(width, dtype=bool)
    normal, slope = np.einsum("nci,ncj->ij", A, A), np.einsum("nci,nc->i", A, r)
    tried = np.geomspace(LEAST, MOST, _STEPS)
    left = []
    for s in tried:
        inverse = np.linalg.inv(normal + np.diag(np.where(arm, s**-2.0, _FREE**-2.0)))
        of_all = r - A @ (inverse @ slope)
        shares = np.eye(width) - np.einsum("nci,ij,ndj->ncd", A, inverse, A, optimize=True)
        without = np.linalg.solve(shares, of_all[..., np.newaxis])[..., 0]
        left.append(float(np.mean(without[:, judged] ** 2)))
    return float(tried[np.argmin(left)])


def _predicting_other_places(
    J: FloatArray, residual: FloatArray, place: IndexArray, arm: BoolArray, of_place: BoolArray
) -> float:
    """The s with which the touches of each place are best predicted by those of the others.

    `of_place` (p,) says which of the free parameters are unknowns of places.
    """
    if not 0 < len(residual) <= _MOST_NUMBERS:
        return np.inf
    parts = []
    for k in np.unique(place):
        own = J[place == k][:, of_place]
        beside = beside_own(np.column_stack([J[place == k], residual[place == k]]), own)
        parts.append((beside[:, :-1][:, ~of_place], beside[:, -1]))
    normal, slope = sum(A.T @ A for A, _ in parts), sum(A.T @ r for A, r in parts)
    tried = np.geomspace(LEAST, MOST, _STEPS)
    left = []
    for s in tried:
        prior = np.diag(np.where(arm[~of_place], s**-2.0, _FREE**-2.0))
        steps = [np.linalg.solve(normal - A.T @ A + prior, slope - A.T @ r) for A, r in parts]
        left.append(sum(float(np.sum((r - A @ x) ** 2)) for (A, r), x in zip(parts, steps, strict=True)))
    return float(tried[np.argmin(left)])


def _gross(problem: CalibrationProblem, found: _core.Identification) -> IntArray:
    """Outliers that are no large noise: they would decide alone what predicts."""
    near = problem.linearize(np.asarray(found.theta), found.common_noise)
    row, residual = np.asarray(near.row, dtype=np.int64), np.asarray(near.r)
    far = np.sqrt(np.bincount(row, residual**2) / np.maximum(np.bincount(row), 1))
    out = np.asarray(found.outliers, dtype=np.int64)
    return out[far[out] > GROSS]
