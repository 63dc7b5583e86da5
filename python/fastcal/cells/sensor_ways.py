# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Ways from a sensor or camera to a target or board, each a serial arm: down one branch of the tree, up another.

With T_k(q) = B_k exp(S_1 q_1) ... exp(S_n q_n) M_k an arm's chain (B_k where it stands, M_k its end at q = 0), joints
f + 1 ... l between its links f and l are

    T_f^-1 T_l = M_f^-1 exp(S_{f+1} q_{f+1}) ... exp(S_l q_l) M_l,

and the same joints from l down to f are the inverse: screws -S in the other order, of the same positions q. Where the
way begins on a link that moves, gravity turns with it: loads are those that the whole tree puts on each joint.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import takewhile
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.branches import loaded
from fastcal.cells.carried_rig import seen_from
from fastcal.cells.cell import Arm, Cell, Point
from fastcal.cells.paths import Way, serial_ways
from fastcal.cells.readings import Readings
from fastcal.conversion.chain import Body, Chain, chain_of
from fastcal.conversion.joined import joined, moved, piece
from fastcal.effects.entries import effect_names, traits_of
from fastcal.effects.rig_traits import BRACKET_SAG
from fastcal.effects.traits import Traits
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.place import Place, owner_of, place_of, places_of
from fastcal.robot.core_model import pose
from fastcal.robot.rig import pictures
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Spec, frame_spec
from fastcal.robot.se3 import inverse

_OF_TORQUES = {
    "current_compliance": "joint_compliance",
    "rad_a": "compliance_rad_nm",
    "m_a": "compliance_m_n",
}
_ROOT, _END = "world", "arm"  # what cameras and boards of one arm's file stand on: the measuring frame, the flange


@dataclass(frozen=True, eq=False)
class Step:
    """A part of a way: an arm's joints from link `start` to link `end`, 0 its base.

    Attributes:
        enters: Does the way come to the arm's base from what it stands on?
        leaves: Does it go on from the base to what the arm stands on?
    """

    arm: Arm
    start: int
    end: int
    enters: bool = False
    leaves: bool = False

    @property
    def joints(self) -> list[int]:
        """From 0, in the order of the way."""
        return [*range(self.start, self.end), *reversed(range(self.end, self.start))]

    @property
    def back(self) -> Step:
        """The same way in the other direction."""
        return Step(self.arm, self.end, self.start, self.leaves, self.enters)

    def chain(self, has_loads: bool) -> Chain:
        """From the one link to the other; bodies only where loads are those of a standing arm."""
        low, high = sorted((self.start, self.end))
        whole = chain_of(self.arm.robot.spec)
        seen = moved(whole, inverse(self._link(whole, low)))
        own = slice(low, high)
        bodies: tuple[Body | None, ...] = seen.bodies[own] if has_loads else (None,) * (high - low)
        home = inverse(self._link(whole, low)) @ self._link(whole, high)
        up = Chain(seen.revolute[own], seen.omega[own], seen.v[own], home, bodies)
        if self.start <= self.end:
            return up
        down = moved(up, inverse(home))
        return Chain(down.revolute[::-1], -down.omega[::-1], -down.v[::-1], inverse(home), down.bodies[::-1])

    def _link(self, whole: Chain, number: int) -> FloatArray:
        """(4, 4) of a link in the arm's base frame at q = 0."""
        if number in (0, len(whole.revolute)):
            return whole.home if number else np.eye(4)
        robot = self.arm.robot
        model = _core.ErrorModel(robot.core)
        at_zero = _core.Samples(np.zeros((1, robot.joint_count)))
        T = np.asarray(model.predict(at_zero, model.start, of=f"link{number}"))[0]
        return np.asarray(inverse(robot.T_world_base) @ T)


