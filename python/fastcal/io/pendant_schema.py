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
    try:
        TopologicalSorter({entry["joint"]: {*entry["plus"], *entry["minus"]} for entry in out}).prepare()
    except CycleError as error:
        *some, last = (str(joint) for joint in sorted(set(error.args[1])))
        ring, others = f"{', '.join(some)} and {last}", "other" if len(some) == 1 else "others"
        entries[0].refuse("", f"joints {ring} are each counted from the {others}; expected one counted by itself")
    return out


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
