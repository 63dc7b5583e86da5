# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arms of the simulated year, in numpy from the textbook alone: no code of fastcal in it.

T = B prod_i Rz(theta_i + q_i + c_i tau_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i) t, tau_i the moment about joint i's
axis of all weights beyond it, links' and payload's, where the arm stands once it has yielded.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GRAVITY = np.array([0.0, 0.0, -9.80665])
_SETTLED = 8  # rounds: a deflection changes its own load by a thousandth


def turn(axis: int, angle: FloatArray | float) -> FloatArray:
    """(N, 4, 4) rotations by angle (N,) about an own axis."""
    angle = np.atleast_1d(np.asarray(angle, dtype=float))
    T = np.tile(np.eye(4), (len(angle), 1, 1))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    T[:, i, i] = T[:, j, j] = np.cos(angle)
    T[:, j, i], T[:, i, j] = np.sin(angle), -np.sin(angle)
    return T


def shift(x: float, y: float, z: float) -> FloatArray:
    """(4, 4)."""
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


@dataclass(frozen=True, eq=False)
class Arm:
    """A DH arm that yields under its loads, SI.

    Attributes:
        rows: (n, 5) theta d a alpha beta.
        masses, centres: (n,) and (n, 3) of the links, in the frame in which the row ends.
        compliance: (n,) [rad/Nm].
        payload_centre, tool: (3,) in the last frame.
        base: (4, 4) in the measuring frame.
    """

    rows: FloatArray
    masses: FloatArray
    centres: FloatArray
    compliance: FloatArray
    payload_centre: FloatArray
    tool: FloatArray
    base: FloatArray

    def points(self, q: FloatArray, payload: FloatArray) -> FloatArray:
        """(N, 3) of the tool in the measuring frame; weights pull along the base's own -z."""
        sag = np.zeros_like(q)
        for _ in range(_SETTLED):
            joints, ends = self._frames(q + sag)
            sag = self.compliance * self._moments(joints, ends, payload)
        _, ends = self._frames(q + sag)
        p = ends[-1] @ np.append(self.tool, 1.0)
        return np.asarray((p @ self.base.T)[:, :3])

    def _frames(self, q: FloatArray) -> tuple[list[FloatArray], list[FloatArray]]:
        """Before and after each row, in the base."""
        T = np.tile(np.eye(4), (len(q), 1, 1))
        joints, ends = [], []
        for i, (theta, d, a, alpha, beta) in enumerate(self.rows):
            joints.append(T)
            T = T @ turn(2, theta + q[:, i]) @ shift(a, 0, d) @ turn(0, alpha) @ turn(1, beta)
            ends.append(T)
        return joints, ends

    def _moments(self, joints: list[FloatArray], ends: list[FloatArray], payload: FloatArray) -> FloatArray:
        """(N, n) about each joint's axis."""
        pulls = [
            (np.broadcast_to(m, len(payload)), (T @ np.append(c, 1.0))[:, :3])
            for m, c, T in zip(self.masses, self.centres, ends, strict=True)
        ]
        load = (payload, (ends[-1] @ np.append(self.payload_centre, 1.0))[:, :3])
        out = np.zeros((len(payload), len(joints)))
        for i, T in enumerate(joints):
            for mass, place in [*pulls[i:], load]:
                moment = np.cross(place - T[:, :3, 3], mass[:, None] * GRAVITY)
                out[:, i] += np.sum(moment * T[:, :3, 2], axis=1)
        return out

    def with_(self, **changes: FloatArray) -> Arm:
        """The arm after something happened to it."""
        return replace(self, **changes)