@dataclass(frozen=True, eq=False, kw_only=True)
class SensorWay(Way):
    """From what reads to what is read; `target` is a board where pictures are.

    Attributes:
        sensor: A sensor, or a camera, of the cell.
        steps: From the sensor's frame to the target's, or, of pictures of a board that does not move in the frame
            where the ways of both part, from the board's to the camera's.
        stands: Does the way begin on the world? Then loads are those of any arm.
        camera, board: As the cell has them; None where poses or points were read.
    """

    sensor: Point
    steps: tuple[Step, ...]
    stands: bool
    camera: Spec | None = None
    board: Spec | None = None

    @property
    def name(self) -> str:
        """TARGET:SENSOR, as the readings have it: TARGET alone from the world."""
        return self.target.name if self.sensor.name == "world" else f"{self.target.name}:{self.sensor.name}"

    @property
    def has_pictures(self) -> bool:
        """Were corners seen, and not points or poses?"""
        return self.camera is not None

    @property
    def seeing(self) -> tuple[str, ...]:
        """The camera and the board of pictures."""
        return (self.sensor.name, self.target.name) if self.has_pictures else ()

    @property
    def instrument(self) -> str:
        """The sensor or camera."""
        return self.sensor.name

    @property
    def stacked(self) -> tuple[Arm, ...]:
        """As of any way."""
        return tuple(step.arm for step in takewhile(lambda step: step.enters, self.steps))

    @property
    def axes(self) -> FloatArray:
        """(3, 3) of the sensor."""
        return self._place[:3, :3]

    @cached_property
    def joints(self) -> list[tuple[Arm, int]]:
        """The arm of each joint, and its place there from 0."""
        return [(step.arm, joint) for step in self.steps for joint in step.joints]

    def owner(self, name: str) -> str:
        """As of any way; the base is the sensor, the tool the target."""
        ends = {"base": self.sensor.name, "tool": self.target.name}
        if name == "base" and self.instrument == "world":
            return str(Place(self.root, "base", 0))
        return ends[name] if name in ends else super().owner(name)

    @cached_property
    def _chain(self) -> tuple[Spec, FloatArray]:
        """Its joints as one spec without ends, and (4, 4) where the frame at the way's end is on the last link."""
        T, specs = inverse(self._place), list[Spec]()
        for step in self.steps:
            base = pose(vars(step.arm.robot.description.base))
            T = T @ base if step.enters else T
            if step.joints:
                chain, own = step.chain(self.stands), list(self._effects(step))
                specs.append(piece(step.arm.robot.spec, chain, step.joints, T, own))
                T = np.eye(4)
            T = T @ inverse(base) if step.leaves else T
        out = joined(specs, self.name)
        out["gravity_m_s2"] = (self._place[:3, :3].T @ np.asarray(out["gravity_m_s2"], dtype=float)).tolist()
        return out, T

    @property
    def _place(self) -> FloatArray:
        """(4, 4) of what the way begins at, on its frame."""
        return np.eye(4) if self.has_pictures else pose(self.sensor.place)

    @cached_property
    def robot(self) -> Robot:
        """The way as one serial arm. InvalidInput where an arm cannot be a part of one."""
        out, T = self._chain
        if not self.has_pictures:
            return Robot({**out, "tool": frame_spec(T @ pose(self.target.place))})
        return Robot({**out, "tool": frame_spec(np.eye(4)), **self._rig(T)})

    def _rig(self, T_end: FloatArray) -> Spec:
        """The camera and the board, the one on the measuring frame, the other on the flange."""
        camera, board = dict(self.camera or {}), dict(self.board or {})
        if not self.stands and any(key.startswith("sag") for key in camera):
            raise InvalidInput(
                f"the mount of {self.sensor.name} gives under its own weight, which a way between two frames that move "
                "cannot bring along"
            )
        if self._from_board:
            board["on"], camera = _ROOT, {**seen_from(camera, T_end), "on": _END}
        else:
            camera["on"], board = _ROOT, {**seen_from(board, T_end), "on": _END}
        return {"cameras": {self.sensor.name: camera}, "boards": {self.target.name: board}}

    def told_member(self, name: str, entry: Spec) -> Spec:
        """The camera or board of `robot` on the cell's own frame."""
        is_end = (name == self.sensor.name) == self._from_board
        return seen_from(entry, inverse(self._chain[1])) if is_end else entry

    @property
    def _from_board(self) -> bool:
        """Does the way begin at the board?"""
        return self.board is not None and place_of(self.board["on"]) == place_of(self._root)

    @property
    def _root(self) -> str:
        first = self.steps[0]
        if first.enters:
            return first.arm.on
        return f"{first.arm.name}.{f'link{first.start}' if first.start else 'base'}"

    def _effects(self, step: Step) -> Iterator[Spec]:
        """The effects of the arm's joints that are on the way, by their numbers in the step."""
        for effect in step.arm.robot.entries:
            places, traits = places_of(effect["owner"]), traits_of(effect["effect"])
            on_axis = traits.refers_to == "axes" and all(of.kind == "joint" and of.number for of in places)
            on_axis = on_axis and len({of.index in step.joints for of in places}) == 1
            if not on_axis or not (self.stands or _goes_without_loads(traits)):
                raise InvalidInput(
                    f"arm {step.arm.name} has {effect['effect']}@{effect['owner']}, which a way from a sensor to a "
                    "target cannot bring along"
                )
            if places[0].index in step.joints:
                own = (replace(of, number=step.joints.index(of.index) + 1) for of in places)
                yield {**effect, "owner": owner_of(own)}

    def told(self, name: str) -> str:
        """As the cell calls it: what followed torques, where it moves, as if they were currents."""
        return name if self.stands else _OF_TORQUES.get(name, name)

    def tried_as(self, name: str) -> str:
        """What `robot` calls it."""
        return name if self.stands else {of: own for own, of in _OF_TORQUES.items()}.get(name, name)

    @property
    def not_tried(self) -> list[str]:
        """What follows the loads of an arm, or mount, that stands, where the way begins on a link that moves."""
        if self.stands:
            return []
        names = [name for name in effect_names() if not _goes_without_loads(traits_of(name))]
        return [*names, BRACKET_SAG] if self.has_pictures else names

    def measured(self, cell: Cell, data: Dataset, readings: Readings) -> Dataset:
        """The way's rows with its corners, and, where it moves, the gravity torques of its joints as `current`.

        Args:
            cell: The tree.
            data: Its joints and conditions, and what was read of its target.
            readings: Those of the whole cell, row by row the same.
        """
        if not self.stands:
            data = replace(data, current=joint_loads(cell, self.joints, readings))
        if self.has_pictures:
            part = pictures(cell)[self.sensor.name, self.target.name]
            uv = np.ascontiguousarray(readings.tables[CORNERS][:, 2 * part.start : 2 * part.stop])
            data = replace(data, observed={**data.observed, CORNERS: uv})
            if (sigma := readings.tables.get(f"sigma_{CORNERS}")) is not None:
                own = np.ascontiguousarray(sigma[:, part])
                data = replace(data, observed={**data.observed, f"sigma_{CORNERS}": own})
        return data


