# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`fastcal robots` and `fastcal effects`: what is shipped, and what can be named."""

from __future__ import annotations

from typing import Any

from fastcal.cli.console import emit, say


def robots() -> None:
    """List the arms that are included."""
    from fastcal.io.robot_file import load_robot
    from fastcal.robots import about, available

    entries = []
    for name in available():
        robot = load_robot(name)
        has_masses = all(joint.mass_kg for joint in robot.joints)
        entries.append({"name": name, "joints": robot.joint_count, "link_masses": has_masses, "about": about(name)})
    width = max(len(str(entry["name"])) for entry in entries)
    for entry in entries:
        say(f"{entry['name']:<{width}}  {entry['about']}{'' if entry['link_masses'] else '; no link masses'}")
    emit({"robots": entries})


def effects() -> None:
    """List the effects that calibrate and diagnose know."""
    from fastcal.effects.entries import effect_names, traits_of

    entries: list[dict[str, Any]] = [
        {"name": "geometry", "place": "anywhere", "about": "the rows of the robot file, base and tool"}
    ]
    entries += [
        {"name": name, "place": traits_of(name).place, "about": traits_of(name).phrase} for name in effect_names()
    ]
    width = max(len(entry["name"]) for entry in entries)
    for entry in entries:
        say(f"{entry['name']:<{width}}  {entry['about']}")
    say("NAME means all its owners, NAME@joint2 one; docs/effects has a page on each")
    emit({"effects": entries})
