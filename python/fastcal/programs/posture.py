# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which of its solutions an arm stands in: wrist before or behind axis 1, and on which side of the lower arm.

An arm with a shoulder (axis 2), a parallel elbow (axis 3) and a wrist centre (axes 4 and 5 meet) reaches a pose in up
to eight ways, two at each of three singularities: the wrist centre on axis 1, in the plane of axes 2 and 3, q5 = 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.robot import Robot

FloatArray = NDArray[np.float64]

PARALLEL = 0.02  # rad: axes 2 and 3 of an arm of this kind, nominally parallel
MEETING = 0.005  # of the reach: how far axes 4 and 5 may pass by one another


@dataclass(frozen=True)
class Posture:
    """Which side of the three singularities; None where the arm does not tell.

    Attributes:
        behind: Is the wrist centre behind axis 1?
        elbow_up: Is it on the side of the lower arm where it is with an upright lower arm and all else ahead?
        wrist_negative: Is joint 5 between -180 and 0 degrees, whole turns apart?
    """

    behind: bool | None
    elbow_up: bool | None
    wrist_negative: bool


class Arm:
    """Nominal kinematics that answers on which side of its singularities a posture is.

    Ahead is where the wrist centre is at q = 0; up is along axis 1, from the base to the shoulder or else upright.

    Args:
        nominal: Without effects, as the robot's controller has it.
    """

    def __init__(self, nominal: Robot) -> None:
        self.robot = Robot(nominal.spec | {"effects": []})
        self.has_configurations = self._is_of_this_kind()
        if self.has_configurations:
            axes = self._axes(np.zeros(6))
            self._z1, self._p1 = axes[0]
            self._zero_ahead = self._ahead(axes)
            up = self._up(axes)
            self._zero_elbow = None if up is None else float(axes[1][0] @ np.cross(up, self._zero_ahead))

    def posture(self, q: FloatArray) -> Posture:
        """Where q (n,) stands.

        Behind: the wrist centre against the direction of ahead, turned with joint 1. Elbow up: the sign of
        z2 . ((p3 - p2) x (wrist - p2)), held against that of z2 . (up x ahead).
        """
        axes = self._axes(q)
        (z2, p2), (_, p3) = axes[1], axes[2]
        behind = up = None
        if np.linalg.norm(self._zero_ahead) > MEETING * self.robot.reach:
            behind = bool(self._ahead(axes) @ (_core.exp_so3(q[0] * self._z1) @ self._zero_ahead) < 0)
        if self._zero_elbow is not None:
            up = bool((z2 @ np.cross(p3 - p2, _wrist(axes) - p2)) * self._zero_elbow >= 0)
        return Posture(behind, up, bool(np.sin(q[4]) < 0))

    def _up(self, axes: list[tuple[FloatArray, FloatArray]]) -> FloatArray | None:
        """Axis 1 from the base to the shoulder, against gravity where the base is at the shoulder."""
        (z1, _), (_, p2) = axes[:2]
        T_world_base = np.asarray(self.robot.core.base_and_tool(self.robot.core.nominal)[0])
        height = float((p2 - T_world_base[:3, 3]) @ z1)
        if abs(height) < MEETING * self.robot.reach:
            gravity = np.array(self.robot.spec["gravity_m_s2"], dtype=float)
            if self.robot.spec["gravity_frame"] == "base":
                gravity = T_world_base[:3, :3] @ gravity
            height = float(-gravity @ z1)
        return None if abs(height) < MEETING else np.asarray(np.sign(height) * z1)

    def _ahead(self, axes: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
        """From axis 1 to the wrist centre, square to the axis."""
        to_wrist = _wrist(axes) - self._p1
        return np.asarray(to_wrist - (to_wrist @ self._z1) * self._z1)

    def _axes(self, q: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
        """Direction and a point of each joint's axis, from what half a turn of it does to the tool.

        D = T(q + pi e_i) T(q)^-1 has R = 2 z z^T - 1, and its p = 2 (c - z z^T c) is twice the axis' point nearest the
        origin; the sign of z is that of the half turn's middle.
        """
        count = len(q)
        half, quarter = np.pi * np.eye(count), 0.5 * np.pi * np.eye(count)
        T = self.robot.forward(np.vstack([q, q + half, q + quarter]))
        inverse = np.linalg.inv(T[0])
        out = []
        for i in range(count):
            D, Q = T[1 + i] @ inverse, T[1 + count + i] @ inverse
            sine = np.array([Q[2, 1] - Q[1, 2], Q[0, 2] - Q[2, 0], Q[1, 0] - Q[0, 1]])
            out.append((sine / np.linalg.norm(sine), D[:3, 3] / 2))
        return out

    def _is_of_this_kind(self) -> bool:
        if self.robot.joint_types != ["revolute"] * 6:
            return False
        axes = self._axes(np.full(6, 0.3))
        (z2, _), (z3, _), (z4, p4), (z5, p5) = axes[1:5]
        across = np.cross(z4, z5)
        if np.linalg.norm(np.cross(z2, z3)) > PARALLEL or np.linalg.norm(across) < PARALLEL:
            return False
        apart = abs((p5 - p4) @ across) / np.linalg.norm(across)
        return bool(apart < MEETING * self.robot.reach)


def _wrist(axes: list[tuple[FloatArray, FloatArray]]) -> FloatArray:
    """The point of axis 5 nearest to axis 4."""
    (z4, p4), (z5, p5) = axes[3], axes[4]
    # p4 + s z4 - p5 - t z5 is square to both.
    c = z4 @ z5
    d = p4 - p5
    t = ((z5 @ d) - c * (z4 @ d)) / (1 - c * c)
    return np.asarray(p5 + t * z5)
