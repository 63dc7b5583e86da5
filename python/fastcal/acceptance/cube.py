# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The test cube of ISO 9283 and its five poses, and where in an arm's workspace the largest one lies.

The cube's edges, of length a, are parallel to the base's axes. Its corners are C1 (- - -), C2 (+ - -), C3 (+ + -),
C4 (- + -) and above them C5 to C8. The poses lie in the plane C1 C2 C7 C8: P1 in the middle c, the others on the
diagonals, a tenth of the diagonal from its ends: P_k = c + 0.8 (C - c), with C = C1, C2, C7, C8 for k = 2 ... 5.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import inverse_kinematics
from fastcal.robot import se3
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import Frame
from fastcal.units import from_si

CORNERS = np.array([[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])
PLANE = (0, 1, 6, 7)  # C1, C2, C7, C8
FROM_THE_MIDDLE = 0.8  # of half a diagonal
EDGES = (1.0, 0.63, 0.4, 0.25, 0.16, 0.1)  # m; the standard's sizes, and two for small arms
POSES = ("P1", "P2", "P3", "P4", "P5")

_SHARES_OF_REACH = np.arange(0.2, 0.8, 0.05)
_HEIGHTS_OF_REACH = np.arange(0.1, 0.75, 0.08)
_TILTS = (np.pi, 0.75 * np.pi, 0.5 * np.pi)  # of the tool: down, halfway, forward
_COLUMN = 0.1  # of the reach, that the arm's own column takes
_CLEARANCE = 0.02  # of a joint's range, from its limits
_SINGULAR = 0.05  # least singular value of the joint Jacobian, lengths in quarters of the reach


@dataclass(frozen=True, eq=False)
class Cube:
    """A test cube, in the robot's base.

    Attributes:
        centre: (3,) [m].
        edge: [m].
        rotation: (3, 3) of the tool in all its poses.
    """

    centre: FloatArray
    edge: float
    rotation: FloatArray

    @property
    def corners(self) -> FloatArray:
        """(8, 3) C1 ... C8 [m]."""
        return np.asarray(self.centre + 0.5 * self.edge * CORNERS)

    @property
    def points(self) -> FloatArray:
        """(5, 3) P1 ... P5 [m]."""
        return np.vstack([self.centre, self.centre + FROM_THE_MIDDLE * (self.corners[list(PLANE)] - self.centre)])

    def poses(self, points: FloatArray) -> FloatArray:
        """(N, 4, 4) T_base_tool at points (N, 3)."""
        return np.array([se3.pose(self.rotation, point) for point in points])


def based_at_origin(robot: Robot) -> Robot:
    """The robot with its base as the measuring frame."""
    return robot.with_(base=Frame())


def largest_cube(
    robot: Robot,
    *,
    centre: FloatArray | None = None,
    edge: float | None = None,
    rotation: FloatArray | None = None,
) -> tuple[Cube, FloatArray]:
    """The largest cube whose corners and poses the robot reaches in one configuration, and its joints at P1 ... P5.

    Of several of one size, the one that stays farthest from singular postures. What is given is kept.

    Args:
        robot: As its controller has it; its base is not looked at.
        centre: (3,) in the base [m].
        edge: [m].
        rotation: (3, 3) of the tool in the base.

    Raises:
        InvalidInput: There is none.
    """
    arm = based_at_origin(robot)
    reach = arm.reach
    tried = (
        [np.asarray(centre, dtype=float)]
        if centre is not None
        else [np.array([x * reach, 0.0, z * reach]) for x in _SHARES_OF_REACH for z in _HEIGHTS_OF_REACH]
    )
    turns = [rotation] if rotation is not None else [se3.rotation_y(tilt) for tilt in _TILTS]
    middles = [Cube(middle, 0.0, np.asarray(turn, dtype=float)) for turn in turns for middle in tried]
    found = inverse_kinematics(arm, np.concatenate([cube.poses(cube.centre[np.newaxis]) for cube in middles]))
    for size in (edge,) if edge is not None else EDGES:
        best: tuple[float, Cube, FloatArray] | None = None
        for cube, seed, reached in zip(middles, found.q, found.reached, strict=True):
            sized = replace(cube, edge=float(size))
            if reached and (centre is not None or _is_before(sized, reach)):
                clear, q = _clearance(arm, sized, seed)
                if q is not None and (best is None or clear > best[0]):
                    best = clear, sized, q
        if best is not None:
            return best[1], best[2]
    raise InvalidInput(_not_found(robot, centre, edge))


def _is_before(cube: Cube, reach: float) -> bool:
    """Is the cube above the foot of the arm and before it? Where nothing is given, a floor and a column are assumed."""
    low = cube.corners.min(axis=0)
    return bool(low[2] >= 0 and low[0] >= _COLUMN * reach)


def _clearance(arm: Robot, cube: Cube, seed: FloatArray) -> tuple[float, FloatArray | None]:
    """How far poses and corners are from singular, and the joints at the poses; None where one is not reached."""
    solved = inverse_kinematics(arm, cube.poses(np.vstack([cube.points, cube.corners])), seed=seed, restarts=0)
    if not solved.reached.all():
        return 0.0, None
    low, high = arm.limits.T
    span = np.where(np.isfinite(high - low), high - low, 1.0)
    room = np.minimum(solved.q - low, high - solved.q) / span
    J = arm.joint_jacobian(solved.q)
    J[:, :3] /= arm.reach / 4
    least = float(np.linalg.svd(J, compute_uv=False).min())
    return least, solved.q[:5] if room.min() >= _CLEARANCE and least >= _SINGULAR else None


def _not_found(robot: Robot, centre: FloatArray | None, edge: float | None) -> str:
    size = f"with an edge of {from_si(edge, 'mm'):g} mm" if edge is not None else "of any size"
    at = "" if centre is None else f" at {', '.join(f'{v:g}' for v in from_si(centre, 'mm'))} mm"
    return (
        f"{robot.name} reaches no test cube {size}{at} in one configuration and clear of its limits; another centre, a "
        "smaller edge or another orientation of the tool may do"
    )
