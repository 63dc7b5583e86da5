# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Kinds of reading: each has a name, a unit that people read it in, and errors and noise of its own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from fastcal import _core
from fastcal.measurements.observations import kind_of
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.measurements.dataset import Dataset

POINTS = "position"  # whose figures are also those of the keys that end in _mm
POSE = (POINTS, "orientation")  # what is measured of the tool's pose itself, without unknowns of its own
_SHOWN = {"length": "mm", "angle": "deg"}  # by quantity; any other is shown as files write it


@dataclass(frozen=True)
class Kind:
    """A kind of reading as its entry in the registry of observations has it.

    Attributes:
        name: "position", "tilt".
        plural: "positions", "inclinations".
        unit: Of its errors, as people read them: "mm", "deg".
    """

    name: str
    plural: str
    unit: str

    def shown(self, value: float) -> float:
        """An error in SI in the kind's unit."""
        return from_si(float(value), self.unit)

    def text(self, value: float, digits: int = 4) -> str:
        """An error in SI in words: "0.0312 mm"."""
        return f"{self.shown(value):.{digits}f} {self.unit}"


@cache
def kind_named(name: str) -> Kind:
    """A kind of the registry by its name."""
    entry = _core.observation_entry(name)
    field = next(field for field in entry.fields if field.quantity)
    return Kind(name, entry.plural, _SHOWN.get(field.quantity, field.written_unit))


def of_observation(observation: _core.Observation) -> Kind:
    """The kind that an observation is of: a level on link 3 reads tilts."""
    return kind_named(kind_of(observation))


def kinds_in(data: Dataset) -> list[Kind]:
    """Those that a data set has, positions first."""
    return in_order(map(kind_named, data.kinds))


def in_order(kinds: Iterable[Kind]) -> list[Kind]:
    """Positions first, then by name: the first of them is the one that a page's headline speaks of."""
    return sorted(kinds, key=lambda kind: (kind.name != POINTS, kind.name))


@dataclass(frozen=True)
class KindNoise:
    """The noise of one number of a kind.

    Attributes:
        value: Standard deviation, SI.
        source: residual, column, repeats or option.
        note: Where it comes from, in words.
    """

    kind: Kind
    value: float
    source: str
    note: str = ""

    def to_json_dict(self) -> dict[str, float | str]:
        """An entry of `noise` in result.json."""
        return {"value": self.kind.shown(self.value), "unit": self.kind.unit, "source": self.source}

    def __str__(self) -> str:
        return self.kind.text(self.value)


def noise_in_mm(noise: Mapping[str, KindNoise]) -> float | None:
    """Of points, or of the lengths that were measured in their place; None where neither was."""
    of = noise.get(POINTS) or next(iter(noise.values()), None)
    return of.kind.shown(of.value) if of is not None and of.kind.unit == "mm" else None


@dataclass(frozen=True)
class KindMisfit:
    """A kind that does not belong to the arm or to the other kinds, and why, in a sentence."""

    kind: Kind
    text: str
