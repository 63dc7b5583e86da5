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


def to_quaternion(T: FloatArray) -> FloatArray:
    """x, y, z, qw, qx, qy, qz of T, qw at least 0."""
    from fastcal.calibration.prediction import quaternions

    return np.concatenate([T[:3, 3], quaternions(T[None, :3, :3])[0]])


def from_zyx(values: FloatArray) -> FloatArray:
    """T of x, y, z, A, B, C: R = Rz(A) Ry(B) Rx(C), as KUKA."""
    return se3.pose(se3.rpy_to_rotation(values[:2:-1]), values[:3])


def to_zyx(T: FloatArray) -> FloatArray:
    """x, y, z, A, B, C of T."""
    return np.concatenate([T[:3, 3], se3.rotation_to_rpy(T[:3, :3])[::-1]])


def from_xyz(values: FloatArray) -> FloatArray:
    """T of x, y, z, W, P, R: R = Rz(R) Ry(P) Rx(W), as FANUC."""
    return se3.pose(se3.rpy_to_rotation(values[3:]), values[:3])


def to_xyz(T: FloatArray) -> FloatArray:
    """x, y, z, W, P, R of T."""
    return np.concatenate([T[:3, 3], se3.rotation_to_rpy(T[:3, :3])])


def from_vector(values: FloatArray) -> FloatArray:
    """T of x, y, z, rx, ry, rz: a turn of |r| about r, as Universal Robots."""
    return se3.pose(_core.exp_so3(values[3:]), values[:3])


def to_vector(T: FloatArray) -> FloatArray:
    """x, y, z, rx, ry, rz of T."""
    return np.concatenate([T[:3, 3], _core.log_so3(np.ascontiguousarray(T[:3, :3]))])


def nearest_quaternion(values: FloatArray, old: FloatArray) -> FloatArray:
    """Position and quaternion with the quaternion's sign that lies nearer to the old one."""
    return np.concatenate([values[:3], np.copysign(1.0, values[3:] @ old[3:]) * values[3:]])


def nearest_euler(values: FloatArray, old: FloatArray) -> FloatArray:
    """Position and Euler angles, of (a, b, c) and (a + pi, pi - b, c + pi) those nearer to the old, from -pi to pi."""
    flipped = values[3:] * [1, -1, 1] + np.pi
    near = [old[3:] + _wrapped(way - old[3:]) for way in (values[3:], flipped)]
    angles = min(near, key=lambda way: float(np.abs(way - old[3:]).max()))
    return np.concatenate([values[:3], _wrapped(angles)])


def _wrapped(angles: FloatArray) -> FloatArray:
    """The same angles from -pi to pi; both ends stay as they are."""
    turns = np.where(np.abs(angles) > np.pi + _ROUNDING, np.round(angles / (2 * np.pi)), 0.0)
    return np.asarray(angles - 2 * np.pi * turns)


def nearest_vector(values: FloatArray, old: FloatArray) -> FloatArray:
    """x, y, z and a rotation vector, as r or r (1 - 2 pi / |r|), the same turn the other way round."""
    r, length = values[3:], float(np.linalg.norm(values[3:]))
    ways = [r] if length == 0 else [r, r * (1 - 2 * np.pi / length)]
    return np.concatenate([values[:3], min(ways, key=lambda way: float(np.linalg.norm(way - old[3:])))])
