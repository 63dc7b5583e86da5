# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which column of a table is which quantity, by its name, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from fastcal.io.table import Table
from fastcal.measurements.observations import tables_of
from fastcal.units import UNITS, parse_name, unit_names

# What a row says of a posture beside its joints; of each joint there are `approach1` and `current1` too.
CONDITIONS: dict[str, str | None] = (
    dict.fromkeys(("fx", "fy", "fz"), "force")
    | dict.fromkeys(("mx", "my", "mz"), "torque")
    | {"payload": "mass", "temperature": "temperature", "time": "time"}
    | dict.fromkeys(("station", "mount"), None)  # labels
)
# Of them, and the other ways to write an orientation and its standard deviation.
KINDS: dict[str, str | None] = (
    CONDITIONS
    | dict.fromkeys(("rx", "ry", "rz"), "angle")
    | dict.fromkeys(("sigma_range", "instrument_x", "instrument_y", "instrument_z"), "length")
    | {"sigma_angle": "angle", "sigma": "length"}
)


SPEEDS = {"angle": "angular speed", "length": "speed"}  # of a joint, by what it moves by
JOINT_TITLE = re.compile(r"\b[qj]\d+(_read)?_(deg|rad|mrad|mm|m|um|in)\b", re.I)  # that fastcal's own files have


def kinds_of_columns(joint_count: int) -> dict[str, str | None]:
    """Quantities that a file may hold besides those of the joints, None for plain numbers and labels."""
    return KINDS | {c: table.quantity for table in tables_of(joint_count).values() for c in table.columns}


@dataclass(frozen=True)
class Column:
    """The columns of a quantity in its table, and its unit there; None for plain numbers and labels."""

    place: int
    unit: str | None


def match_columns(table: Table, joint_types: Sequence[str]) -> tuple[dict[str, Column], list[int]]:
    """Finds the known quantities, a dict from the name without its unit, and the places of all other columns.

    Raises:
        ParseError: A known quantity has no unit, an unknown one or one of another kind, or is given twice;
            or a column names a joint that the robot does not have.
    """
    kinds = kinds_of_columns(len(joint_types))
    for joint, joint_type in enumerate(joint_types, start=1):
        kind = "angle" if joint_type == "revolute" else "length"
        kinds |= {f"{letter}{joint}{read}": kind for letter in "qj" for read in ("", "_read")}
        kinds |= {f"current{joint}": "current", f"approach{joint}": None, f"qd{joint}": SPEEDS[kind]}
    known: dict[str, Column] = {}
    unknown: list[int] = []
    for place in range(len(table.names)):
        quantity, unit = _match(table, place, kinds)
        if quantity is None:
            unknown.append(place)
        elif quantity in known:
            other = table.title(known[quantity].place)
            both = f"columns '{other:.60}' and '{table.title(place):.60}' both give {quantity}"
            raise table.error(f"{both}; expected one of them")
        else:
            known[quantity] = Column(place, unit)
    return known, unknown


def would_do(quantity: str, kind: str | None) -> str:
    """The names that a quantity's column may have, in words."""
    if kind is None:
        return quantity
    base, at, place = quantity.partition("@")
    *others, last = [f"{base}_{unit}{at}{place}" for unit in unit_names(kind)]
    return f"{', '.join(others)} or {last}" if others else last


def is_condition(name: str) -> bool:
    """Does a column of one arm's file say a condition of its rows, whatever its unit?"""
    quantity, _ = parse_name(name.lower())
    of_a_joint = re.fullmatch(r"(approach|current)\d+(_.*)?", quantity) is not None
    return of_a_joint or quantity in CONDITIONS or quantity.rpartition("_")[0] in CONDITIONS


def _match(table: Table, place: int, kinds: dict[str, str | None]) -> tuple[str | None, str | None]:
    """The quantity and the unit that a column names; (None, None) where it names no known quantity."""
    name, title = table.names[place].lower(), table.title(place)
    if name in kinds and kinds[name] is None:
        return name, None
    base, at, where = name.partition("@")
    quantity, unit = parse_name(base)
    if at:
        quantity += at + where
    if unit is None and quantity not in kinds and kinds.get(quantity.rpartition("_")[0]) is not None:
        quantity, _, unit = quantity.rpartition("_")
    kind = kinds.get(quantity)
    if re.fullmatch(r"j\d+(_read)?", quantity) and (unit not in UNITS or UNITS[unit].kind not in ("angle", "length")):
        return None, None  # what another's file calls a joint
    if kind is None:
        if re.fullmatch(r"(q|j|current|approach|qd)\d+(_read)?", quantity) and quantity not in kinds:
            count = sum(f"q{joint}" in kinds for joint in range(1, len(kinds)))
            numbers = f"its joints are numbered 1 to {count}"
            raise table.error(f"column '{title:.60}' names no joint of this robot; {numbers}")
        if at and kinds.get(f"{quantity.partition('@')[0]}@link1") is not None:
            raise table.error(f"column '{title:.60}' names no link of this robot; expected @link1 and so on")
        return None, None
    if unit is None:
        raise table.error(f"column '{title:.60}' has no unit; expected {would_do(quantity, kind)}")
    if unit not in UNITS or UNITS[unit].kind != kind:
        raise table.error(
            f"column '{title:.60}': '{unit}' is no unit of {kind} known here; expected {would_do(quantity, kind)}"
        )
    return quantity, unit
