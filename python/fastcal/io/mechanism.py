# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Links, joints and what closes loops, as description files have them; `mechanism_spec` makes a robot of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.fields import LARGEST
from fastcal.robot import se3

Spec = dict[str, Any]
EVERY = ("x", "y", "z", "rx", "ry", "rz")
# Of a pin whose z is the joint's axis: what a joint holds.
HELD = {"revolute": EVERY[:5], "prismatic": (*EVERY[:2], *EVERY[3:]), "ball": EVERY[:3], "fixed": EVERY}


@dataclass(eq=False)
class JointOf:
    """A joint between two links: its frame in the parent's at position 0, the child's in the joint's; SI."""

    name: str
    kind: str  # revolute, prismatic, ball, free, fixed
    parent: str
    child: str
    T_parent_joint: FloatArray
    axis: FloatArray  # of length 1
    T_joint_child: FloatArray = field(default_factory=lambda: np.eye(4))
    low: float = -np.inf
    high: float = np.inf
    start: float = 0.0

    def motion(self, position: float) -> FloatArray:
        """T of a turn [rad] or slide [m] along its axis; a joint that does neither stands still."""
        if self.kind == "revolute":
            return se3.pose(_core.exp_so3(position * self.axis))
        return se3.pose(position=position * self.axis) if self.kind == "prismatic" else np.eye(4)


@dataclass(eq=False)
class Pins:
    """Components of the pose of a pin on one link, seen from a pin on another, that are 0; or a rod between both."""

    name: str
    links: tuple[str, str]
    T_link_pin: tuple[FloatArray, FloatArray]
    fixed: tuple[str, ...] = ()
    length_mm: float | None = None


@dataclass(frozen=True)
class Ratio:
    """A joint that turns with others: position = sum of ratio times theirs + offset, SI."""

    name: str
    driven: str
    ratios: Mapping[str, float]
    offset: float


@dataclass(eq=False)
class Mechanism:
    """What a file holds. `frames`: places on links by name; `bodies`: mass [kg] and its centre in the link's frame."""

    path: str
    name: str
    links: list[str]
    joints: list[JointOf]
    pins: list[Pins] = field(default_factory=list)
    ratios: list[Ratio] = field(default_factory=list)
    frames: dict[str, tuple[str, FloatArray]] = field(default_factory=dict)
    bodies: dict[str, tuple[float, FloatArray]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def fail(self, sentence: str) -> NoReturn:
        """Raises ParseError that names the file."""
        raise ParseError(sentence, self.path)

    def frame(self, name: str) -> tuple[str, FloatArray]:
        """The link and the place on it of a link or frame."""
        if name in self.links:
            return name, np.eye(4)
        if name not in self.frames:
            self.fail(f"there is no link or frame '{name}'; there are {listed([*self.links, *self.frames])}")
        return self.frames[name]


def numbers(text: str | None, path: str, *counts: int) -> FloatArray:
    """The numbers of an attribute or element; how many there may be.

    Raises:
        ParseError: They are none, not finite or of another count.
    """
    words = (text or "").split()
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.array([np.nan])
    if len(values) not in counts or not all(abs(v) <= LARGEST for v in values):
        expected = " or ".join(map(str, counts))
        plural = "" if counts == (1,) else "s"
        raise ParseError(f"expected {expected} finite number{plural}, got '{' '.join(words):.60}'", path)
    return values


def direction(text: str | None, path: str) -> FloatArray:
    """A unit vector along three numbers.

    Raises:
        ParseError: They have no direction.
    """
    values = numbers(text, path, 3)
    size = float(np.linalg.norm(values))
    if size == 0:
        raise ParseError(f"expected an axis, got '{text}'", path)
    return np.asarray(values / size)


def plain_name(name: str) -> str:
    """A name that a loop may have."""
    kept = "".join(c if c.isalnum() and c.isascii() else "_" for c in name).strip("_")[:55]
    return kept if kept[:1].isalpha() else f"loop_{kept}"


def listed(names: Iterable[str]) -> str:
    """Names for a sentence, the first twenty."""
    every = list(names)
    return ", ".join(every[:20]) + (" ..." if len(every) > 20 else "")
