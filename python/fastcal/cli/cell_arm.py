# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`convert`, `compensate` and `accept`, which are about one arm, where MODEL is a cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fastcal.robot.robot import Robot


def load_arm(source: str, name: str) -> tuple[Robot, bool]:
    """A robot file; or of a cell the arms that carry the target `name` as one, with the target as its tool.

    The second is whether it is calibrated and keeps no nominal geometry, as an arm of a cell does.

    Raises:
        InvalidInput: A cell with several targets and no name, with no such target, or with no such arm; a name and no
            cell.
    """
    from fastcal.cells.branches import possible_ways
    from fastcal.errors import InvalidInput
    from fastcal.io.robot_file import load_robot
    from fastcal.io.tree_file import is_cell, load_cell

    if not is_cell(source):
        if name:
            raise InvalidInput(f"{source}: --name chooses a target of a cell, and this is one arm")
        return load_robot(source), False
    cell = load_cell(source)
    ways = possible_ways(cell, [of.name for of in cell.points if of.role == "target"])
    names = [way.name for way in ways]
    if not ways:
        raise InvalidInput(f"{source}: no target stands on an arm of joints; give the robot file of an arm")
    if name not in names and (name or len(ways) > 1):
        came = f"got '{name}'" if name else "none was given"
        raise InvalidInput(f"{source}: is a cell; expected --name with a target on the arm: {', '.join(names)}; {came}")
    way = ways[names.index(name)] if name else ways[0]
    is_calibrated = cell.record is not None or way.record is not None
    keeps = bool((way.record or {}).get("nominal"))
    return way.robot, is_calibrated and not keeps
