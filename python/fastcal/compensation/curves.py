# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses on the curves that controllers drive: straight lines and arcs, turning evenly by the least turn."""

from __future__ import annotations

import math

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput

_COLLINEAR = 1e-6  # sine of the angle at the middle point below which three points give no circle


def between(T_from: FloatArray, T_to: FloatArray, count: int) -> FloatArray:
    """(count, 4, 4) poses on the straight line with the least turn; the last is T_to."""
    turn = np.asarray(_core.log_so3(np.ascontiguousarray(T_from[:3, :3].T @ T_to[:3, :3])))
    out = np.tile(np.eye(4), (count, 1, 1))
    for k, share in enumerate(np.linspace(0, 1, count + 1)[1:]):
        out[k, :3, :3] = T_from[:3, :3] @ _core.exp_so3(share * turn)
        out[k, :3, 3] = (1 - share) * T_from[:3, 3] + share * T_to[:3, 3]
    out[-1] = T_to
    return out


def arc(T_from: FloatArray, T_via: FloatArray, T_to: FloatArray, counts: tuple[int, int]) -> FloatArray:
    """Poses on the circle through three points: counts[0] up to T_via, counts[1] more up to T_to.

    With u = via - from, v = to - from and n = u x v, the centre is from + (|u|^2 v x n + |v|^2 n x u) / (2 |n|^2). The
    turn is even on each of the two parts.

    Raises:
        InvalidInput: The three points lie on a line.
    """
    start, u, v = T_from[:3, 3], T_via[:3, 3] - T_from[:3, 3], T_to[:3, 3] - T_from[:3, 3]
    n = np.cross(u, v)
    size = float(np.linalg.norm(n))
    if size <= _COLLINEAR * float(np.linalg.norm(u) * np.linalg.norm(v)):
        raise InvalidInput("the three points of an arc lie on a line; expected points of a circle")
    centre = start + (u @ u * np.cross(v, n) + v @ v * np.cross(n, u)) / (2 * size**2)
    radius, across = start - centre, np.cross(n / size, start - centre)
    out = np.concatenate([between(T_from, T_via, counts[0]), between(T_via, T_to, counts[1])])
    # About n the arc goes from the first point over the second to the third.
    middle, end = (math.atan2(r @ across, r @ radius) % (2 * math.pi) for r in (start + u - centre, start + v - centre))
    first, second = (np.linspace(0, 1, count + 1)[1:] for count in counts)
    angle = np.concatenate([first * middle, middle + second * (end - middle)])
    out[:, :3, 3] = centre + np.outer(np.cos(angle), radius) + np.outer(np.sin(angle), across)
    out[counts[0] - 1], out[-1] = T_via, T_to
    return out
