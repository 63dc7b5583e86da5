# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where an arm is measured: what it must not touch, where its tool may be, and what the tracker sees."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.robot import se3
from fastcal.robot.robot import Robot
from fastcal.said import said

Point = Sequence[float]
Corners = tuple[Point, Point]

REASONS: dict[int, str] = {
    1: said("meet a keep-out box"),
    2: said("leave the region"),
    3: said("are out of the tracker's range"),
    4: said("turn the reflector away"),
    5: said("are hidden from the tracker"),
    6: said("go below the mounting face or into the arm's own column"),
}
COLLISIONS = (1, 6)  # the reasons for which an arm can't be where a posture brings it
COLUMN = 0.1  # of the reach: radius of the arm's own column about the base's z
UNSEEN = (3, 4, 5)  # the reasons that concern the tracker alone


@dataclass(frozen=True)
class Tracker:
    """An instrument that looks at a reflector on the tool; SI, measuring frame.

    Attributes:
        position: (3,) [m].
        nearest: Least distance that it measures [m].
        farthest: Largest distance [m].
        reflector: (3,) where the reflector looks, in the tool's axes; None: it is turned by hand, or sees all around.
        acceptance: Largest angle between that and the beam [rad].
    """

    position: Point
    nearest: float = 0.0
    farthest: float = float("inf")
    reflector: Point | None = None
    acceptance: float = float(np.pi / 6)


@dataclass(frozen=True)
class Surroundings:
    """Where an arm may be measured; points in the measuring frame [m].

    Attributes:
        keep_out: Boxes, lower and higher corner, that links from the second joint on must not meet, nor the beam.
        region: The box in which the tool's point must lie.
        tracker: What must see the target; None: nothing is asked.
        link_radius: How thick the straight links between the joints are [m]; keep-out boxes grow by it.
        mounting: Keep the arm above the face that it is mounted on, z = 0 of its base, and wrist and tool out of its
            own column; False: it may reach below, as on a pedestal or a rail. Not asked of an arm with closed loops,
            which may hang from its base, as a delta does, nor of a gantry, whose first two joints slide.
    """

    keep_out: Sequence[Corners] = ()
    region: Corners | None = None
    tracker: Tracker | None = None
    link_radius: float = 0.0
    mounting: bool = True

    def obstacles(self, robot: Robot, q: FloatArray, *, threads: int = 1) -> NDArray[np.int64]:
        """(N,) 0 where a posture of q (N, n) can be measured, else a key of REASONS: the first that holds."""
        tracker = None
        if self.tracker is not None:
            seen = self.tracker
            reflector = np.zeros(3) if seen.reflector is None else _point(seen.reflector)
            tracker = _core.Tracker(_point(seen.position), seen.nearest, seen.farthest, reflector, seen.acceptance)
        out = np.asarray(
            _core.posture_obstacles(
                robot.core,
                q,
                keep_out=[(_point(low), _point(high)) for low, high in self.keep_out],
                region=None if self.region is None else (_point(self.region[0]), _point(self.region[1])),
                tracker=tracker,
                link_radius=self.link_radius,
                threads=threads,
            ),
            dtype=np.int64,
        )
        if self.mounting and _stands(robot):
            out[(out == 0) & _meets_mounting(robot, q, self.link_radius)] = 6
        return out


def _stands(robot: Robot) -> bool:
    """Does the arm rise from its base? Robots with closed loops and gantries may hang from it."""
    return not robot.passive and tuple(robot.joint_types[:2]) != ("prismatic", "prismatic")


def _meets_mounting(robot: Robot, q: FloatArray, radius: float) -> NDArray[np.bool_]:
    """(N,) where a joint beyond the second, or the tool, is below z = 0 of the base, or wrist or tool in the column.

    Links are straight between joints, so that they are above a plane where their ends are. The column stands from the
    base to the second joint.
    """
    joint_count = robot.joint_count
    T_base_world = se3.inverse(robot.core.base_and_tool(robot.core.nominal)[0])
    origins = np.asarray(robot.core.frame_origins(np.ascontiguousarray(q)))  # in the measuring frame
    origins = origins @ T_base_world[:3, :3].T + T_base_world[:3, 3]
    joints = origins[:, [2 * joint - 1 for joint in range(1, joint_count + 1)]]
    moving = np.concatenate([joints[:, 2:], origins[:, -1:]], axis=1)
    below = (moving[:, :, 2] < radius).any(axis=1)
    ends = np.concatenate([joints[:, max(joint_count - 2, 2) :], origins[:, -1:]], axis=1)
    top = joints[:, 1:2, 2] if joint_count > 1 else np.zeros((len(q), 1))
    inside = (np.hypot(ends[..., 0], ends[..., 1]) < COLUMN * robot.reach + radius) & (ends[..., 2] < top)
    return np.asarray(below | inside.any(axis=1))


def _point(values: Point) -> FloatArray:
    return np.asarray(values, dtype=np.float64)
