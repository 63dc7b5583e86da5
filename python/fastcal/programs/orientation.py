# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The ways in which languages write a pose: position, then quaternion, Euler angles or rotation vector, all SI."""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.robot import se3

_ROUNDING = 1e-9  # rad


def from_quaternion(values: FloatArray) -> FloatArray:
    """T of x, y, z, qw, qx, qy, qz; the quaternion is brought to length 1."""
    return se3.pose(_core.quaternion_to_rotation(values[3:] / np.linalg.norm(values[3:])), values[:3])


def to_quaternion(T: FloatArray, old: FloatArray) -> FloatArray:
    """x, y, z, qw, qx, qy, qz of T, with the sign of the quaternion that lies nearer to the old one."""
    from fastcal.measurements.rotations import quaternions

    wxyz = quaternions(T[None, :3, :3])[0]
    return np.concatenate([T[:3, 3], np.copysign(1.0, wxyz @ old[3:]) * wxyz])


def from_zyx(values: FloatArray) -> FloatArray:
    """T of x, y, z, A, B, C: R = Rz(A) Ry(B) Rx(C), as KUKA."""
    return se3.pose(se3.rpy_to_rotation(values[:2:-1]), values[:3])


def to_zyx(T: FloatArray, old: FloatArray) -> FloatArray:
    """x, y, z, A, B, C of T, nearest to the old."""
    return np.concatenate([T[:3, 3], _nearest(se3.rotation_to_rpy(T[:3, :3])[::-1], old[3:])])


def from_xyz(values: FloatArray) -> FloatArray:
    """T of x, y, z, W, P, R: R = Rz(R) Ry(P) Rx(W), as FANUC."""
    return se3.pose(se3.rpy_to_rotation(values[3:]), values[:3])


def to_xyz(T: FloatArray, old: FloatArray) -> FloatArray:
    """x, y, z, W, P, R of T, nearest to the old."""
    return np.concatenate([T[:3, 3], _nearest(se3.rotation_to_rpy(T[:3, :3]), old[3:])])


def to_vector(T: FloatArray, old: FloatArray) -> FloatArray:
    """x, y, z and a rotation vector of T, r or r (1 - 2 pi / |r|), the same turn the other way round, near the old."""
    r = np.asarray(_core.log_so3(np.ascontiguousarray(T[:3, :3])))
    length = float(np.linalg.norm(r))
    ways = [r] if length == 0 else [r, r * (1 - 2 * np.pi / length)]
    return np.concatenate([T[:3, 3], min(ways, key=lambda way: float(np.linalg.norm(way - old[3:])))])


def _nearest(angles: FloatArray, old: FloatArray) -> FloatArray:
    """Euler angles, of (a, b, c) and (a + pi, pi - b, c + pi) those nearer to the old, from -pi to pi."""
    near = [old + _wrapped(way - old) for way in (angles, angles * [1, -1, 1] + np.pi)]
    return _wrapped(min(near, key=lambda way: float(np.abs(way - old).max())))


def _wrapped(angles: FloatArray) -> FloatArray:
    """The same angles from -pi to pi; both ends stay as they are."""
    turns = np.where(np.abs(angles) > np.pi + _ROUNDING, np.round(angles / (2 * np.pi)), 0.0)
    return np.asarray(angles - 2 * np.pi * turns)