def joint_loads(cell: Cell, joints: Sequence[tuple[Arm, int]], postures: Readings) -> FloatArray | None:
    """(N, n) torques and forces of gravity along joints of a tree [N m, N], payloads too; None where they are all 0."""
    model = _core.ErrorModel(cell.core)
    loads = np.asarray(model.loads(postures.samples(cell), model.start))
    columns = []
    for arm, index in joints:
        moment = loads[:, cell.core.frame(f"{arm.name}.joint{index + 1}")]
        columns.append(moment[:, 5 if arm.robot.joint_types[index] == "revolute" else 2])
    out = np.column_stack(columns)
    return out if out.any() else None


def seen_ways(cell: Cell, readings: Readings) -> list[Way]:
    """The ways of all that was read: from the world to targets, from sensors to targets, from cameras to boards.

    Raises:
        InvalidInput: No joint lies between what reads and what is read.
    """
    points = {of.name: of for of in cell.points}
    out = [loaded(cell, way) for way in serial_ways(cell, readings.views)]
    known = {way.name for way in out}
    for view in readings.views:
        target, _, sensor = view.partition(":")
        if view in known or f"position@{view}" not in readings.tables:
            continue
        world = Point("world", "sensor", "world", frame_spec(np.eye(4)))
        ends = points[target], points.get(sensor, world)
        steps, stands = steps_between(cell, ends[1].on, ends[0].on)
        if any(step.joints for step in steps):
            out.append(SensorWay(ends[0], _arms(steps), sensor=ends[1], steps=steps, stands=stands))
    out += _picture_ways(cell, readings)
    if not out and (lengths := lengths_alone(readings)):
        raise InvalidInput(
            f"{', '.join(lengths)}: no cause is looked for in lengths alone; expected the position of a target as "
            "well, such as x_mm@TARGET or x_mm@TARGET:SENSOR"
        )
    if not out:
        read = ", ".join(readings.views) or "nothing"
        raise InvalidInput(
            "expected readings of targets, or pictures of boards, that joints move where they are read from, such as "
            f"x_mm@TARGET or x_mm@TARGET:SENSOR, got {read}"
        )
    return out


