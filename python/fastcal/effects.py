# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects as they stand in a robot file or on the command line, and as the core builds them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from fastcal import _core
from fastcal.errors import InvalidInput
from fastcal.units import from_si, to_si

Spec = dict[str, Any]

_GEOMETRY_UNITS = {"m": "mm", "rad": "deg"}  # what a table of a robot is written in
_EFFECT_UNITS = {"m": "mm", "m_s": "mm_s"}  # an effect's angles stay in radian, as its compliances are


def edge_unit(parameter: _core.Parameter, *, geometry: bool) -> str:
    """The unit in which a parameter is written for people."""
    return (_GEOMETRY_UNITS if geometry else _EFFECT_UNITS).get(parameter.unit, parameter.unit)


def edge_name(parameter: _core.Parameter, *, geometry: bool) -> str:
    """The name with its unit at the end, such as theta_deg, compliance_rad_nm, rad_nm or error."""
    unit = edge_unit(parameter, geometry=geometry)
    return "_".join(part for part in (parameter.name, "" if unit == "1" else unit) if part)


def effect_from_spec(entry: Spec, core: _core.RobotModel) -> _core.Effect:
    """The core's effect of one entry of a robot file's `effects`."""
    return _core.make_effect(entry["effect"], core, entry["owner"], options_of(entry))


def options_of(entry: Spec) -> Spec:
    """What an entry says beside its name, owner and parameters: the effect's options."""
    return {key: value for key, value in entry.items() if key not in ("effect", "owner", "parameters")}


def parameter_values(entry: Spec, effect: _core.Effect) -> list[float]:
    """SI values of an effect's parameters, in the core's order; 0 where the entry gives none."""
    given = entry.get("parameters") or {}
    names = {edge_name(p, geometry=False): p for p in effect.parameters}
    for name in given:
        if name not in names:
            raise InvalidInput(f"{entry['effect']}@{entry['owner']}: parameter '{name}' is not known; there are {', '.join(names)}")
    values = []
    for name, parameter in names.items():
        value = given.get(name, 0.0)
        if isinstance(value, dict):
            value = value["value"]
        unit = edge_unit(parameter, geometry=False)
        values.append(float(value) if unit == "1" else to_si(float(value), unit))
    return values


def value_at_edge(parameter: _core.Parameter, value: float, *, geometry: bool) -> float:
    """An SI value in the unit of `edge_unit`."""
    return from_si(value, edge_unit(parameter, geometry=geometry))


def parse_effects(text: str | Sequence[str], core: _core.RobotModel) -> tuple[bool, list[Spec]]:
    """Reads `geometry,joint_compliance@joint2,gear_harmonic@joint1:order=2` into (is geometry asked for, entries).

    All owners of a name unless one is given. A name behind a colon is an option; numbers are read as numbers.

    Raises:
        InvalidInput: A name, owner or option is unknown.
    """
    items: Iterable[str] = text.split(",") if isinstance(text, str) else text
    geometry = False
    entries: list[Spec] = []
    for item in items:
        head, *options = str(item).strip().split(":")
        name, _, owner = head.partition("@")
        if not name:
            raise InvalidInput(f"an effect list holds an empty name: '{text}'")
        if name == "geometry":
            geometry = True
            continue
        owners = _core.effect_owners(name, core)
        if owner and owner not in owners:
            raise InvalidInput(f"{name} has no owner '{owner}' on this robot; there are {', '.join(owners) or 'none'}")
        for chosen in [owner] if owner else owners:
            entry: Spec = {"effect": name, "owner": chosen}
            for option in options:
                key, equals, value = option.partition("=")
                if not equals:
                    raise InvalidInput(f"an option is written name=value, got '{option}' in '{item}'")
                entry[key] = _number_or_text(value)
            _core.make_effect(name, core, chosen, options_of(entry))
            entries.append(entry)
    return geometry, entries


def _number_or_text(value: str) -> float | str:
    try:
        return float(value)
    except ValueError:
        return value
