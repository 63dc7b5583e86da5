# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A cell: arms, targets and instruments, each standing on the world or on a frame of an arm, as one tree of frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.moving_rig import gravity_of
from fastcal.cells.knocked import name_before, pose_before, relative_before
from fastcal.effects import registered
from fastcal.effects.entries import extra_columns, label, table_width
from fastcal.effects.values import parameter_values
from fastcal.errors import InvalidInput
from fastcal.place import joint_position
from fastcal.robot.core_model import pose
from fastcal.robot.identified_spec import Values, identified_spec
from fastcal.robot.rig import core_rig, with_found
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Spec, frame_spec
from fastcal.robot.se3 import inverse
from fastcal.units import to_si

FloatArray = NDArray[np.float64]
SIGMA_MM, SIGMA_DEG = 5.0, 0.3  # plausible errors of where a cell's file says that something stands


@dataclass(frozen=True)
class Known:
    """How surely it is known where something stands: `fixed`, within standard deviations, or (all None) not at all."""

    fixed: bool = False
    sigma_mm: float | None = None
    sigma_deg: float | None = None


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm of a cell.

    Attributes:
        robot: Its `base` is where the arm stands on the frame `on`.
        on: `world`, or a frame of another arm: `left.link7`.
        of_poses: Only the pose of its flange is known, and it has no geometry to identify.
    """

    name: str
    robot: Robot
    on: str = "world"
    known: Known = Known()
    of_poses: bool = False

    @property
    def flange(self) -> str:
        """The name of its last link in the tree."""
        return f"{self.name}.link{self.robot.joint_count}"

    @property
    def joint_columns(self) -> list[tuple[str, ...]]:
        """Of each joint the names, without a unit, that its column may have: `left.q1`, a URDF's own name."""
        own = [joint.name for joint in self.robot.joints]
        return [(f"{self.name}.{joint_position(i)}", *([name] if name else [])) for i, name in enumerate(own)]


@dataclass(frozen=True)
class Point:
    """One frame: a target that is read, or an instrument that reads.

    Attributes:
        role: target or sensor.
        on: `world`, or a frame of an arm.
        place: {xyz_mm, rpy_deg} on that frame.
        knocked: {at_row, before_mm, before_deg}: that it stood elsewhere before a row, relative to its place since, as
            a camera may; None: it did not.
    """

    name: str
    role: str
    on: str
    place: Spec
    known: Known = Known()
    knocked: Spec | None = None

    @property
    def before(self) -> Point | None:
        """Where it stood before it was knocked, as a frame of its own; None where it was not knocked."""
        if self.knocked is None:
            return None
        place = frame_spec(pose(self.place) @ pose_before(self.knocked))
        return Point(name_before(self.name, self.knocked["at_row"]), self.role, self.on, place)


@dataclass(frozen=True)
class Distance:
    """A length between two frames that is known beforehand, as of a bar: `known_distances` of the file."""

    start: str
    end: str
    mm: float
    sigma_mm: float

    @property
    def entry(self) -> Spec:
        """As a file has it."""
        return {"from": self.start, "to": self.end, "mm": self.mm, "sigma_mm": self.sigma_mm}

    @property
    def view(self) -> str:
        """As the core names what is read of one frame from another."""
        return f"{self.start}:{self.end}"


