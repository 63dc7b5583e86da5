# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The configuration of an arm: shoulder, elbow, wrist.

An arm with a shoulder (axis 2), a parallel elbow (axis 3) and a wrist centre (axes 4 and 5 meet) reaches a pose in up
to eight ways, two at each of three singularities: the wrist centre above axis 1, in the plane of axes 2 and 3, q5 = 0.
The side of each is the sign of

    shoulder  (w - p1) . (z2 x z1)           w the point of axis 5 nearest to axis 6
    elbow     z2 . ((p3 - p2) x (c - p2))    c the point of axis 5 nearest to axis 4
    wrist     sin q5

z_i and p_i direction and a point of axis i. det J is their product times a number of one sign.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.arrays import BoolArray, FloatArray
from fastcal.robot.robot import Robot

PARALLEL = 0.02  # rad: axes 2 and 3 of an arm of this kind, nominally parallel
MEETING = 0.005  # of the reach: how far axes 4 and 5 may pass by one another

_WORDS = (("front", "back"), ("up", "down"), ("positive", "negative"))


@dataclass(frozen=True)
class Posture:
    """Side of each of the three singularities; None where the arm has no such distinction.

    Attributes:
        behind: Is the wrist centre behind axis 1?
        elbow_up: Is it on the side of the lower arm where it is with an upright lower arm and all else ahead?
        wrist_negative: Is joint 5 of the controller between -180 and 0 degrees, whole turns apart?
    """

    behind: bool | None
    elbow_up: bool | None
    wrist_negative: bool


class SphericalWristArm:
    """Kinematics without effects that answers on which side of its singularities a posture is.

    Ahead is where the wrist centre is at q = 0; up is along axis 1, from the base to the shoulder or else upright.

    Args:
        nominal: As the robot's controller has it, or an identified robot: the sides are those of the singularities.
    """

    def __init__(self, nominal: Robot) -> None:
        self.robot = nominal.with_(effects=[])
        self.has_configurations = self._is_of_this_kind()
        if self.has_configurations:
            axes = _Axes(self.robot, np.zeros((1, 6)))
            ahead = float(axes.ahead()[0])
            self._ahead = np.sign(ahead) if abs(ahead) > MEETING * self.robot.reach else 0.0
            self._up = self._ahead * self._upright(axes)

    def posture(self, q: FloatArray) -> Posture:
        """The posture of q (n,)."""
        behind, down, negative = self.sides(q[np.newaxis])[0].tolist()
        return Posture(behind if self._ahead else None, not down if self._up else None, negative)

    def sides(self, q: FloatArray) -> BoolArray:
        """(N, 3) for q (N, 6): behind, elbow down, wrist negative; False where the arm has no such distinction."""
        axes = _Axes(self.robot, q)
        fifth = self.robot.pendant.shown(q)[:, 4]
        return np.column_stack([axes.ahead() * self._ahead < 0, axes.bent() * self._up < 0, np.sin(fifth) < 0])

    def words(self, q: FloatArray) -> NDArray[np.str_]:
        """(N,) for q (N, 6), such as "front up positive"; "-" where the arm has no such distinction."""
        known = (bool(self._ahead), bool(self._up), True)
        pairs = [pair if defined else ("-", "-") for pair, defined in zip(_WORDS, known, strict=True)]
        table = np.array([" ".join(pair[side >> k & 1] for k, pair in enumerate(pairs)) for side in range(8)])
        return np.asarray(table[self.sides(q) @ [1, 2, 4]])

    def _upright(self, axes: _Axes) -> float:
        """1 where axis 1 points up, -1 where down: from base to shoulder, against gravity where the two are one."""
        z1, p2 = axes.z[0, 0], axes.p[0, 1]
        T_world_base = np.asarray(self.robot.core.base_and_tool(self.robot.core.nominal)[0])
        height = float((p2 - T_world_base[:3, 3]) @ z1)
        if abs(height) < MEETING * self.robot.reach:
            gravity = np.array(self.robot.description.gravity_m_s2, dtype=float)
            if self.robot.description.gravity_frame == "base":
                gravity = T_world_base[:3, :3] @ gravity
            height = float(-gravity @ z1)
        return 0.0 if abs(height) < MEETING else float(np.sign(height))

    def _is_of_this_kind(self) -> bool:
        if self.robot.joint_types != ["revolute"] * 6:
            return False
        axes = _Axes(self.robot, np.full((1, 6), 0.3))
        (_, z2, z3, z4, z5, z6), (_, _, _, p4, p5, _) = axes.z[0], axes.p[0]
        across = np.cross(z4, z5)
        if np.linalg.norm(np.cross(z2, z3)) > PARALLEL:
            return False
        if min(np.linalg.norm(across), np.linalg.norm(np.cross(z5, z6))) < PARALLEL:
            return False
        apart = abs((p5 - p4) @ across) / np.linalg.norm(across)
        return bool(apart < MEETING * self.robot.reach)


