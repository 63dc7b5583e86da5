# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rotations of many rows, as matrices and quaternions, and the rigid motions that fit points best."""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray

_LINE = 1e-6  # square of what is off a line by noise, over that along it


def quaternions(R: FloatArray) -> FloatArray:
    """Unit quaternions w, x, y, z (N, 4), w at least 0, of rotations (N, 3, 3).

    From the largest of the four squares 4 w^2 = 1 + trace ..., so that nothing small is divided by (S. Shepperd,
    "Quaternion from rotation matrix", 1978).
    """
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    squares = np.column_stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz])
    products = np.empty((len(R), 4, 4))  # 4 times the outer product of the quaternion with itself
    for i in range(4):
        products[:, i, i] = squares[:, i]
    for i, j, value in (
        (0, 1, R[:, 2, 1] - R[:, 1, 2]),
        (0, 2, R[:, 0, 2] - R[:, 2, 0]),
        (0, 3, R[:, 1, 0] - R[:, 0, 1]),
        (1, 2, R[:, 0, 1] + R[:, 1, 0]),
        (1, 3, R[:, 0, 2] + R[:, 2, 0]),
        (2, 3, R[:, 1, 2] + R[:, 2, 1]),
    ):
        products[:, i, j] = products[:, j, i] = value
    row = products[np.arange(len(R)), np.argmax(squares, axis=1)]
    q = row / np.linalg.norm(row, axis=1, keepdims=True)
    return np.asarray(np.where(q[:, :1] < 0, -q, q))


def rotations(wxyz: FloatArray) -> FloatArray:
    """(N, 3, 3) of unit quaternions w, x, y, z (N, 4)."""
    w, x, y, z = wxyz.T
    R = np.empty((len(wxyz), 3, 3))
    R[:, 0] = np.column_stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)])
    R[:, 1] = np.column_stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)])
    R[:, 2] = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    return R


def nearest_rotation(M: FloatArray) -> FloatArray:
    """The rotations R nearest to matrices M (..., 3, 3), of greatest trace(R' M); never a mirror."""
    u, _, vt = np.linalg.svd(M)
    u[..., -1] *= np.sign(np.linalg.det(u @ vt))[..., np.newaxis]
    return np.asarray(u @ vt)


def best_motion(p: FloatArray, x: FloatArray, near: FloatArray | None = None) -> FloatArray:
    """The rigid motion (4, 4) of points p (N, 3) that leaves the least of |M p - x|^2 (W. Kabsch 1976).

    About a line of points any turn leaves as much: it is that of the rotation `near` (3, 3).
    """
    middle_p, middle_x = p.mean(axis=0), x.mean(axis=0)
    H = (x - middle_x).T @ (p - middle_p)
    if near is not None:
        H = H + _LINE * np.linalg.norm(H) * near
    motion = np.eye(4)
    motion[:3, :3] = nearest_rotation(H)
    motion[:3, 3] = middle_x - motion[:3, :3] @ middle_p
    return motion
