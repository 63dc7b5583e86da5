# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Places, which own parameters: a part of an arm by its kind and number, `joint3`, in a cell `left.joint3`.

Here alone such names are put together and taken apart; joints are counted from 1 in names and from 0 in arrays.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

_NAME = re.compile(r"(?:(?P<arm>[^.]+)\.)?(?P<kind>[^.]*?)(?P<number>\d*)")


@dataclass(frozen=True)
class Place:
    """A place: its arm (empty where there is one only), its kind, its number from 1 (0 where it has none)."""

    arm: str
    kind: str
    number: int

    @property
    def index(self) -> int:
        """Its number from 0, as arrays count joints and links.

        Raises:
            ValueError: It has none, as the base and the tool.
        """
        if not self.number:
            raise ValueError(f"expected a joint or a link, got {self}")
        return self.number - 1

    @property
    def position(self) -> str:
        """What its own position is called; empty where it is no joint."""
        return joint_position(self.index) if self.kind == "joint" else ""

    def __str__(self) -> str:
        return f"{self.arm}{'.' * bool(self.arm)}{self.kind}{self.number or ''}"


@lru_cache(4096)
def place_of(name: str) -> Place:
    """The place of a name."""
    found = _NAME.fullmatch(name)
    return Place(found["arm"] or "", found["kind"], int(found["number"] or 0)) if found else Place("", name, 0)


def places_of(owner: str) -> list[Place]:
    """The places of an owner: one, or both of a pair "joint1<-joint2", the joint that is acted on first."""
    return [place_of(name) for name in owner.split("<-")]


def owner_of(places: Iterable[Place]) -> str:
    """The owner that has these places, as `places_of` gives them."""
    return "<-".join(map(str, places))


def source_of(owner: str) -> Place:
    """The joint that acts: the one behind the arrow of a pair, joint2 of "joint1<-joint2"; else the owner."""
    return place_of(owner.partition("<-")[2] or owner)


def joint_name(index: int) -> str:
    """The owner that joint `index`, counted from 0, is."""
    return f"joint{index + 1}"


def joint_position(index: int) -> str:
    """What the position of joint `index`, counted from 0, is called in tables and formulas."""
    return f"q{index + 1}"


def joint_column(index: int, unit: str) -> str:
    """The column of a table that holds the positions of joint `index`, counted from 0."""
    return f"{joint_position(index)}_{unit}"
