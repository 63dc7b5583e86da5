# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The payload at each target of a program: what its user says, else what the program itself states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.compensation.places import Places
from fastcal.programs import carried, stated_masses
from fastcal.said import first_few, joined, said
from fastcal.units import from_si

_FEEL = 1e-9  # [m] by which a payload has to move the tool to be felt
_PROBE = 1.0  # [kg] at least, to see whether it is
_SHOWN = 3  # targets that a sentence names


@dataclass(frozen=True)
class Payloads:
    """Payloads of targets.

    Attributes:
        mass: (N,) that each is corrected for [kg]: of several the greatest.
        least: (N,) the least that it is passed with [kg].
        assumed: What the program does not say and is taken for granted, a sentence each.
        notes: What else to know, a sentence each.
    """

    mass: FloatArray
    least: FloatArray
    assumed: tuple[str, ...] = ()
    notes: tuple[str, ...] = field(default=())


def payloads(places: Places, q: FloatArray, conditions: dict[str, Any]) -> Payloads:
    """Payloads of the targets at joints q (N, n); a `payload` among the conditions holds for the whole program.

    The program's are the masses on the flange that RAPID (tooldata, GripLoad), KRL ($LOAD, LOAD_DATA), FANUC (PAYLOAD)
    and URScript (set_payload) state on the way to a target. Where nothing is known of them, 0 kg are taken.
    """
    program, given = places.program, conditions.get("payload")
    stated, found = stated_masses(program, places.cell.loads), carried(program, places.cell.loads)
    if given is not None:
        mass = np.full(len(q), float(given))
        differs = stated and stated != (float(given),)
        text = said(
            "{given:.4g} kg are taken as the payload, as asked for; the program states {stated}",
            given=float(given),
            stated=kilograms(stated),
        )
        return Payloads(mass, mass, notes=(text,) if differs else ())
    mass = np.array([max(each.masses, default=0.0) for each in found])
    least = np.array([min(each.masses, default=0.0) for each in found])
    if not _is_felt(places, q, conditions, max((_PROBE, *stated))):
        note = said(
            "the program states a payload of {stated}; this model does not depend on it", stated=kilograms(stated)
        )
        return Payloads(mass, least, notes=(note,) if stated and stated[-1] > 0 else ())
    assumed, notes = [], []
    if stated:
        notes.append(said("payload as the program states it: {stated}", stated=kilograms(stated)))
    for why in dict.fromkeys(why for each in found for why in each.unknown):
        of = [i for i, each in enumerate(found) if why in each.unknown]
        taken = tuple(sorted(set(mass[of].tolist())))
        assumed.append(
            said(
                "{why}: for {targets} {taken} are taken; a payload for the whole program or a cell file decides",
                why=why,
                targets=_named(places, of),
                taken=kilograms(taken),
            )
        )
    silent = [i for i, each in enumerate(found) if not each.masses and not each.unknown]
    if stated and silent:
        notes.append(
            said("the program states no payload for {targets}: 0 kg are taken", targets=_named(places, silent))
        )
    return Payloads(mass, least, tuple(assumed), tuple(notes))


def left_by_other_loads(
    places: Places, found: Payloads, q_nominal: FloatArray, q: FloatArray, conditions: dict[str, Any]
) -> list[str]:
    """A sentence on the targets that are passed with several payloads and corrected for the greatest."""
    of = np.flatnonzero(found.least < found.mass).tolist()
    got = places.robot.forward(q, **(conditions | {"payload": found.least}))
    wanted = places.nominal.forward(q_nominal)
    left = [float(np.linalg.norm((places.tool_at(i, got[i]) - places.tool_at(i, wanted[i]))[:3, 3])) for i in of]
    if max(left, default=0.0) < _FEEL:
        return []
    return [
        said(
            "{targets}: passed with more than one payload and corrected for the greatest; with the least at most "
            "{left:.3f} mm are left",
            targets=_named(places, of),
            left=float(from_si(max(left), "mm")),
        )
    ]


def kilograms(masses: Sequence[float]) -> str:
    """Masses [kg] as a list in words."""
    return joined(", ", [said("{mass:.4g} kg", mass=float(mass)) for mass in masses])


def _named(places: Places, of: Sequence[int]) -> str:
    """The first of some targets by name, and how many more there are."""
    return first_few([places.program.targets[i].name for i in of], _SHOWN)


def _is_felt(places: Places, q: FloatArray, conditions: dict[str, Any], mass: float) -> bool:
    """Does the model move its tool by a payload of this mass at any of the targets?"""
    ends = [places.robot.forward(q, **(conditions | {"payload": load}))[:, :3, 3] for load in (0.0, mass)]
    return bool(np.abs(ends[1] - ends[0]).max(initial=0.0) > _FEEL)
