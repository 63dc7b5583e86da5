# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The noise of each kind of reading that a fit found, and where it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fastcal import _core
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import Kind, KindNoise, in_order, of_observation
from fastcal.measurements.observations import sigma_field
from fastcal.units import UNITS


def noise_by_kind(measured: _core.Measurements, found: _core.Identification) -> dict[str, KindNoise]:
    """Standard deviation of a number of each kind, RMS over its rows and instruments, by the kind's name."""
    out = {}
    for kind in in_order({of_observation(of) for of in measured.observations if not of.is_known}):
        own = [k for k, of in enumerate(measured.observations) if of_observation(of) == kind and not of.is_known]
        sigma = np.array([found.sigma[k] for k in own])
        if not (sigma > 0).any():
            continue
        source, note = _source(measured, found, own[0])
        out[kind.name] = KindNoise(kind, float(np.sqrt(np.mean(sigma[sigma > 0] ** 2))), source, note)
    return out


def noise_source(data: Dataset, kind: Kind) -> str:
    """Whether the noise of new rows is their own claim, or what a calibration's residuals had."""
    return "column" if data.table(sigma_field(kind.name)) is not None else "residual"


def length_noise(noise: Mapping[str, KindNoise]) -> float | None:
    """[m] of the first kind that is a length, positions first; None where there is none."""
    return next((of.value for of in noise.values() if UNITS[of.kind.unit].kind == "length"), None)


def scaled(noise: Mapping[str, KindNoise], by: float) -> dict[str, KindNoise]:
    """All of them times a factor."""
    return {name: replace(of, value=of.value * by) for name, of in noise.items()}


def noise_record(noise: Mapping[str, KindNoise]) -> dict[str, tuple[float, str]]:
    """Value and unit of each, as a model keeps them."""
    return {name: (of.kind.shown(of.value), of.kind.unit) for name, of in noise.items()}


def _source(measured: _core.Measurements, found: _core.Identification, k: int) -> tuple[str, str]:
    """Where the noise of an observation comes from: a word, and words for a reader."""
    observation = measured.observations[k]
    if not observation.claims_sigma:
        return "residual", "estimated from the residuals; no sigma column"
    kind = of_observation(observation)
    if found.common_noise[k] > 0:
        common = kind.text(found.common_noise[k])
        return "residual", f"the sigma columns and a common part of {common} that they do not explain"
    return "column", f"the sigma columns times {found.variance_factor**0.5:.3f}, by the residuals"
