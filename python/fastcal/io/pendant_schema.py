# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The key `pendant` of a robot file: how the controller counts its joints (`fastcal.robot.pendant`)."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter
from typing import Any

from fastcal.io.fields import Fields

Spec = dict[str, Any]


def check_pendant(entries: list[Fields], joints: list[Spec]) -> list[Spec]:
    """The canonical entries: joint, sign, zero, and the lists `plus` and `minus`.

    Raises:
        ParseError: A joint is unknown or given twice, or joints are counted from one another in a circle.
    """
    out: list[Spec] = []
    for fields in entries:
        entry: Spec = {"joint": fields.count("joint", 1, len(joints))}
        joint = entry["joint"]
        unit = "deg" if joints[joint - 1]["type"] == "revolute" else "mm"
        if any(other["joint"] == joint for other in out):
            fields.refuse("joint", f"joint {joint} is given twice")
        if fields.has("axis"):
            entry["axis"] = _axis(fields, joint, joints)
        entry["sign"] = fields.number("sign", 1.0)
        if abs(entry["sign"]) != 1:
            fields.fail("sign", "1 or -1", entry["sign"])
        entry[f"zero_{unit}"] = fields.quantity("zero", unit, 0.0)
        for key in ("plus", "minus"):
            entry[key] = _others(fields, key, joint, joints)
        if both := set(entry["plus"]) & set(entry["minus"]):
            fields.refuse("", f"joint {min(both)} stands in plus and in minus")
        fields.done()
        out.append(entry)
    if any("axis" in entry for entry in out):
        _check_axes(out, entries, joints)
    try:
        TopologicalSorter({entry["joint"]: {*entry["plus"], *entry["minus"]} for entry in out}).prepare()
    except CycleError as error:
        *some, last = (str(joint) for joint in sorted(set(error.args[1])))
        ring, others = f"{', '.join(some)} and {last}", "other" if len(some) == 1 else "others"
        entries[0].refuse("", f"joints {ring} are each counted from the {others}; expected one counted by itself")
    return out


def _axis(fields: Fields, joint: int, joints: list[Spec]) -> int:
    """The controller's number of a joint with a motor."""
    axis = fields.count("axis", 1, len(joints))
    if joints[joint - 1].get("passive"):
        fields.refuse("axis", f"joint {joint} is passive: it has no motor")
    if joints[axis - 1]["type"] != joints[joint - 1]["type"]:
        fields.refuse("axis", f"joint {axis} of the file is {joints[axis - 1]['type']} and joint {joint} is not")
    return axis


def _check_axes(out: list[Spec], entries: list[Fields], joints: list[Spec]) -> None:
    """Each axis once, and none counted from another."""
    own = {entry["joint"]: entry.get("axis", entry["joint"]) for entry in out}
    taken = [own.get(k, k) for k, joint in enumerate(joints, start=1) if not joint.get("passive")]
    twice = [axis for axis in taken if taken.count(axis) > 1]
    if twice:
        entries[0].refuse("axis", f"axis {twice[0]} is that of two joints")
    if any(entry["plus"] or entry["minus"] for entry in out):
        entries[0].refuse("", "plus and minus are for files without axis")


def _others(fields: Fields, key: str, joint: int, joints: list[Spec]) -> list[int]:
    """The joints of `plus` or `minus`, given as a number or a list of numbers."""
    given = fields.take(key, [])
    listed = given if isinstance(given, list) else [given]
    for other in listed:
        if isinstance(other, bool) or not isinstance(other, int) or not 1 <= other <= len(joints):
            fields.fail(key, f"numbers of joints, 1 to {len(joints)}", given)
        if other == joint:
            fields.fail(key, f"other joints than joint {joint} itself", given)
        if joints[other - 1]["type"] != joints[joint - 1]["type"]:
            fields.refuse(key, f"joint {other} is {joints[other - 1]['type']} and joint {joint} is not")
    if len(set(listed)) < len(listed):
        fields.fail(key, "each joint once", given)
    return sorted(listed)
