# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a program says that the arm carries: all that hangs on the flange, by the names of loads and their masses."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from fastcal.programs.program import Program
from fastcal.said import said


@dataclass(frozen=True)
class Carried:
    """What a target is passed with.

    Attributes:
        masses: Those that are known [kg], from the least; more than one where its moves differ, or the run decides.
        unknown: Why others are not known, the end of a sentence each.
    """

    masses: tuple[float, ...] = ()
    unknown: tuple[str, ...] = ()


def carried(program: Program, given: Mapping[str, float]) -> list[Carried]:
    """What each target is passed with; `given`: masses [kg] by name, which come before the program's own."""
    uses: dict[int, set[str | None]] = {}
    for move in program.moves:
        uses.setdefault(move.target, set()).update(move.loads)
    return [_carried(program, given, uses.get(i, ())) for i in range(len(program.targets))]


def stated_masses(program: Program, given: Mapping[str, float]) -> tuple[float, ...]:
    """All masses [kg] that moves of a program are made with, as far as they are known, from the least."""
    return tuple(sorted({mass for each in carried(program, given) for mass in each.masses}))


def _carried(program: Program, given: Mapping[str, float], names: Iterable[str | None]) -> Carried:
    own = {name.lower(): mass for name, mass in given.items()}
    masses, unknown = set(), []
    for name in sorted(name for name in names if name is not None):
        mass, why = _mass(program, own, name)
        if why:
            unknown.append(why)
        else:
            masses.add(mass)
    return Carried(tuple(sorted(masses)), tuple(dict.fromkeys(unknown)))


def _mass(program: Program, given: Mapping[str, float], name: str) -> tuple[float, str]:
    """The mass of a load [kg], and why it is not known."""
    key = name.lower()
    if key in given:
        return given[key], ""
    if ("load", key) in program.doubts:
        return math.nan, program.doubts["load", key]
    found = program.loads.get(key)
    if found is None:
        return math.nan, said("the mass of load {name} is not in the program", name=name)
    if isinstance(found, tuple):
        parts = [_mass(program, given, part) for part in found]
        return sum(mass for mass, _why in parts), next((why for _mass_of, why in parts if why), "")
    return found, ""
