# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Whether an export's joints are the chain's, q1 ..., or what the controller shows, j1 ..., where these differ.

Titles q1 ..., the joint states of ROS and the names of a URDF's joints mean the chain's; all else a controller's.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.importers.export import Export
from fastcal.importers.reading import Reading
from fastcal.robot.robot import Robot
from fastcal.units import parse_name, to_si

OF_THE_CHAIN = "chain"  # the group of titles that are a URDF's names of joints
OF_A_MAP = ("map", "shown")  # the group of a map's keys j1_deg ...
COUNTS_OTHERWISE = frozenset({"FANUC", "FANUC LS"})  # dialects of makers whose pendant never shows the chain's joints
_ASK = (
    "joints are named q1 ... as if the controller counted them as the chain does; a FANUC shows joint 3 from the "
    "horizontal: --robot ROBOT tells how this arm counts"
)


def named_by_their_owner(reading: Reading, export: Export, robot: Robot | None) -> Reading:
    """The reading with its joints named j1 ... where they are a controller's that counts otherwise than the chain.

    Without a robot nothing says how its controller counts: the joints are q1 ..., with a note where that is rarely so.
    """
    if not reading.joints:
        return reading
    groups = [title.group for title in export.meanings if title is not None and re.fullmatch(r"q\d+", title.role)]
    stated = any(group == OF_A_MAP for group in groups)
    of_the_chain = export.dialect.startswith("ROS") or any(
        group and group != OF_A_MAP and group[0] in ("q", "map", OF_THE_CHAIN) for group in groups
    )
    differs = robot is not None and not robot.pendant.is_chain
    if of_the_chain or not (stated or differs):
        doubted = robot is None and not of_the_chain and export.dialect in COUNTS_OTHERWISE
        return replace(reading, notes=[*reading.notes, _ASK]) if doubted else reading
    columns = {re.sub(r"^q(?=\d)", "j", name): column for name, column in reading.columns.items()}
    return replace(reading, columns=columns)


def si_joints(reading: Reading, robot: Robot | None = None) -> FloatArray:
    """(N, n) joint positions [rad or m]: the chain's of the robot where one is given, else those that are named."""
    found = {}
    for name, values in reading.columns.items():
        quantity, unit = parse_name(name)
        if re.fullmatch(r"[qj]\d+", quantity) and unit is not None and isinstance(values, np.ndarray):
            found[quantity] = to_si(values, unit)
    shown = any(name.startswith("j") for name in found)
    q = np.column_stack([found[f"{'j' if shown else 'q'}{joint}"] for joint in range(1, reading.joints + 1)])
    return robot.pendant.chain(q) if robot is not None and shown else q