def configurations(robot: Robot, q: ArrayLike) -> NDArray[np.str_]:
    """(N,) the configuration of a 6R arm at joint positions (N, 6): shoulder, elbow, wrist.

    "front" or "back": the wrist centre on the side of axis 1 where it is at q = 0, or beyond; "up" or "down": the side
    of the lower arm on which it is; "positive" or "negative": joint 5. "-" means that the arm has no such
    distinction, and all of it is "" where the arm has not six turning joints with
    axis 3 along axis 2 and axis 5 through axis 4.
    """
    rows = np.atleast_2d(np.asarray(q, dtype=float))
    arm = SphericalWristArm(robot)
    return arm.words(rows) if arm.has_configurations else np.full(len(rows), "")


def unwound(q: FloatArray, near: FloatArray, limits: FloatArray, turns: BoolArray | None = None) -> FloatArray:
    """(N, n) whole turns taken out of joint positions as far as the limits let them come nearer to `near`.

    Args:
        q: (N, n) or (n,).
        near: As q, or (n,).
        limits: (n, 2).
        turns: (n,) does the joint turn? None: all do.
    """
    whole = np.round((q - near) / (2 * np.pi))
    to = q - 2 * np.pi * (whole if turns is None else np.where(turns, whole, 0.0))
    return np.where((to >= limits[:, 0]) & (to <= limits[:, 1]), to, q)


class _Axes:
    """Directions and points of all axes (N, n, 3), from the tool's motion by each joint: p = p_tool + z x v."""

    def __init__(self, robot: Robot, q: FloatArray) -> None:
        J = robot.joint_jacobian(q).transpose(0, 2, 1)
        self.z = J[:, :, 3:]
        self.p = robot.forward(q)[:, np.newaxis, :3, 3] + np.cross(self.z, J[:, :, :3])

    def ahead(self) -> FloatArray:
        """(N,) how far the wrist centre is from axis 1, along z2 x z1."""
        wrist = self._nearest(4, 5) - self.p[:, 0]
        return np.asarray(np.sum(wrist * np.cross(self.z[:, 1], self.z[:, 0]), axis=1))

    def bent(self) -> FloatArray:
        """(N,) on which side of the lower arm the wrist centre is, about z2."""
        lower, whole = self.p[:, 2] - self.p[:, 1], self._nearest(4, 3) - self.p[:, 1]
        return np.asarray(np.sum(self.z[:, 1] * np.cross(lower, whole), axis=1))

    def _nearest(self, i: int, j: int) -> FloatArray:
        """(N, 3) the point of axis i nearest to axis j, both counted from 0: what leads to axis j is square to both."""
        apart = self.p[:, j] - self.p[:, i]
        c = np.sum(self.z[:, i] * self.z[:, j], axis=1)
        along = np.sum((self.z[:, i] - c[:, np.newaxis] * self.z[:, j]) * apart, axis=1) / (1 - c**2)
        return np.asarray(self.p[:, i] + along[:, np.newaxis] * self.z[:, i])
