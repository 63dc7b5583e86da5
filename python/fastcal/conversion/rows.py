# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From screws to DH and MDH rows, exact for every arm.

Two neighbouring axes meet a row in one of two forms: by their common normal (beta = 0), or, where they are so nearly
parallel that the common normal lies far away or anywhere, by beta at d = 0 (Hayati). What no row can hold goes into the
base frame (a first axis that is not where the form wants it) and behind the last row (a flange off the last axis).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.conversion.chain import Chain
from fastcal.robot import se3

_EXACT = 1e-13  # [m] and [rad]: below this two lines meet, two directions are one
_PARALLEL = 1e-3  # sine of an angle at which a measured axis may as well be parallel
_ABEAM = 0.1  # cosine of theta at which +90 and -90 degrees are distinguished by the next axis and not by theta
_SHORT = 0.01  # a length that is not a link's but an error's, as a part of the arm
_LEVER = 10.0  # an axis tilted by 1 mrad may shift d by a hundredth of the arm, not more


@dataclass(frozen=True)
class Rows:
    """A table of rows and what it could not hold, SI.

    Attributes:
        rows: (n, 5): theta, d, a, alpha, beta, as the file formats order them.
        frames: (n, 4, 4) the frame that each row ends in, in the old base frame at q = 0.
        base: (4, 4) the new base frame in the old one.
        flange: (4, 4) the flange in the last row's frame.
    """

    rows: FloatArray
    frames: FloatArray
    base: FloatArray
    flange: FloatArray


@dataclass(frozen=True)
class _Step:
    """How to get from axis i (through o, along z) to the next axis: along z by d, along x (of beta's frame) by a."""

    d: float
    x: FloatArray
    a: float
    beta: float = 0.0


_Form = Callable[[FloatArray, FloatArray, FloatArray], _Step | None]  # of z, u and a point of the next axis seen from o


def mdh_rows(chain: Chain) -> Rows:
    """Rows of T_i = Rx(alpha) Tx(a) Rz(theta + q) Tz(d) Ry(beta)."""
    count, size = len(chain.revolute), _size(chain)
    base = _mdh_base(chain)
    x, z, o = base[:3, 0], base[:3, 2], base[:3, 3]
    a = float((_line_point(chain, 0, o) - o) @ x)
    rows, frames = np.zeros((count, 5)), np.zeros((count, 4, 4))
    for i in range(count):
        u = chain.direction(i)
        alpha = _angle(z, u, x)
        z, o = u, o + a * x
        rows[i, 2:4] = a, alpha
        step = _next_axis(chain, i, x, o, size, _hayati_mdh) if i + 1 < count else _flange_of_mdh(chain.home, z, o)
        turned = se3.rotation_y(step.beta)
        rows[i, [0, 1, 4]] = _angle(x, step.x, z), step.d, step.beta
        frames[i] = se3.pose(np.column_stack([step.x, np.cross(z, step.x), z]) @ turned, o + step.d * z)
        x, z, o, a = frames[i, :3, 0], frames[i, :3, 2], frames[i, :3, 3], step.a
    return Rows(rows, frames, base, _tidy(se3.inverse(frames[-1]) @ chain.home))


def dh_rows(chain: Chain) -> Rows:
    """Rows of T_i = Rz(theta + q) Tz(d) Tx(a) Rx(alpha) Ry(beta)."""
    count, size = len(chain.revolute), _size(chain)
    base = _on_first_axis(chain) if not _fits_dh(chain) else np.eye(4)
    T = base
    rows, frames = np.zeros((count, 5)), np.zeros((count, 4, 4))
    for i in range(count):
        x, z, o = T[:3, 0], T[:3, 2], T[:3, 3]
        if i + 1 < count:
            step, u = _next_axis(chain, i, x, o, size, _hayati_dh), chain.direction(i + 1)
            alpha = math.atan2(-u @ np.cross(z, step.x), u @ z)
            rows[i] = _angle(x, step.x, z), step.d, step.a, alpha, step.beta
        else:
            theta, alpha, beta = _zxy_angles(T[:3, :3].T @ chain.home[:3, :3])
            to_flange = se3.rotation_z(-theta) @ T[:3, :3].T @ (chain.home[:3, 3] - o)
            rows[i] = theta, to_flange[2], to_flange[0], alpha, beta
        theta, d, a, alpha, beta = rows[i]
        T = T @ se3.pose(se3.rotation_z(theta)) @ se3.pose(position=[a, 0.0, d])
        T = T @ se3.pose(se3.rotation_x(alpha) @ se3.rotation_y(beta))
        frames[i] = T
    return Rows(rows, frames, base, _tidy(se3.inverse(frames[-1]) @ chain.home))


def _next_axis(chain: Chain, i: int, x: FloatArray, o: FloatArray, size: float, hayati: _Form) -> _Step:
    """The step from axis i to axis i + 1.

    x points so that theta stays within +-90 degrees, and near these, where a small error decides, to the next axis.
    """
    z, u = chain.direction(i), chain.direction(i + 1)
    w = _line_point(chain, i + 1, o) - o
    normal = np.cross(z, u)
    sine = float(np.linalg.norm(normal))
    step: _Step | None = None
    if sine > _PARALLEL:
        normal = normal / sine
        step = _Step(float(np.cross(w, u) @ normal) / sine, normal, float(w @ normal))
    if step is None or abs(step.d) + abs(step.a) > _LEVER * size * sine:
        step = hayati(z, u, w)
    if step is None:  # the next axis passes through o: any x across both will do
        step = _Step(0.0, _unit(normal) if sine > _EXACT else _unit(x - (x @ z) * z), 0.0)
    cosine = step.x @ x
    backwards = cosine < -_ABEAM or (cosine < _ABEAM and step.a < -_SHORT * size)
    return _Step(step.d, -step.x, -step.a, -step.beta) if backwards else step


