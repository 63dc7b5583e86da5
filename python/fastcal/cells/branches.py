# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Ways with what else hangs on their arms: the other arm and the head of a torso, whose weight its joints carry too.

Such a way is one arm with branches that end in nothing that is read. Depth first: the joints of an arm of the way, of
the branches on its flange, then those of the way's next arm; the tool stands on the last.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from fastcal.cells.cell import Arm, Cell
from fastcal.cells.paths import Way, serial_ways
from fastcal.conversion import convert
from fastcal.conversion.joined import check_joins, joined_screws, joints_of_last
from fastcal.effects.entries import traits_of
from fastcal.errors import InvalidInput
from fastcal.place import Place, owner_of, places_of
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Spec

Path = tuple[Arm, ...]  # from the ground to an arm, which is the last


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadedWay(Way):
    """A way whose arms carry others: they move nothing that is read of its target, and load the joints below them.

    Attributes:
        paths: To its arms and to those beside it, depth first.
    """

    paths: tuple[Path, ...]

    @cached_property
    def joints(self) -> list[tuple[Arm, int]]:
        """The arm of each joint, those beside the way included, and its place there from 0."""
        return [(path[-1], i) for path in self.paths for i in range(path[-1].robot.joint_count)]

    @cached_property
    def robot(self) -> Robot:
        """The way as one arm with branches. InvalidInput where an arm cannot be a part of one."""
        whole = convert(joined_screws([arm.robot.spec for arm in self.arms], self.arms[-1].name), "urdf").spec
        joints: list[Spec] = []
        ends: dict[str, int] = {}  # of each arm so far, the number of its last joint
        for path in self.paths:
            own = _joints(path)
            if len(path) > 1 and ends[path[-2].name] != len(joints):
                own[0]["on"] = str(Place("", "link", ends[path[-2].name]))
            joints += own
            ends[path[-1].name] = len(joints)
        effects = [self._renumbered(effect) for effect in whole["effects"]]
        return Robot({**whole, "joints": joints, "effects": effects}).with_(
            tool=self.target.place, calibration=self.record
        )

    def _renumbered(self, effect: Spec) -> Spec:
        """An effect of a joint of the way alone, which is counted among those of all branches here."""
        own = [k + 1 for k, (arm, _) in enumerate(self.joints) if arm in self.arms]
        places = (Place("", "joint", own[place.index]) for place in places_of(effect["owner"]))
        return {**effect, "owner": owner_of(places)}


def ways_of(cell: Cell, views: Sequence[str]) -> list[Way]:
    """The ways to all targets that were read from the world, in the order of the readings.

    Args:
        cell: The cell.
        views: TARGET or TARGET:SENSOR of what was read.

    Raises:
        InvalidInput: Nothing was read of a target that an arm carries on its flange from the world.
    """
    if out := possible_ways(cell, views):
        return out
    read = ", ".join(views) or "nothing"
    raise InvalidInput(
        f"expected readings from the world of targets on arms' flanges, such as x_mm@TARGET, got {read}: one way from "
        "the world to a target is looked at after the other"
    )


def possible_ways(cell: Cell, views: Sequence[str]) -> list[Way]:
    """`ways_of`, none where there are none.

    Where arms have effects that follow loads, those of the whole tree: what was identified with them holds with them.
    """
    return [loaded(cell, way) if _follows_loads(way) else way for way in serial_ways(cell, views)]


def _follows_loads(way: Way) -> bool:
    """Has an arm of a way an effect that its loads set?"""
    entries = [entry for arm in way.arms for entry in arm.robot.entries]
    return any({"torque", "load"} & set(traits_of(entry["effect"]).depends_on) for entry in entries)


def loaded(cell: Cell, way: Way) -> Way:
    """The way with the arms that hang on it and have masses; as it is where there are none."""
    paths = tuple(_paths(cell, way, way.arms[:1]))
    return way if len(paths) == len(way.arms) else LoadedWay(way.target, way.arms, way.record, paths=paths)


def _paths(cell: Cell, way: Way, path: Path) -> Iterator[Path]:
    """The path, those to the branches on its last arm, and those of the way beyond it. The way's end has no branch."""
    yield path
    if path == way.arms:
        return
    onward = way.arms[: len(path) + 1] if path == way.arms[: len(path)] else ()
    for arm in cell.arms:
        branch = (*path, arm)
        if arm.on == path[-1].flange and branch != onward and _weighs(cell, arm):
            yield from _paths(cell, way, branch)
    if onward:
        yield from _paths(cell, way, onward)


def _weighs(cell: Cell, arm: Arm) -> bool:
    """Can an arm be a branch, and has it or what stands on it a mass?"""
    if arm.of_poses:
        return False
    try:
        check_joins(arm.robot.spec)
    except InvalidInput:
        return False
    has_mass = any(joint.mass_kg > 0 for joint in arm.robot.joints)
    return has_mass or any(other.on == arm.flange and _weighs(cell, other) for other in cell.arms)


def _joints(path: Path) -> list[Spec]:
    """The joints of the path's last arm, the first in the frame of the last joint of the arm that carries it."""
    arm = path[-1]
    own = joints_of_last([each.robot.spec for each in path])
    return [{**joint, "name": str(Place(arm.name, "joint", i + 1))} for i, joint in enumerate(own)]
