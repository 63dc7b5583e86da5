# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a cell's file of postures says of each arm beside its joints: left.payload_kg, left.approach1, temperature_c.

An arm's own columns have its name before the one that a file of this arm alone would have. What is the same for all
arms, as time and temperature, needs none; nor does anything where there is one arm.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from fastcal.arrays import FloatArray
from fastcal.cells.cell import Arm, Cell
from fastcal.io.columns import is_condition, kinds_of_columns, match_columns
from fastcal.io.measurements import OWN_COLUMNS, Columns, unknown_columns
from fastcal.io.table import Table
from fastcal.measurements.checks import BadRow
from fastcal.measurements.dataset import Dataset
from fastcal.units import parse_name

OF_ALL_ARMS = frozenset({"time", "temperature", "station"})
_OF_A_JOINT = re.compile(r"(q|j|qd)\d+(_read)?")


def arm_conditions(
    table: Table, places: Sequence[int], cell: Cell, q: FloatArray
) -> tuple[dict[str, Dataset], list[str]]:
    """The joints and conditions of each arm as a data set of its own, and notes on columns that are of none.

    Args:
        table: The file.
        places: Its columns that are neither joints nor readings.
        cell: Says which arms there are; of one whose flange's pose alone is known nothing else is read.
        q: (N, n) joint positions in the order of the tree.

    Raises:
        ParseError: A number, unit or joint is wrong, or what an arm carries has the name of none; one sentence.
    """
    arms = {arm.name: arm for arm in cell.arms if not arm.of_poses}
    own: dict[str, list[int]] = {name: [] for name in arms}
    notes = []
    for place in places:
        title = table.names[place]
        arm, dot, rest = title.partition(".")
        name = rest or title
        if title in OWN_COLUMNS:
            continue
        if not _may_be_read(name) or (dot and arm not in arms):
            notes.append(f"column '{title:.60}' is not known and was not read")
            continue
        if not dot and len(cell.arms) > 1 and is_condition(name) and parse_name(name.lower())[0] not in OF_ALL_ARMS:
            meant = " or ".join(f"{of}.{name}" for of in arms)
            raise table.error(f"column '{title:.60}' names no arm; expected {meant:.200}")
        for of in [arm] if dot else arms:
            own[of].append(place)
    out = {}
    for branch in cell.core.branches:
        if branch.name not in arms:
            continue
        there = q[:, branch.first_joint : branch.first_joint + branch.joint_count]
        out[branch.name], more = _conditions(table, own[branch.name], arms[branch.name], there)
        notes += more
    return out, list(dict.fromkeys(notes))


def _may_be_read(name: str) -> bool:
    """Is a column a condition, or one of the user's own, and neither a reading nor a joint?"""
    quantity, _ = parse_name(name.lower())
    is_reading = "@" in name or quantity in kinds_of_columns(0) or _OF_A_JOINT.fullmatch(quantity) is not None
    return is_condition(name) or not is_reading


def _conditions(table: Table, places: Sequence[int], arm: Arm, q: FloatArray) -> tuple[Dataset, list[str]]:
    """An arm's data set, and notes on its columns."""
    if not places:
        return Dataset.from_arrays(q, source=table.path), []
    titles = [table.names[place] for place in places]
    part = replace(
        table,
        names=[title.removeprefix(f"{arm.name}.") for title in titles],
        columns=[table.columns[place] for place in places],
        titles=titles,
    )
    joint_types = arm.robot.joint_types
    known, others = match_columns(part, joint_types)
    columns = Columns(part, known)
    extra, texts = unknown_columns(part, others)
    try:
        data = Dataset.from_arrays(q, **columns.conditions(len(joint_types)), extra=extra, source=table.path)
    except BadRow as bad:
        raise columns.wrong(bad) from None
    notes = list(columns.notes)
    if empty := columns.empty_payloads:
        count = "1 row" if empty == 1 else f"{empty} rows"
        notes.append(f"the payload of {arm.name} is empty in {count} and taken as 0 there")
    for place in others:
        word = "was not read" if part.names[place] in texts else "is kept as it is"
        notes.append(f"column '{part.title(place):.60}' is not known and {word}")
    return data, notes
