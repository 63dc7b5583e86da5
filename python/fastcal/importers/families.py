# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which columns of an export belong together: the joints, the measured point, its orientation."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from fastcal.errors import InvalidInput
from fastcal.importers.export import Export, number
from fastcal.importers.words import Title

Family = tuple[str, tuple[str, ...]]  # the sense of its titles, and the words that they have in common
_MAP = "name its columns with --map"
_SAMPLE = 200  # rows that show whether four numbers are a quaternion
_ROUNDED = 2e-3  # of its length: four numbers of three decimals

# Sets of roles that make an orientation: the convention, None where it can't be known from them.
ORIENTATIONS: tuple[tuple[tuple[str, ...], str | None], ...] = (
    (("qw", "qx", "qy", "qz"), "wxyz"),
    (("rx", "ry", "rz", "rw"), "xyzw"),
    (tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)), "matrix"),
    (("roll", "pitch", "yaw"), "rpy"),
    (("w", "p", "r"), "wpr"),
    (("o", "a", "t"), "zyz"),
    (("a", "e", "r"), "zyz"),
    (("a", "b", "c"), None),
    (("rx", "ry", "rz"), None),
)


@dataclass(frozen=True)
class Orientation:
    """Columns that give an orientation, and the convention where their titles alone say it."""

    places: tuple[int, ...]
    roles: tuple[str, ...]
    convention: str | None


def grouped(export: Export) -> dict[Family, dict[str, int]]:
    """Roles and places by family; of two columns of one role in a family the first counts."""
    found: dict[Family, dict[str, int]] = defaultdict(dict)
    for place, title in enumerate(export.meanings):
        if title is not None and title.sense != "own":
            found[title.sense, title.group].setdefault(title.role, place)
    return _with_scalar_first(export, found)


def _with_scalar_first(export: Export, found: dict[Family, dict[str, int]]) -> dict[Family, dict[str, int]]:
    """Q0 beside Qx, Qy and Qz, or Q0 to Q3 of length 1, are a quaternion with its scalar first and no joints."""
    for (sense, group), roles in list(found.items()):
        joints = found.get((sense, ("q", *group)), {})
        if {"qx", "qy", "qz"} <= roles.keys() and "qw" not in roles and joints.keys() == {"q0"}:
            roles["qw"] = joints.pop("q0")
        is_whole = {"x", "y", "z"} <= roles.keys() and joints.keys() == {"q0", "q1", "q2", "q3"}
        if is_whole and _of_length_1(export, list(joints.values())):
            roles |= {role: joints.pop(f"q{k}") for k, role in enumerate(("qw", "qx", "qy", "qz"))}
    return found


def _of_length_1(export: Export, places: Sequence[int]) -> bool:
    """Do some columns hold a vector of length 1 in each of the first rows?"""
    sample = [[number(row[place]) for place in places] for row in export.rows[:_SAMPLE]]
    lengths = [math.hypot(*(value for value in values if value is not None)) for values in sample if None not in values]
    return bool(lengths) and all(abs(length - 1) < _ROUNDED for length in lengths)


def _is_joint(role: str) -> bool:
    return role[0] == "q" and role[1:].isdigit() and len(role) < 5


def joints(export: Export, count: int | None) -> tuple[list[int], list[int | None], list[str]]:
    """The columns of the joints as commanded, as read back, and notes.

    Args:
        export: Where to look.
        count: The joints of the robot, None where it is not known.

    Raises:
        InvalidInput: Two sets could be it, or a joint is missing.
    """
    by_sense: dict[str, list[dict[int, int]]] = defaultdict(list)
    for (sense, _), roles in grouped(export).items():
        found = {int(role[1:]): place for role, place in roles.items() if _is_joint(role)}
        if len(found) > 1 and sense in ("plain", "nominal", "actual", "measured"):
            by_sense["actual" if sense == "measured" else sense].append(found)
    notes: list[str] = []
    sets = {sense: _largest(export, found, count) for sense, found in by_sense.items()}
    sent = sets.get("nominal") or sets.get("plain")
    read = sets.get("actual")
    if sent is None and read is not None:
        sent, read = read, None
    elif sent is not None and read is not None and len(read) != len(sent):
        read = None
    if sent is None:
        return [], [], notes
    numbers = _numbered(export, sent)
    if count is not None and len(numbers) > count:
        notes.append(f"{export.title(sent[numbers[count]])} and what follows belong to no joint of this robot")
        numbers = numbers[:count]
    back = [None if read is None else read.get(joint) for joint in numbers]
    return [sent[joint] for joint in numbers], back, notes