def lengths_alone(readings: Readings) -> list[str]:
    """The views of which lengths were read, and no points, in which no way is looked for."""
    return [
        view
        for view in readings.views
        if f"distance@{view}" in readings.tables and f"position@{view}" not in readings.tables
    ]


def _picture_ways(cell: Cell, readings: Readings) -> Iterator[Way]:
    if CORNERS not in readings.tables:
        return
    uv = readings.tables[CORNERS]
    for (camera, board), part in pictures(cell).items():
        eye, plate = cell.cameras[camera], cell.boards[board]
        if not np.isfinite(uv[:, 2 * part.start : 2 * part.stop]).any():
            continue
        steps, stands = steps_between(cell, eye["on"], plate["on"])
        if not any(step.joints for step in steps):
            continue
        back, fixed = steps_between(cell, plate["on"], eye["on"])
        if fixed and not stands:
            steps, stands = back, fixed
        target, sensor = Point(board, "board", plate["on"], plate), Point(camera, "camera", eye["on"], eye)
        seen: dict[str, Any] = {"sensor": sensor, "steps": steps, "stands": stands, "camera": eye, "board": plate}
        yield SensorWay(target, _arms(steps), **seen)


def _arms(steps: Sequence[Step]) -> tuple[Arm, ...]:
    return tuple({step.arm.name: step.arm for step in steps}.values())


def steps_between(cell: Cell, start: str, end: str) -> tuple[tuple[Step, ...], bool]:
    """From one frame of a cell to another, and whether the first of them stands on the world."""
    down, up = _carriers(cell, start), _carriers(cell, end)
    stands = not any(count for _, count in down)
    while down and up and down[0] == up[0]:
        down, up = down[1:], up[1:]
    middle = list[Step]()
    if down and up and down[0][0] == up[0][0]:
        arm = cell.arm(down[0][0])
        middle = [Step(arm, down[0][1], up[0][1])]
        down, up = down[1:], up[1:]
    back = [Step(cell.arm(name), count, 0, leaves=True) for name, count in reversed(down)]
    on = [Step(cell.arm(name), 0, count, enters=True) for name, count in up]
    return (*back, *middle, *on), stands


def _carriers(cell: Cell, on: str) -> list[tuple[str, int]]:
    """The arms that carry a frame, from the ground on, each with the link on which the next stands."""
    out: list[tuple[str, int]] = []
    while on != "world":
        place = place_of(on)
        out.insert(0, (place.arm, place.number))
        on = cell.arm(place.arm).on
    return out


def _goes_without_loads(traits: Traits) -> bool:
    """Says an effect the same of an arm whose base is not at rest?"""
    follows = {"torque", "load", "q"} & set(traits.depends_on)
    of_the_arm = traits.place in ("link", "payload", "structure") or "compensator" in traits.needs_data
    return not follows and not of_the_arm
