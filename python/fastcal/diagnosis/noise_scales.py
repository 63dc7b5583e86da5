# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Positions, orientations, lengths and tilts each have their own noise.

A tracker's points say nothing of how well its probe's orientations are known, and a kind that is whitened by the noise
of another weighs too much or too little in every fit and test (variance components; F. R. Helmert 1924). The first kind
with a unit of length has the `factor` of the noise, each other one a `scale` beside it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.robust_rows import RichFit
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import Kind, KindNoise, in_order, of_observation
from fastcal.measurements.observations import kind_of, sigma_field

# Relative change of a kind's noise that ends its estimate.
SCALE_CHANGE = 0.03


def first_kind(problem: Problem) -> _core.Observation:
    """The one that has no scale: the first with a unit of length, else the first."""
    observations = problem.measured.observations
    return next((of for of in observations if of.unit == "m"), observations[0])


def other_kinds(problem: Problem) -> list[str]:
    """Kinds of observation beside the one that has no scale."""
    kinds, first = map(kind_of, problem.measured.observations), kind_of(first_kind(problem))
    return list(dict.fromkeys(kind for kind in kinds if kind != first))


def rms_sigma(problem: Problem, of: _core.Observation | None = None) -> float:
    """Noise of a kind's numbers (of the first kind's), RMS over all rows: claims and common part together [m, rad]."""
    of = first_kind(problem) if of is None else of
    claims, noise = problem.data.table(sigma_field(kind_of(of))), problem.noise
    square = noise.common[_part(of)] ** 2 + (0.0 if claims is None else float(np.nanmean(claims**2)))
    return noise.factor * noise.scale.get(kind_of(of), 1.0) * float(np.sqrt(square))


def observation_of(problem: Problem, kind: Kind) -> _core.Observation:
    """The first of a kind; where nothing of it was measured, the first kind's."""
    observations = problem.measured.observations
    return next((of for of in observations if of_observation(of) == kind), first_kind(problem))


def numbers_of(of: _core.Observation) -> range:
    """Places of an observation's numbers among those of a row."""
    return range(of.first_number, of.first_number + len(of.components))


def sigmas(
    problem: Problem, row: NDArray[np.intp], number: NDArray[np.intp], of: _core.Observation | None = None
) -> FloatArray:
    """(m,) noise of numbers of a kind (the first) but for `factor`: each a `number` of its `row` of the data."""
    of = first_kind(problem) if of is None else of
    claims = problem.data.table(sigma_field(kind_of(of)))
    own = 0.0 if claims is None else claims.reshape(len(claims), -1)[row, number - of.first_number]
    size = np.hypot(own, problem.noise.common[_part(of)]) * problem.noise.scale.get(kind_of(of), 1.0)
    return np.asarray(size * np.ones(len(row)))


def with_own_scales(at: Fit, rich: RichFit) -> Noise:
    """The noise of a fit with a scale for each kind of which a rich model leaves more, or less, than of the first.

    By the mean squares of the two, where F (two-sided, ALPHA_NOISE) tells them apart, and from then on until it moves
    by less than SCALE_CHANGE; `at` is the fit behind `rich`.
    """
    others, noise = other_kinds(at.problem), at.problem.noise
    if not others:
        return noise
    kind = np.array([*at.problem.kinds, "prior"])[np.append(at.near.number, np.full(len(at.free), -1))]
    whole, whole_freedom = rich.of(~np.isin(kind, [*others, "prior"]))
    scale = dict(noise.scale)
    for other in others:
        own, freedom = rich.of(kind == other)
        if min(whole, own) <= 0 or min(whole_freedom, freedom) < 1:
            continue
        low, high = special.fdtri(freedom, whole_freedom, [rules.ALPHA_NOISE / 2, 1 - rules.ALPHA_NOISE / 2])
        by = float(np.sqrt(own / whole))
        is_told_apart = not low <= by**2 <= high
        still_moves = abs(np.log(by)) > SCALE_CHANGE
        is_rescaled = still_moves if other in scale else is_told_apart
        if is_rescaled:
            scale[other] = scale.get(other, 1.0) * by
    return noise if scale == noise.scale else replace(noise, scale=scale)


def with_others_kept(noise: Noise, problem: Problem, mean_square: float) -> Noise:
    """Another noise of the first kind for a problem: the others have what a rich model left of them.

    Args:
        noise: As it is to be, but for the others.
        problem: Whose noise the rich model was whitened with.
        mean_square: What it left. A claim of another kind that it bore out stays.
    """
    claimed = {kind_of(of) for of in problem.measured.observations if of.claims_sigma}
    by = problem.noise.factor * float(np.sqrt(mean_square)) / noise.factor
    before = problem.noise.scale
    moved = [kind for kind in other_kinds(problem) if kind in before or kind not in claimed]
    return replace(noise, scale={**noise.scale, **{kind: before.get(kind, 1.0) * by for kind in moved}})


def without_scales(problem: Problem) -> tuple[Dataset, tuple[float, float, float]]:
    """All rows with their claims, and the common part of the noise, with `factor` and `scale` multiplied in.

    Of several kinds with one common part, such as orientations and tilts without claims, it is that of the first.
    """
    data, noise = problem.data, problem.noise
    common, observed, claims = list(noise.common), dict(data.observed), dict[str, FloatArray]()
    kinds = {kind_of(of): of for of in reversed(problem.measured.observations)}
    for kind, of in kinds.items():
        own = noise.factor * noise.scale.get(kind, 1.0)
        common[_part(of)] = noise.common[_part(of)] * own
        name = sigma_field(kind)
        if name in observed:
            observed[name] = data.observed[name] * own
        elif data.table(name) is not None:
            claims[name] = getattr(data, name) * own
    scaled = replace(data, observed=observed, **claims)  # type: ignore[arg-type]
    return scaled, (common[0], common[1], common[2])


def noise_by_kind(problem: Problem, sigma: float, source: str = "residual") -> dict[str, KindNoise]:
    """The noise of each kind, by its name; `sigma` [m or rad] of the first kind, which has the source."""
    first, out = kind_of(first_kind(problem)), {}
    observations = {of_observation(of): of for of in reversed(problem.measured.observations)}
    for kind in in_order(observations):
        is_first = kind.name == first
        value = sigma if is_first else rms_sigma(problem, observations[kind])
        out[kind.name] = KindNoise(kind, value, source if is_first else "residual")
    return out


def others_note(problem: Problem) -> str:
    """The noise of the other kinds, in words; empty where there are none."""
    said = []
    for kind, of in {kind_of(of): of for of in problem.measured.observations}.items():
        if kind in other_kinds(problem):
            said.append(f"{kind} {of_observation(of).text(rms_sigma(problem, of))}")
    return ", ".join(said)


def _part(of: _core.Observation) -> int:
    """Which of `Noise.common` an observation has."""
    return 1 if of.unit == "rad" else 0 if of.field == "position" else 2
