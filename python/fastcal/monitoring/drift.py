# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How far a parameter moves between two measurements of an arm: gradually, and by an event such as a collision.

The sizes are those of industrial arms in service: a zero that was set again or slipped by a tooth of noise, a gear that
wears, a bent tool. A check asks for changes of any size; these only give what is likely beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass

from fastcal import _core
from fastcal.units import to_si


@dataclass(frozen=True)
class Drift:
    """Standard deviations of a parameter's change, SI.

    Attributes:
        gradual: Without an event: temperature, wear, the target put on again.
        event: By an event, typical.
    """

    gradual: float
    event: float


_ZERO = Drift(to_si(0.001, "deg"), to_si(0.02, "deg"))
_LENGTH = Drift(to_si(0.005, "mm"), to_si(0.1, "mm"))
_ANGLE = Drift(to_si(0.0005, "deg"), to_si(0.01, "deg"))
_TOOL = {"m": Drift(to_si(0.01, "mm"), to_si(0.2, "mm")), "rad": Drift(to_si(0.002, "deg"), to_si(0.05, "deg"))}
_EFFECT_SHARE = Drift(0.02, 0.1)  # of the parameter's value
_EFFECT_SIZE = Drift(0.005, 0.05)  # at least, of its plausible size
_NEW = 1.0  # plausible sizes of an effect that the model does not have
ZEROS = ("theta",)  # names of a joint's zero


def drift_of(parameter: _core.Parameter, value: float, *, geometry: bool) -> Drift:
    """How far a parameter with this value (SI) moves.

    Args:
        parameter: Its owner, name and unit.
        value: As the model has it.
        geometry: Is it a number of the arm's geometry or tool, and not of an effect?
    """
    if not geometry:
        size = abs(value)
        return Drift(
            max(_EFFECT_SHARE.gradual * size, _EFFECT_SIZE.gradual * parameter.sigma),
            max(_EFFECT_SHARE.event * size, _EFFECT_SIZE.event * parameter.sigma),
        )
    if parameter.owner == "tool":
        return _TOOL[parameter.unit]
    if parameter.name in ZEROS:
        return _ZERO
    return _LENGTH if parameter.unit == "m" else _ANGLE


def new_effect(parameter: _core.Parameter) -> float:
    """Typical size of an effect's parameter that the model does not have, SI."""
    return _NEW * parameter.sigma
