# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which of its solutions an arm stands in: wrist before or behind axis 1, and on which side of the lower arm.

An arm with a shoulder (axis 2), a parallel elbow (axis 3) and a wrist centre (axes 4 and 5 meet) reaches a pose in up
to eight ways, two at each of three singularities: the wrist centre on axis 1, in the plane of axes 2 and 3, q5 = 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fastcal.robot import Robot

FloatArray = NDArray[np.float64]

PARALLEL = 0.02  # rad: axes 2 and 3 of an arm of this kind, nominally parallel
MEETING = 0.005  # of the reach: how far axes 4 and 5 may pass by one another


class Arm:
    """Nominal kinematics that answers on which side of its singularities a posture is.

    Args:
        nominal: Without effects, as the robot's controller has it.
    """

    def __init__(self, nominal: Robot) -> None:
        self.robot = Robot(nominal.spec | {"effects": []})
        self.has_configurations = self._is_of_this_kind()

    def behind(self, q: FloatArray) -> bool | None:
        """Is the wrist centre behind axis 1, seen from where it is at q = 0? None where that is on the axis."""
        ahead, now = self._ahead(np.zeros_like(q)), self._ahead(q)
        turned = q.copy()
        turned[1:] = 0
        direction = self._ahead(turned)
        if np.linalg.norm(ahead) < MEETING * self.robot.reach:
            return None
        return bool(now @ direction < 0)

    def elbow(self, q: FloatArray) -> float:
        """z2 . ((p3 - p2) x (wrist - p2)) [m2]: its sign says on which side of the lower arm the wrist centre is."""
        axes = self._axes(q)
        (z2, p2), (_, p3) = axes[1], axes[2]
        return float(z2 @ np.cross(p3 - p2, _wrist(axes) - p2))

    def same_elbow(self, q: FloatArray, reference: FloatArray) -> bool | None:
        """Is the wrist centre on the side where it is at the reference? None where that is in line with the arm."""
        there = self.elbow(reference)
        return None if abs(there) < MEETING * self.robot.reach**2 else bool(self.elbow(q) * there >= 0)

    def _ahead(self, q: FloatArray) -> FloatArray:
        """From axis 1 to the wrist centre, square to the axis."""
        axes = self._axes(q)
        z1, p1 = axes[0]
        to_wrist = _wrist(axes) - p1
        return np.asarray(to_wrist - (to_wrist @ z1) * z1)

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
