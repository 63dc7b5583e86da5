# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Ways from the world to a target, each a serial arm: what one arm's commands say of a cell of several.

A target on the flange of an arm is moved by that arm and by all that this stands on, and by nothing else: joints that
several ways have in common are judged by the readings of each.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.cells.cell import Arm, Cell, Point
from fastcal.cells.readings import Readings
from fastcal.conversion.joined import joined
from fastcal.measurements.conditions import condition_columns
from fastcal.measurements.dataset import Dataset
from fastcal.place import Place, joint_position, place_of
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Entry, Spec

_NOUNS = {"joint": "joint", "link": "link", "Gelenk": "joint", "Glied": "link"}  # as pages say them
_OF_AN_ARM = ("payload", "wrench", "temperature", "time", "station", "mount", "extra")  # and not of a joint
_OF_THE_LAST = ("robot", "payload", "structure")  # owners that are the arm's that carries the target


@dataclass(frozen=True, eq=False)
class Way:
    """The arms between the world and a target, from the ground on.

    Attributes:
        target: That is read, and stands on the last arm's flange.
        record: The `calibration` block that a model keeps of the way; None: none.
    """

    target: Point
    arms: tuple[Arm, ...]
    record: Spec | None = None

    @property
    def name(self) -> str:
        """That of its target."""
        return self.target.name

    @property
    def not_tried(self) -> list[str]:
        """Effects that no diagnosis of this way can try."""
        return []

    @property
    def seeing(self) -> tuple[str, ...]:
        """The camera and the board of pictures."""
        return ()

    @property
    def instrument(self) -> str:
        """What the target is read from."""
        return "world"

    @property
    def stacked(self) -> tuple[Arm, ...]:
        """The arms from where the way begins on, each on the one before; none where it begins on an arm's own frame."""
        return self.arms

    @property
    def root(self) -> str:
        """The arm whose base stands where the way begins; empty where there is none."""
        return self.stacked[0].name if self.stacked else ""

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rotation of what the way begins at, in the frame that the root stands on."""
        return np.eye(3)

    @property
    def folder(self) -> str:
        """Of its own page."""
        return self.name.replace(":", "-")

    def told(self, name: str) -> str:
        """An effect or parameter of `robot` as the cell calls it."""
        return name

    def tried_as(self, name: str) -> str:
        """What `robot` calls an effect of the cell."""
        return name

    def told_entry(self, entry: Entry) -> Entry:
        """An effect of `robot` as the arm that has it says it, its owner still that of the way."""
        values = {self.told(name): value for name, value in entry.get("parameters", {}).items()}
        return {**entry, "effect": self.told(entry["effect"]), "parameters": values}

    def told_member(self, name: str, entry: Spec) -> Spec:
        """A camera or board of `robot` as the cell has it."""
        raise ValueError(f"nothing is seen on the way to {self.name}, {name} neither: {entry}")

    @cached_property
    def robot(self) -> Robot:
        """The way as one serial arm whose tool is the target. InvalidInput where an arm cannot be a part of one."""
        whole = Robot(joined([arm.robot.spec for arm in self.arms], self.arms[-1].name))
        return whole.with_(tool=self.target.place, calibration=self.record)

    @cached_property
    def joints(self) -> list[tuple[Arm, int]]:
        """The arm of each joint, and its place there from 0."""
        return [(arm, i) for arm in self.arms for i in range(arm.robot.joint_count)]

    def owner(self, name: str) -> str:
        """An owner of `robot` as the cell calls it: joint5 is left.joint3, tool the target."""
        first, arrow, source = name.partition("<-")
        if arrow:
            return f"{self.owner(first)}<-{self.owner(source)}"
        place = place_of(name)
        if place.kind in ("joint", "link") and 0 < place.number <= len(self.joints):
            arm, index = self.joints[place.index]
            return str(Place(arm.name, place.kind, index + 1))
        if name == "base":
            return f"{self.arms[0].name}.base"
        if name == "tool":
            return self.name
        return f"{self.arms[-1].name}.{name}" if name in _OF_THE_LAST else name

    def column(self, name: str) -> str:
        """What something depends on as the cell calls it: q5 is left.q3."""
        own = {joint_position(i): f"{arm.name}.{joint_position(j)}" for i, (arm, j) in enumerate(self.joints)}
        return own.get(name, name)

    def words(self, text: str) -> str:
        """A sentence or label of `robot` with the cell's names: "joint5 zero" is "left.joint3 zero"; German too."""

        def named(found: re.Match[str]) -> str:
            kind = _NOUNS[found[1]]
            return self.owner(f"{kind}{found[2]}") if int(found[2]) <= len(self.joints) else found[0]

        return re.sub(rf"\b({'|'.join(_NOUNS)})[ \N{{NO-BREAK SPACE}}]?(\d+)\b", named, text)

    def rows(self, cell: Cell, readings: Readings) -> Dataset:
        """The postures of a cell as the way's own: its joints and conditions, and what was read of its target."""
        names = [titles[0] for titles in cell.joint_columns]
        own = [names.index(arm.joint_columns[index][0]) for arm, index in self.joints]
        fields = ("position", "rotation", "sigma_position", "sigma_rotation")
        given: dict[str, Any] = {field: readings.tables.get(f"{field}@{self.name}") for field in fields}
        seen = {name.partition("@")[0]: of for name, of in readings.tables.items() if name.endswith(f"@{self.name}")}
        labels = {name.partition("@")[0]: of for name, of in readings.labels.items() if name.endswith(f"@{self.name}")}
        lengths, anchor = seen.pop("distance", None), labels.pop("anchor", None)
        if lengths is not None and anchor is not None:  # one arm's lengths have an anchor
            given |= {"distance": lengths[:, 0], "anchor": anchor.texts}
        given["observed"] = {field: table for field, table in seen.items() if field not in fields}
        given["observed_labels"] = {field: of.texts for field, of in labels.items()}
        given |= self._conditions(readings)
        return Dataset.from_arrays(np.ascontiguousarray(readings.q[:, own]), source=readings.source, **given)

    def _conditions(self, readings: Readings) -> dict[str, Any]:
        """Those of each joint from its own arm, all others, payloads too, from the arm that carries the target."""
        arms = {name: condition_columns(data) for name, data in readings.arms.items()}
        if not all(arm.name in arms for arm, _ in self.joints):
            return {}
        out = {name: arms[self.arms[-1].name][name] for name in _OF_AN_ARM}
        for name in ("approach", "current"):
            columns = [(arms[arm.name][name], index) for arm, index in self.joints]
            if all(table is not None for table, _ in columns):
                out[name] = np.column_stack([table[:, index] for table, index in columns])
        return out

    def titles(self, cell: Cell) -> dict[str, str]:
        """Names, without unit, of the columns of positions in files of the cell, and what `robot` calls them."""
        names = {titles[0]: titles for titles in cell.joint_columns}
        own = [names[arm.joint_columns[index][0]] for arm, index in self.joints]
        return {title: joint_position(k) for k, titles in enumerate(own) for title in titles}


def serial_ways(cell: Cell, views: Sequence[str]) -> list[Way]:
    """The ways to all targets that were read from the world, each its own arms alone, in the order of the readings.

    Args:
        cell: The cell.
        views: TARGET or TARGET:SENSOR of what was read.
    """
    arms = {arm.flange: arm for arm in cell.arms}
    points = {of.name: of for of in cell.points}
    out = []
    for view in views:
        target = points.get(view)
        if target is None or target.on not in arms:
            continue
        chain = [arms[target.on]]
        while chain[0].on in arms:
            chain.insert(0, arms[chain[0].on])
        if chain[0].on == "world" and not any(arm.of_poses for arm in chain):
            out.append(Way(target, tuple(chain), cell.records.get(view)))
    return out
