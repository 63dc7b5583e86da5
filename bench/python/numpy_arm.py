# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The peers' arm: forward kinematics of a DH arm with joint gains and its Jacobian, vectorized in numpy.

What a good engineer writes in an afternoon: all rows at once, every derivative analytic, no loop over rows.
T = Tbase(x, y, z, R0 Rx Ry Rz) prod Rz(theta + (1 + k) q) Tz(d) Tx(a) Rx(alpha) Ry(beta) p_tool.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def _rotate(T: FloatArray, axis: int, angle: FloatArray | float) -> None:
    """T (N, 3, 4) := T * rotation about an own axis."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    c, s = np.cos(angle), np.sin(angle)
    c, s = (c[:, None], s[:, None]) if np.ndim(c) else (c, s)
    x, y = T[:, :, i].copy(), T[:, :, j].copy()
    T[:, :, i] = c * x + s * y
    T[:, :, j] = c * y - s * x


def _shift(T: FloatArray, axis: int, length: float) -> None:
    T[:, :, 3] += length * T[:, :, axis]


def position_and_jacobian(
    q: FloatArray, base: FloatArray, rows: FloatArray, tool: FloatArray, gain: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points (N, 3) and derivatives (N, 3, 6 + 5 n + 3 + n): base, rows theta d a alpha beta, tool, gains.

    q (N, n) [rad]; base (6,); rows (n, 5); tool (3,); gain (n,).
    """
    count, n = q.shape
    T = np.zeros((count, 3, 4))
    T[:, range(3), range(3)] = 1.0
    axes: list[tuple[bool, FloatArray, FloatArray]] = []  # (turns, direction, point), one a parameter

    def note(turns: bool, axis: int) -> None:
        axes.append((turns, T[:, :, axis].copy(), T[:, :, 3].copy()))

    for axis in range(3):
        note(False, axis)
        _shift(T, axis, base[axis])
    for axis in range(3):
        note(True, axis)
        _rotate(T, axis, base[3 + axis])
    for i in range(n):
        theta, d, a, alpha, beta = rows[i]
        note(True, 2)
        _rotate(T, 2, theta + (1 + gain[i]) * q[:, i])
        note(False, 2)
        _shift(T, 2, d)
        note(False, 0)
        _shift(T, 0, a)
        note(True, 0)
        _rotate(T, 0, alpha)
        note(True, 1)
        _rotate(T, 1, beta)
    for axis in range(3):
        note(False, axis)
        _shift(T, axis, tool[axis])
    p = T[:, :, 3]
    J = np.empty((count, 3, len(axes) + n))
    for k, (turns, direction, point) in enumerate(axes):
        J[:, :, k] = np.cross(direction, p - point) if turns else direction
    for i in range(n):
        J[:, :, len(axes) + i] = J[:, :, 6 + 5 * i] * q[:, i, None]
    return p, J
