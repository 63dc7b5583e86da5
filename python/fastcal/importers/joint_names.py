# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Columns that are titled by the names of a robot's joints, as its URDF has them: /joint_states/NAME/position, NAME."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from fastcal.importers.controller_joints import OF_THE_CHAIN
from fastcal.importers.export import Export
from fastcal.importers.reading import Reading
from fastcal.importers.words import Title, split_unit
from fastcal.place import joint_position
from fastcal.robot.robot import Robot

UR_PENDANT = ("base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3")  # Universal Robots' own names
YASKAWA = (("s", "l", "e", "u", "r", "b", "t"), ("s", "l", "u", "r", "b", "t"))  # of seven axes, of six


def with_joint_names(export: Export, names: Sequence[str]) -> Export:
    """The export with columns named after a robot's joints known as q1 ... qn; else as it is.

    The names are the robot's own, or those on the pendants of Universal Robots and Yaskawa.

    Args:
        export: The table.
        names: Of the robot's joints, from the base.
    """
    if export.mapped:
        return export
    bare = [split_unit(title)[0].strip().lower() for title in export.titles]
    makers = next((each for each in (UR_PENDANT, *YASKAWA) if all(bare.count(name) == 1 for name in each)), None)
    if makers is not None:
        places = [bare.index(name) for name in makers]
    else:
        places = [next((k for k, title in enumerate(export.titles) if _is_of(title, name)), -1) for name in names]
    if not places or min(places) < 0:
        return export
    meanings = list(export.meanings)
    for k, title in enumerate(meanings):
        if title is not None and re.fullmatch(r"q\d+", title.role):
            meanings[k] = None  # what a number in a name was taken for
    for joint, place in enumerate(places, start=1):
        owner = OF_THE_CHAIN if makers is None else "joint"
        meanings[place] = Title(f"q{joint}", "plain", split_unit(export.titles[place])[1], (owner,))
    return replace(export, meanings=meanings)


def is_named(export: Export) -> bool:
    """Did names of joints choose columns?"""
    return any(title is not None and title.group == (OF_THE_CHAIN,) for title in export.meanings)


def check_named(export: Export, names: Sequence[str]) -> None:
    """InvalidInput where most joints have columns by their names, and some have none."""
    missing = [name for name in names if not any(_is_of(title, name) for title in export.titles)]
    if missing and 2 * len(missing) < len(names) and not export.mapped:
        raise export.error(
            f"joint '{missing[0]}' has no column; expected the robot's own names, {', '.join(names)}, "
            f"got {', '.join(export.titles)}"
        )


def motors_of(robot: Robot) -> list[int]:
    """Joints, from 0, that neither another one (`mimic`) nor a closed loop moves; all where some joint has no name."""
    if any(joint.name is None for joint in robot.joints):
        return list(range(robot.joint_count))
    driven = {mimic[0] for mimic in robot.mimics} | set(robot.passive)
    return [i for i in range(robot.joint_count) if i not in driven]


def renumbered(reading: Reading, joints: Sequence[int]) -> Reading:
    """The reading whose joints q1 ... are these of the robot, counted from 0."""

    def own(column: str) -> str:
        found = re.fullmatch(r"q(\d+)(_.+)", column)
        return column if found is None else f"{joint_position(joints[int(found[1]) - 1])}{found[2]}"

    return replace(reading, columns={own(name): values for name, values in reading.columns.items()})


def notes_on_names(export: Export, names: Sequence[str], count: int) -> list[str]:
    """Whether there are more joint states than the `count` that were read, where no names of a robot chose them."""
    states = [title for title in export.titles if re.fullmatch(r"/joint_states/.+/position", title)]
    if names or not 0 < count < len(states):
        return []
    return [
        f"of {len(states)} joint states {count} are read, by the numbers in their names: --robot URDF knows the names"
    ]


def _is_of(title: str, name: str) -> bool:
    """Whether a title means the position of a joint and not its velocity or effort."""
    parts = split_unit(title)[0].strip("/ ").split("/")
    return parts[-1] == name or (len(parts) > 1 and parts[-1] == "position" and parts[-2] == name)