def _hayati_mdh(z: FloatArray, u: FloatArray, w: FloatArray) -> _Step | None:
    """At d = 0 the next axis is reached along x' = Ry(beta) x, which is perpendicular to it."""
    foot = w - (w @ u) * u
    a = float(np.linalg.norm(foot))
    if a < _EXACT:
        return None
    along = foot / a
    across = along - (along @ z) * z
    return _Step(0.0, _unit(across), a, math.atan2(-along @ z, float(np.linalg.norm(across))))


def _hayati_dh(z: FloatArray, u: FloatArray, w: FloatArray) -> _Step | None:
    """At d = 0 the next axis pierces the plane across z at a x; beta is what tilts it towards x."""
    pierced = w - (w @ z) / (u @ z) * u
    a = float(np.linalg.norm(pierced))
    if a < _EXACT:
        return None
    x = pierced / a
    return _Step(0.0, x, a, math.atan2(u @ x, float(np.linalg.norm(u - (u @ x) * x))))


def _flange_of_mdh(home: FloatArray, z: FloatArray, o: FloatArray) -> _Step:
    """The last row: d reaches the foot of the flange's origin on the axis, theta turns x along the flange's x."""
    x = home[:3, 0] - (home[:3, 0] @ z) * z
    if np.linalg.norm(x) < _EXACT:
        x = home[:3, 1] - (home[:3, 1] @ z) * z
    return _Step(float((home[:3, 3] - o) @ z), _unit(x), 0.0)


def _zxy_angles(R: FloatArray) -> tuple[float, float, float]:
    """Angles of R = Rz(theta) Rx(alpha) Ry(beta), |beta| <= 90 degrees; where alpha is 90, beta is 0."""
    cosine = math.hypot(R[0, 1], R[1, 1])
    theta = math.atan2(-R[0, 1], R[1, 1]) if cosine > _EXACT else math.atan2(R[1, 0], R[0, 0])
    rest = se3.rotation_z(-theta) @ R
    if rest[0, 0] < -_EXACT:  # the other pair of angles: alpha beyond 90 degrees, beta within
        theta += math.pi if theta <= 0 else -math.pi
        rest = se3.rotation_z(-theta) @ R
    beta = math.atan2(rest[0, 2], rest[0, 0]) if cosine > _EXACT else 0.0
    back = rest @ se3.rotation_y(-beta)
    return theta, math.atan2(back[2, 1], back[1, 1]), beta


def _fits_dh(chain: Chain) -> bool:
    """Whether axis 1 is the base's z axis."""
    u, point = chain.direction(0), chain.point(0)
    return bool(np.hypot(u[0], u[1]) < _EXACT and u[2] > 0 and (point is None or np.hypot(point[0], point[1]) < _EXACT))


def _mdh_base(chain: Chain) -> FloatArray:
    """The old base where alpha_0 and a_0 can reach axis 1 from it, else a frame on axis 1."""
    u, point = chain.direction(0), _line_point(chain, 0, np.zeros(3))
    off_x = np.cross([0.0, point[1], point[2]], u)
    return np.eye(4) if abs(u[0]) < _EXACT and np.linalg.norm(off_x) < _EXACT else _on_first_axis(chain)


def _on_first_axis(chain: Chain) -> FloatArray:
    """A base frame with z along axis 1, near the old one in place and in x."""
    z = chain.direction(0)
    x = np.eye(3)[0] if abs(z[0]) < 1.0 - _PARALLEL else np.eye(3)[1]
    x = _unit(x - (x @ z) * z)
    return se3.pose(np.column_stack([x, np.cross(z, x), z]), _line_point(chain, 0, np.zeros(3)))


def _line_point(chain: Chain, joint: int, o: FloatArray) -> FloatArray:
    """A point of the joint's axis; a slide's axis is put through o, where it costs no length."""
    point = chain.point(joint)
    return o if point is None else point


def _size(chain: Chain) -> float:
    """How large the arm is at q = 0 [m]."""
    points = [point for i in range(len(chain.revolute)) if (point := chain.point(i)) is not None]
    return max(1e-3, *(float(np.linalg.norm(point)) for point in (*points, chain.home[:3, 3])))


def _angle(a: FloatArray, b: FloatArray, about: FloatArray) -> float:
    """The angle from a to b about a unit vector perpendicular to both."""
    return math.atan2(np.cross(a, b) @ about, a @ b)


def _unit(vector: FloatArray) -> FloatArray:
    unit: FloatArray = vector / np.linalg.norm(vector)
    return unit


def _tidy(T: FloatArray) -> FloatArray:
    """The identity where only rounding keeps T from it."""
    return np.eye(4) if np.abs(T - np.eye(4)).max() < _EXACT else T
