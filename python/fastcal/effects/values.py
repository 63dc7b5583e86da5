# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The parameters of effects as people read them: units, and amplitude and phase in place of sine and cosine.

The core's harmonic is linear, s sin x + c cos x; a file says amplitude >= 0 and phase of  amplitude sin(x + phase):
amplitude a = hypot(s, c), phase = atan2(c, s), their covariance by  d(a, phase) = T d(s, c),
T = [s/a, c/a; -c/a^2, s/a^2].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.effects.entries import Spec, edge_name, edge_unit, label, traits_of
from fastcal.errors import InvalidInput
from fastcal.units import factor, from_si, to_si

_POLAR = ("amplitude_rad", "phase_rad")


@dataclass(frozen=True)
class EdgeValue:
    """One number as people read it, in `unit`."""

    name: str
    unit: str
    value: float


def edge_values(entry: Spec, effect: _core.Effect, values: FloatArray) -> list[EdgeValue]:
    """An effect's parameters (p,) in SI as written in a file."""
    if traits_of(entry["effect"]).is_wave:
        return [EdgeValue(name, "rad", float(value)) for name, value in zip(_POLAR, _polar(values), strict=True)]
    out = []
    for parameter, value in zip(effect.parameters, values, strict=True):
        unit = edge_unit(parameter, geometry=False)
        out.append(EdgeValue(edge_name(parameter, geometry=False), unit, from_si(float(value), unit)))
    return out


@dataclass(frozen=True, eq=False)
class PolarPair:
    """A harmonic in the model's parameter vector.

    Attributes:
        indices: Of its sine and cosine; amplitude and phase take their places.
        names: Of amplitude and phase, with the order: amplitude_2x_rad.
        values: (2,) amplitude and phase.
        slope: (2, 2) their derivative by sine and cosine.
    """

    indices: list[int]
    names: list[str]
    values: FloatArray
    slope: FloatArray

    @staticmethod
    def polar_of(pair: FloatArray) -> FloatArray:
        """Amplitude and phase of a sine and a cosine."""
        return _polar(pair)


def polar_pairs(
    entries: Sequence[Spec], effects: Sequence[_core.Effect], first: int, theta: FloatArray
) -> list[PolarPair]:
    """All harmonics of a model that have a size; `first` is where the effects' parameters begin in theta."""
    out = []
    for entry, effect in zip(entries, effects, strict=True):
        indices = list(range(first, first + len(effect.parameters)))
        first += len(indices)
        if traits_of(entry["effect"]).is_wave and theta[indices].any():
            order = effect.parameters[0].name.removeprefix("sine_")
            names = [name.replace("_rad", f"_{order}_rad") for name in _POLAR]
            out.append(PolarPair(indices, names, _polar(theta[indices]), _polar_slope(theta[indices])))
    return out


def _polar(pair: FloatArray) -> FloatArray:
    sine, cosine = pair
    return np.array([math.hypot(sine, cosine), math.atan2(cosine, sine)])


def _polar_slope(pair: FloatArray) -> FloatArray:
    """T above; NaN where there is no size and so no phase."""
    sine, cosine = pair
    size = math.hypot(sine, cosine)
    if size == 0:
        return np.full((2, 2), np.nan)
    return np.array([[sine / size, cosine / size], [-cosine / size**2, sine / size**2]])


def parameter_values(entry: Spec, effect: _core.Effect) -> list[float]:
    """SI values of an effect's parameters, in the core's order; 0 where the entry gives none."""
    given = {name: v["value"] if isinstance(v, dict) else v for name, v in (entry.get("parameters") or {}).items()}
    for option in traits_of(entry["effect"]).among_parameters:
        given.pop(option, None)
    if traits_of(entry["effect"]).is_wave:
        _refuse_unknown(entry, given, list(_POLAR))
        amplitude, phase = (float(given.get(name, 0.0)) for name in _POLAR)
        return [amplitude * math.cos(phase), amplitude * math.sin(phase)]
    names = {edge_name(p, geometry=False): p for p in effect.parameters}
    _refuse_unknown(entry, given, list(names))
    units = [edge_unit(parameter, geometry=False) for parameter in effect.parameters]
    return [to_si(float(given.get(name, 0.0)), unit) for name, unit in zip(names, units, strict=True)]


def written_parameters(entry: Spec, effect: _core.Effect, values: FloatArray, covariance: FloatArray) -> Spec:
    """The key `parameters` of an identified entry: `{name: {value, std}}`; std None if held or on a bound.

    Args:
        entry: The effect as in the robot file.
        effect: The same as the core has it.
        values: (p,) SI.
        covariance: (p, p) SI; NaN in rows and columns of parameters that were held.
    """
    out: Spec = {}
    for option in traits_of(entry["effect"]).among_parameters:
        given = (entry.get("parameters") or {}).get(option, entry.get(option))
        if given is not None:
            out[option] = given if isinstance(given, dict) else {"value": float(given), "std": 0.0}
    if traits_of(entry["effect"]).is_wave:
        slope = _polar_slope(values)
        covariance = slope @ covariance @ slope.T
    spread = np.sqrt(np.diag(covariance))
    if not traits_of(entry["effect"]).is_wave:
        bounded = [value in (p.lower, p.upper) for p, value in zip(effect.parameters, values, strict=True)]
        spread = np.where(bounded, np.nan, spread)
    for item, std in zip(edge_values(entry, effect, values), spread, strict=True):
        out[item.name] = {"value": item.value, "std": None if np.isnan(std) else float(std) / factor(item.unit)}
    return out


def _refuse_unknown(entry: Spec, given: dict[str, Any], names: list[str]) -> None:
    for name in given:
        if name not in names:
            raise InvalidInput(f"{label(entry)}: parameter '{name}' is not known; there are {', '.join(names)}")
