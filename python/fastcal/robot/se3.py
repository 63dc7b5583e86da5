# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rigid motions in numpy, as robot files need them: T_a_b is (4, 4) and maps p_b to p_a = T_a_b p_b."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from fastcal import _core
from fastcal.arrays import FloatArray


def skew(w: ArrayLike) -> FloatArray:
    """The matrix [w]x with [w]x p = w x p."""
    x, y, z = np.asarray(w, dtype=float)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_x(angle: float) -> FloatArray:
    """Rx(angle), rad."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def rotation_y(angle: float) -> FloatArray:
    """Ry(angle), rad."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def rotation_z(angle: float) -> FloatArray:
    """Rz(angle), rad."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def pose(rotation: ArrayLike | None = None, position: ArrayLike | None = None) -> FloatArray:
    """T = [R p; 0 1]; the identity for what is left out."""
    T = np.eye(4)
    if rotation is not None:
        T[:3, :3] = rotation
    if position is not None:
        T[:3, 3] = position
    return T


def pose_of_six(six: FloatArray) -> FloatArray:
    """T of a position and a rotation vector (6,): a turn of |r| about r."""
    return pose(_core.exp_so3(six[3:]), six[:3])


def inverse(T: FloatArray) -> FloatArray:
    """T_b_a from T_a_b."""
    R = T[:3, :3].T
    return pose(R, -R @ T[:3, 3])


def inverses(T: FloatArray) -> FloatArray:
    """`inverse` of each of (N, 4, 4)."""
    out = np.tile(np.eye(4), (len(T), 1, 1))
    out[:, :3, :3] = T[:, :3, :3].transpose(0, 2, 1)
    out[:, :3, 3] = -np.einsum("nij,nj->ni", out[:, :3, :3], T[:, :3, 3])
    return out


def rpy_to_rotation(rpy: ArrayLike) -> FloatArray:
    """R = Rz(yaw) Ry(pitch) Rx(roll) of fixed-axis XYZ angles in rad, as URDF."""
    roll, pitch, yaw = np.asarray(rpy, dtype=float)
    return rotation_z(yaw) @ rotation_y(pitch) @ rotation_x(roll)


def rotation_to_rpy(R: FloatArray) -> FloatArray:
    """Roll, pitch, yaw of R in rad; at pitch = +-90 degrees, where only roll and yaw together are defined, yaw 0."""
    return np.asarray(_core.rotation_to_rpy(R))


def screw_motion(omega: FloatArray, v: FloatArray, q: FloatArray) -> FloatArray:
    """The motions exp(S q), S = (omega, v) in space: q (N,) -> (N, 4, 4); |omega| is 1, or 0 for a slide along v.

    Rodrigues' formula: R = 1 + sin q W + (1 - cos q) W^2,  p = (q + (1 - cos q) W + (q - sin q) W^2) v,  W = [omega]x.
    """
    W = skew(omega)
    sine, cosine = np.sin(q)[:, None, None], 1.0 - np.cos(q)[:, None, None]
    angle = q[:, None, None]
    T = np.zeros((len(q), 4, 4))
    T[:, :3, :3] = np.eye(3) + sine * W + cosine * (W @ W)
    T[:, :3, 3] = (angle * np.eye(3) + cosine * W + (angle - sine) * (W @ W)) @ v
    T[:, 3, 3] = 1.0
    return T


def rotations_by(turns: FloatArray) -> FloatArray:
    """(N, 3, 3) of rotation vectors (N, 3) [rad]."""
    return np.array([_core.exp_so3(turn) for turn in np.ascontiguousarray(turns)]).reshape(-1, 3, 3)


def turns_from(R_from: FloatArray, R_to: FloatArray) -> FloatArray:
    """(N, 3) rotation vectors w [rad] with exp(w) R_from = R_to; NaN rows of either stay NaN."""
    R = R_to @ R_from.transpose(0, 2, 1)
    known = np.isfinite(R).all(axis=(1, 2))
    turns = np.full((len(R), 3), np.nan)
    turns[known] = np.array([_core.log_so3(np.ascontiguousarray(one)) for one in R[known]]).reshape(-1, 3)
    return turns


def turn_between(a: FloatArray, b: FloatArray, about: FloatArray) -> FloatArray:
    """A rotation that brings unit vector a to unit vector b: the least one up to 90 degrees.

    Beyond, where the least one is ill-defined near 180 degrees, a half turn about `about` (unit, across a) goes first.
    """
    if a @ b < 0.0:
        half_turn = 2.0 * np.outer(about, about) - np.eye(3)
        return turn_between(-a, b, about) @ half_turn
    W = skew(np.cross(a, b))
    return np.eye(3) + W + W @ W / (1.0 + a @ b)