@dataclass(frozen=True, eq=False)
class Cell:
    """Arms, points, cameras and boards, in the order of the file; each stands on the world or on another's frame.

    Attributes:
        cameras, boards: By their names, as a robot's spec has them; `on` names a frame of the tree.
        touched: Lengths between points that are touched, such as `socket a`, known beforehand.
        records: Of each way from the world to a target how surely its numbers are known, by the target: a
            `calibration` block as a robot's spec has it.
        record: The same of all parameters of the tree, its cameras and boards together; None where it is not known.
        found: Where a fit has found what has no place in the tree, such as sockets, SI, by owner and name; a file keeps
            none of it.
    """

    name: str
    arms: tuple[Arm, ...]
    points: tuple[Point, ...] = ()
    distances: tuple[Distance, ...] = ()
    cameras: Mapping[str, Spec] = field(default_factory=dict)
    boards: Mapping[str, Spec] = field(default_factory=dict)
    records: Mapping[str, Spec] = field(default_factory=dict)
    record: Spec | None = None
    touched: tuple[Distance, ...] = ()
    found: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def arm(self, name: str) -> Arm:
        """The arm of this name."""
        return next(arm for arm in self.arms if arm.name == name)

    @property
    def only_arm(self) -> Robot:
        """The robot of the cell's one arm. InvalidInput where there are several."""
        if len(self.arms) > 1:
            raise InvalidInput(f"{self.name}: expected one arm, got {len(self.arms)}")
        return self.arms[0].robot

    @property
    def without_effects(self) -> Cell:
        """The cell with its arms' geometry alone: effects are small beside a place or a column, some in no chain."""
        return replace(self, arms=tuple(replace(arm, robot=arm.robot.with_(effects=[])) for arm in self.arms))

    @cached_property
    def core(self) -> _core.RobotModel:
        """The tree of all frames. InvalidInput where something stands on nothing, or on itself."""
        size: dict[str, Any] = {"sigma_position": to_si(SIGMA_MM, "mm"), "sigma_rotation": to_si(SIGMA_DEG, "deg")}
        arms = [_core.Member(name=arm.name, on=arm.on, robot=arm.robot.core, **size) for arm in self.arms]
        points = [_core.Member(name=of.name, on=of.on, T_on_frame=pose(of.place), **size) for of in self.frames]
        return _core.join([*arms, *points])

    @property
    def knocked_rows(self) -> dict[str, int]:
        """From which row on a point stands where it does, of those that were knocked."""
        return {of.name: int(of.knocked["at_row"]) for of in self.points if of.knocked is not None}

    @property
    def frames(self) -> list[Point]:
        """Its points, and behind them those that were knocked as they stood before."""
        return [*self.points, *(before for of in self.points if (before := of.before) is not None)]

    @cached_property
    def model(self) -> _core.ErrorModel:
        """The tree with the effects of its arms, as their files have them."""
        before: dict[str, dict[str, int]] = {}
        extra = table = 0
        for branch in (of for of in self.core.branches if of.joint_count):
            before[branch.name] = {"extra": extra, "table": table}
            entries = self.arm(branch.name).robot.entries
            extra, table = extra + len(extra_columns(entries)), table + table_width(entries)
        effects, values = [], []
        for arm in self.arms:
            for entry, effect in zip(arm.robot.entries, arm.robot.effects, strict=True):
                own = registered.find(entry["effect"])
                if own is not None and own.follows_loads:
                    raise InvalidInput(
                        f"arm {arm.name}: {label(entry)} is written in Python and follows loads, which are those of an "
                        "arm that stands alone"
                    )
                effects.append(_core.on_branch(effect, self.core, arm.name, arm.robot.core, **before[arm.name]))
                values += parameter_values(entry, effect)
        return _core.ErrorModel(self.core, effects, np.asarray(values, dtype=float))

    @property
    def rig(self) -> _core.Rig:
        """Cameras and boards. InvalidInput where one stands on a frame that there is not."""
        return core_rig(self, self.core.frame)

    def frames_at(self, q: FloatArray, on: str) -> FloatArray:
        """(N, 4, 4) poses in the world of a frame of the tree, as the files have it, in postures q (N, n)."""
        if on == "world":
            return np.broadcast_to(np.eye(4), (len(q), 4, 4))
        rigid = _core.ErrorModel(self.core, [], np.zeros(0))
        return np.asarray(rigid.predict(_core.Samples(np.ascontiguousarray(q)), rigid.start, of=on))

    @property
    def gravity(self) -> FloatArray:
        """(3,) [m/s^2] in the world: that of the first arm that stands on it."""
        return gravity_of(next((arm for arm in self.arms if arm.on == "world"), self.arms[0]).robot.description)

    @cached_property
    def joint_columns(self) -> list[tuple[str, ...]]:
        """As `Arm.joint_columns`, of all joints in the order of the tree; of a cell's only arm `q1` as well."""
        arms = {arm.name: arm for arm in self.arms}
        columns = [names for of in self.core.branches if of.joint_count for names in arms[of.name].joint_columns]
        if len(arms) > 1:
            return columns
        return [(*names, joint_position(i)) for i, names in enumerate(columns)]

    @cached_property
    def joint_types(self) -> list[str]:
        """Revolute or prismatic, in the order of the tree."""
        arms = {arm.name: arm for arm in self.arms}
        return [kind for of in self.core.branches if of.joint_count for kind in arms[of.name].robot.joint_types]

    def known(self, name: str) -> Known:
        """How surely it is known where a branch stands."""
        members: list[Arm | Point] = [*self.arms, *self.frames]
        return next(of.known for of in members if of.name == name)

    def with_rig(self, unknowns: Sequence[_core.Parameter], values: FloatArray, std: FloatArray) -> Cell:
        """The cell with cameras and boards, and lenses, changed by values (U,) of their unknowns, SI."""
        rig = with_found({"cameras": dict(self.cameras), "boards": dict(self.boards)}, unknowns, values, std)
        return replace(self, cameras=rig["cameras"], boards=rig["boards"])

    def with_values(self, theta: FloatArray) -> Cell:
        """The cell with other values (P,) of the parameters of `model`, SI; of the tree's alone effects stay."""
        branches, count = {branch.name: branch for branch in self.core.branches}, len(self.core.nominal)
        places = dict(zip(branches, self.core.placements(theta[:count]), strict=True))
        of_effects, at = dict[str, FloatArray](), count
        for arm in self.arms:
            size = sum(len(effect.parameters) for effect in arm.robot.effects)
            of_effects[arm.name] = theta[at : at + size]
            at += size

        def arm_there(arm: Arm) -> Arm:
            branch = branches[arm.name]
            own = theta[branch.first_parameter : branch.first_parameter + branch.parameter_count]
            model = arm.robot.error_model
            before = np.asarray(model.start)[len(own) :]
            effects = of_effects[arm.name] if len(of_effects[arm.name]) == len(before) else before
            robot = Robot.keeping(identified_spec(arm.robot, model, Values(np.concatenate([own, effects]))))
            stay = np.array_equal(effects, before)
            return replace(arm, robot=robot.with_(effects=arm.robot.entries) if robot.entries and stay else robot)

        def point_there(of: Point) -> Point:
            T, before = places[of.name], of.before
            if before is None or of.knocked is None:
                return replace(of, place=frame_spec(T))
            knocked = {**of.knocked, **relative_before(inverse(T) @ places[before.name])}
            return replace(of, place=frame_spec(T), knocked=knocked)

        return replace(self, arms=tuple(map(arm_there, self.arms)), points=tuple(map(point_there, self.points)))