def _largest(export: Export, found: list[dict[int, int]], count: int | None) -> dict[int, int]:
    """The set with the most joints; of as many, none."""
    fits = [each for each in found if count is not None and len(each) == count] or found
    fits.sort(key=len, reverse=True)
    if len(fits) > 1 and len(fits[0]) == len(fits[1]):
        first, second = (export.title(min(each.values())) for each in fits[:2])
        raise InvalidInput(f"{export.grid.path}: {first} and {second} both begin a set of joints; {_MAP}")
    return fits[0]


def _numbered(export: Export, found: dict[int, int]) -> list[int]:
    """The joints' numbers in order, from 0 or from 1 without a gap."""
    numbers = sorted(found)
    if numbers != list(range(numbers[0], numbers[0] + len(numbers))) or numbers[0] > 1:
        titles = ", ".join(export.title(found[joint]) for joint in numbers)
        raise InvalidInput(f"{export.grid.path}: expected joints numbered without a gap, got {titles}; {_MAP}")
    return numbers


def point(export: Export, with_joints: bool) -> tuple[Family | None, str | None]:
    """The family of the measured point, and the title of a pose that a controller computed.

    Raises:
        InvalidInput: Several points could be it.
    """
    whole = {family: roles for family, roles in grouped(export).items() if {"x", "y", "z"} <= roles.keys()}
    computed = [family for family in whole if family[0] == "controller"]
    if export.controller:
        computed += [family for family in whole if family[0] in ("plain", "actual", "nominal")]
    title = export.titles[whole[computed[0]]["x"]] if computed else None
    left = [family for family in whole if family not in computed]
    senses = ["measured", "plain", "actual"]
    for sense in senses:
        fits = [family for family in left if family[0] == sense]
        bare = [family for family in fits if not family[1]]
        fits = bare if sense == "plain" and bare else fits
        if len(fits) > 1:
            names = " and ".join(export.title(whole[family]["x"]) for family in fits[:4])
            raise InvalidInput(f"{export.grid.path}: {names} could each be the measured point; {_MAP}")
        if (
            fits
            and sense == "actual"
            and with_joints
            and not any(family[0] in ("nominal", "deviation") for family in left)
        ):
            name = export.title(whole[fits[0]]["x"])
            raise InvalidInput(
                f"{export.grid.path}: {name} is next to the joints and may be what the controller computes, "
                f"which is no "
                f"measurement; {_MAP} if it was measured, or give the instrument's points"
            )
        if fits:
            return fits[0], title
    return None, title


def orientation(export: Export, beside: Family) -> Orientation | None:
    """The orientation beside a measured point; None where there is none.

    Raises:
        InvalidInput: Several could be it.
    """
    found: dict[Family, Orientation] = {}
    for family, roles in grouped(export).items():
        computed = family[0] in ("nominal", "deviation", "controller") or (
            export.controller and family[0] != "measured"
        )
        if computed and family != beside:
            continue
        for names, convention in ORIENTATIONS:
            if all(name in roles for name in names):
                found[family] = Orientation(tuple(roles[name] for name in names), names, convention)
                break
    quaternion = _unnamed_quaternion(export)
    if not found and quaternion:
        return quaternion
    if beside in found or not found:
        return found.get(beside)
    if len(found) > 1:
        names2 = " and ".join(export.title(each.places[0]) for each in list(found.values())[:4])
        raise InvalidInput(f"{export.grid.path}: {names2} each begin an orientation; {_MAP}")
    return next(iter(found.values()))


def _unnamed_quaternion(export: Export) -> Orientation | None:
    """q1 to q4, or q0 to q3, beside joints of another name: a quaternion of unknown order."""
    sets: list[dict[int, int]] = []
    for roles in grouped(export).values():
        found = {int(role[1:]): place for role, place in roles.items() if _is_joint(role)}
        if found:
            sets.append(found)
    if len(sets) < 2:
        return None
    smallest = min(sets, key=len)
    if sorted(smallest) in ([0, 1, 2, 3], [1, 2, 3, 4]):
        return Orientation(tuple(smallest[k] for k in sorted(smallest)), ("q",) * 4, None)
    return None


def labelled(export: Export, role: str) -> list[int]:
    """The places of columns of names, numbers, times, dates or truth values."""
    return [place for place, title in enumerate(export.meanings) if title is not None and title.role == role]


def own(export: Export) -> dict[str, tuple[int, Title]]:
    """Columns of the contract by their own names."""
    found: dict[str, tuple[int, Title]] = {}
    for place, title in enumerate(export.meanings):
        if title is not None and title.sense == "own":
            found.setdefault(title.role, (place, title))
    return found
