# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Two calibrated models of one cell: which numbers of its arms differ, and by how much at its targets.

Each way from the world to a target that both have is compared as one arm, base and target aligned; what sensors and
cameras see, as they see it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from fastcal.cells.branches import possible_ways
from fastcal.cells.cell import Cell
from fastcal.cells.compare_seen import SeenComparison, compare_seen
from fastcal.cells.paths import Way
from fastcal.errors import InvalidInput
from fastcal.monitoring.compare import Comparison, compare
from fastcal.monitoring.differences import Difference


@dataclass(frozen=True, eq=False)
class WayComparison:
    """One way of the first cell, and how the second one's differs."""

    way: Way
    found: Comparison

    @property
    def parameters(self) -> list[Difference]:
        """The numbers with the cell's owners."""
        return [replace(each, owner=self.way.owner(each.owner)) for each in self.found.parameters]

    @property
    def significant(self) -> list[Difference]:
        """Those that differ beyond noise."""
        return [each for each in self.parameters if each.significant]

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `ways`."""
        return {
            **self.found.to_json_dict(),
            "arms": [arm.name for arm in self.way.arms],
            "parameters": [vars(each) for each in self.parameters],
            "notes": [self.way.words(note) for note in self.found.notes],
        }


@dataclass(frozen=True, eq=False)
class CellComparison:
    """What `compare_cells` found, way by way."""

    first: Cell
    second: Cell
    ways: list[WayComparison]
    seen: SeenComparison | None = None

    @property
    def significant(self) -> list[Difference]:
        """All numbers that differ beyond noise."""
        return [of for each in self.ways for of in each.significant] + (self.seen.significant if self.seen else [])

    @property
    def notes(self) -> list[str]:
        """What a reader should know, a sentence each."""
        ways = [f"{each.way.name}: {each.way.words(note)}" for each in self.ways for note in each.found.notes]
        return [*ways, *(self.seen.notes if self.seen else [])]

    def to_json_dict(self) -> dict[str, Any]:
        """The content of compare.json."""
        return {
            "models": [{"cell": cell.name} for cell in (self.first, self.second)],
            "ways": {each.way.name: each.to_json_dict() for each in self.ways},
            **({} if self.seen is None else {"seen": self.seen.to_json_dict()}),
        }


def compare_cells(first: Cell, second: Cell, *, threads: int = 1) -> CellComparison:
    """Compares two models of one cell.

    Raises:
        InvalidInput: They have nothing in common that is read, or other arms carry a target.
    """
    seen = compare_seen(first, second, threads=threads)
    ways = [possible_ways(cell, [of.name for of in cell.points if of.role == "target"]) for cell in (first, second)]
    others = {way.name: way for way in ways[1]}
    both = [(way, others[way.name]) for way in ways[0] if way.name in others]
    if seen is not None:  # then what no instrument on the world read is not looked at from there
        both = [(way, other) for way, other in both if way.record is not None and other.record is not None]
    if not both and seen is None:
        raise InvalidInput(
            f"{first.name} and {second.name} have no target on an arm's flange in common, nor a target and a sensor, "
            "or a board and a camera; expected two models of one cell"
        )
    found = []
    for way, other in both:
        arms = [[arm.name for arm in each.arms] for each in (way, other)]
        if arms[0] != arms[1]:
            raise InvalidInput(
                f"{way.name} is carried by {' + '.join(arms[0])} in {first.name} and by {' + '.join(arms[1])} in "
                f"{second.name}; expected two models of one cell"
            )
        found.append(WayComparison(way, compare(way.robot, other.robot, threads=threads)))
    return CellComparison(first, second, found, seen)
