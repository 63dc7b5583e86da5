# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The only table of units: x_si = x * numerator / denominator + offset.

Inside fastcal everything is SI; a name at an edge (column, key, flag) ends in its unit, `x_mm`, `compliance_rad_nm`.
The factor is kept as a fraction so that 9 mm is read as the double nearest to 0.009 m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import NDArray

from fastcal.errors import InvalidInput


@dataclass(frozen=True)
class Unit:
    """A unit by the name it has at the edges.

    Attributes:
        name: As it ends a name, such as `mm` or `rad_nm` (radian a newton metre).
        kind: What it measures; units of one kind convert into each other.
        numerator, denominator: Their quotient is the SI value of one unit.
        offset: The SI value of zero.
    """

    name: str
    kind: str
    numerator: float = 1.0
    denominator: float = 1.0
    offset: float = 0.0


UNITS: dict[str, Unit] = {
    unit.name: unit
    for unit in (
        Unit("1", "number"),
        Unit("m", "length"),
        Unit("mm", "length", 1, 1000),
        Unit("um", "length", 1, 1_000_000),
        Unit("in", "length", 254, 10_000),
        Unit("rad", "angle"),
        Unit("mrad", "angle", 1, 1000),
        Unit("deg", "angle", math.pi, 180),
        Unit("px", "pixel"),
        Unit("kg", "mass"),
        Unit("g", "mass", 1, 1000),
        Unit("n", "force"),
        Unit("nm", "torque"),
        Unit("a", "current"),
        Unit("c", "temperature", offset=273.15),
        Unit("f", "temperature", 5, 9, offset=459.67 * 5 / 9),
        Unit("k", "temperature"),
        Unit("s", "time"),
        Unit("m_s", "speed"),
        Unit("mm_s", "speed", 1, 1000),
        Unit("rad_s", "angular speed"),
        Unit("deg_s", "angular speed", math.pi, 180),
        Unit("m_s2", "acceleration"),
        Unit("n_m", "stiffness"),
        Unit("rad_nm", "angle per torque"),
        Unit("m_n", "length per force"),
        Unit("rad_a", "angle per current"),
        Unit("m_a", "length per current"),
        Unit("m_k", "length per temperature"),
        Unit("rad_k", "angle per temperature"),
        Unit("1_k", "number per temperature"),
        Unit("1_nm2", "inverse bending stiffness"),
        Unit("rad_rad", "angle per angle"),
        Unit("m_m", "length per length"),
        Unit("rad_m", "angle per length"),
        Unit("1_rad", "number per angle"),
        Unit("1_rad2", "number per angle squared"),
        Unit("1_m", "number per length"),
        Unit("1_m2", "number per length squared"),
        Unit("kg_m", "first moment of mass"),
        Unit("kg_m2", "inertia"),
        Unit("m2", "area"),
        Unit("m4", "second moment of area"),
        Unit("pa", "pressure"),
    )
}


@dataclass(frozen=True)
class ShopUnit:
    """A unit that people on the floor speak and no file is written in: x_si = x * numerator / denominator."""

    text: str
    numerator: float = 1.0
    denominator: float = 1.0

    @overload
    def of(self, value: float) -> float: ...
    @overload
    def of(self, value: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def of(self, value: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
        """An SI value, or an array of any shape, in this unit."""
        return value * self.denominator / self.numerator


_NBSP = "\N{NO-BREAK SPACE}"
_SHOP_UNITS: dict[str, tuple[ShopUnit, ...]] = {  # by SI unit, the finest first
    "1": (ShopUnit("ppm", 1, 1_000_000), ShopUnit("%", 1, 100)),
    "m": (ShopUnit("\N{MICRO SIGN}m", 1, 1_000_000), ShopUnit("mm", 1, 1000)),
    "rad": (ShopUnit("arcsec", math.pi, 648_000), ShopUnit("arcmin", math.pi, 10_800), ShopUnit("°", math.pi, 180)),
    "m_s": (ShopUnit("\N{MICRO SIGN}m/h", 1, 3_600_000_000), ShopUnit("mm/h", 1, 3_600_000)),
    "rad_s": (ShopUnit("arcsec/h", math.pi, 648_000 * 3600),),
    "rad_nm": (
        ShopUnit(f"arcsec/(kN{_NBSP}m)", math.pi, 648_000_000),
        ShopUnit(f"arcmin/(kN{_NBSP}m)", math.pi, 10_800_000),
    ),
    "rad_a": (ShopUnit("arcsec/A", math.pi, 648_000),),
    "rad_k": (ShopUnit("arcsec/K", math.pi, 648_000),),
    "m_n": (ShopUnit("\N{MICRO SIGN}m/N", 1, 1_000_000),),
    "m_a": (ShopUnit("\N{MICRO SIGN}m/A", 1, 1_000_000),),
    "m_k": (ShopUnit("\N{MICRO SIGN}m/K", 1, 1_000_000),),
    "1_k": (ShopUnit(f"\N{MICRO SIGN}m/(m{_NBSP}K)", 1, 1_000_000),),
    "n_m": (ShopUnit("N/mm", 1000, 1),),
    "1_nm2": (ShopUnit(f"1/(GN{_NBSP}m²)", 1, 1_000_000_000), ShopUnit(f"1/(MN{_NBSP}m²)", 1, 1_000_000)),
}


def shop_unit(unit: str, size: float) -> ShopUnit:
    """The unit in which people speak of SI values up to `size`: the coarsest in which it is at least 1."""
    found = _SHOP_UNITS.get(unit, (ShopUnit(unit),))
    return next((u for u in reversed(found) if abs(u.of(size)) >= 1), found[0])


def unit_names(kind: str) -> list[str]:
    """The names of all units of a kind, SI first where it has one."""
    return [unit.name for unit in UNITS.values() if unit.kind == kind]


def parse_name(name: str) -> tuple[str, str | None]:
    """Splits `rate_x_mm_s` into ("rate_x", "mm_s") by the longest known unit; ("name", None) where there is none."""
    for start, letter in enumerate(name):
        if letter == "_" and start > 0:
            tail = name[start + 1 :].lower()
            if tail in UNITS and tail != "1":
                return name[:start], tail
    return name, None


@overload
def to_si(value: float, unit: str) -> float: ...
@overload
def to_si(value: NDArray[np.float64], unit: str) -> NDArray[np.float64]: ...
def to_si(value: float | NDArray[np.float64], unit: str) -> float | NDArray[np.float64]:
    """A value, or an array of any shape, given in `unit`, in SI (temperatures in kelvin)."""
    u = _unit(unit)
    return value * u.numerator / u.denominator + u.offset


@overload
def from_si(value: float, unit: str) -> float: ...
@overload
def from_si(value: NDArray[np.float64], unit: str) -> NDArray[np.float64]: ...
def from_si(value: float | NDArray[np.float64], unit: str) -> float | NDArray[np.float64]:
    """A value, or an array of any shape, given in SI, in `unit`."""
    u = _unit(unit)
    return (value - u.offset) * u.denominator / u.numerator


def factor(unit: str) -> float:
    """The SI size of one unit: what converts differences, standard deviations and slopes (no offset)."""
    u = _unit(unit)
    return u.numerator / u.denominator


def _unit(name: str) -> Unit:
    try:
        return UNITS[name]
    except KeyError:
        raise InvalidInput(f"unit '{name}' is not known; known are {', '.join(UNITS)}") from None
