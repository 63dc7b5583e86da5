# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How well poses of an arm explain measured points and orientations, whatever its base and tool: bounds and fits.

A point is p = A (t + R x) + b, with the pose (R, t) of the last frame, a base (A, b) and a tool x. With any matrix G in
place of the rotation A' it is linear, t + R x = G p - c, and what least squares leave of many readings at once bounds
what a rotation can leave. The fit itself is robust (Cauchy's weights, scale by the median), and may move zeros of
joints. Orientations obey M = A R B, so that the mean of the Kronecker products M (x) R has a singular value of 1.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.measurements.rotations import nearest_rotation

Poses = Callable[[FloatArray], FloatArray]

_SCALE = 2.0  # medians of the distances at which a row counts half
_SOUND = 0.7  # of the rows are taken to be no gross ones
_FAR = 5.0  # times what those leave at most: farther off, a row is gross
_ROUNDS = 20
_CONVERGED = 1e-5  # of the last step [m, rad]
_LINEAR_ROUNDS = 8
_STEP = 1e-6  # [rad] of a zero in a difference
_LARGEST_TURN = 0.5  # [rad] that a step may turn a joint by
_RIDGE = 1e-8  # of the squared lengths of columns: above what differences leave where columns depend on one another
_TINY = float(np.finfo(np.float64).tiny)


def point_bounds(T: FloatArray, position: FloatArray) -> FloatArray:
    """(S,) bounds that the misfits of S readings are not below, as shares of the spread of the arm's points.

    Args:
        T: (S, N, 4, 4) poses by each reading.
        position: (N, 3) points, in any unit and any frame, left-handed too; or (S, N, 3), where the readings are of
            these.
    """
    S, N = T.shape[:2]
    size = np.broadcast_to(np.ptp(position, axis=(-2, -1))[..., np.newaxis, np.newaxis], (*position.shape[:-1], 1))
    columns = np.concatenate([position - position.mean(axis=-2, keepdims=True), size], axis=-1)
    U, s, _ = np.linalg.svd(columns)
    rank = np.count_nonzero(s > 1e-9 * s[..., :1], axis=-1)
    beyond = U * (np.arange(N) >= rank[..., np.newaxis])[..., np.newaxis, :]  # what no G and no c explain
    left = (T[:, :, :3, :].reshape(S, N, 12).swapaxes(1, 2) @ beyond).reshape(S, 3, 4, -1)
    t, X = left[:, :, 3], left[:, :, :3]
    A = np.einsum("saim,sajm->sij", X, X, optimize=True)
    b = np.einsum("saim,sam->si", X, t, optimize=True)
    A[:, range(3), range(3)] += 1e-12 * np.trace(A, axis1=1, axis2=2)[:, np.newaxis] + _TINY
    x = np.linalg.solve(A, b[..., np.newaxis])[..., 0]
    squares = np.einsum("sam,sam->s", t, t) - np.einsum("si,si->s", b, x)
    spread = np.sum((T[:, :, :3, 3] - T[:, :, :3, 3].mean(axis=1, keepdims=True)) ** 2, axis=(1, 2))
    return np.asarray(np.sqrt(np.maximum(squares, 0.0) / np.maximum(spread, _TINY)))


def turn_bounds(R: FloatArray, measured: FloatArray) -> FloatArray:
    """(S,) bounds [rad] that the RMS angles between A R B and `measured` are not below, of any rotations A and B.

    A and B are constant where M (x) R maps one vector of nine numbers onto another in every row. For vectors b of
    length 1 the mean square of what is left is 1 - |mean(M (x) R) b|^2 at least.

    Args:
        R: (S, N, 3, 3) by each reading.
        measured: (N, 3, 3), or (S, N, 3, 3) where the readings are of these.
    """
    mean = _mean_kronecker(R, measured)
    square = np.linalg.eigvalsh(mean.swapaxes(1, 2) @ mean)[:, -1]
    return np.asarray(np.sqrt(1.5 * np.maximum(1.0 - square, 0.0)))


def _mean_kronecker(R: FloatArray, measured: FloatArray) -> FloatArray:
    S, N = R.shape[:2]
    theirs = np.broadcast_to(measured, R.shape).reshape(S, N, 9)
    products = theirs.swapaxes(1, 2) @ R.reshape(S, N, 9) / N
    return np.asarray(products.reshape(S, 3, 3, 3, 3).transpose(0, 1, 3, 2, 4).reshape(S, 9, 9))


@dataclass(frozen=True)
class Frames:
    """Base and tool of a reading, and what they leave.

    Attributes:
        A, b: Rotation (3, 3) and place (3,) of the base [m].
        tool: (3,) the point in the last frame [m].
        zero: (n,) that joints were moved by [rad or m].
        distances: (N,) from the points [m].
        zero_std: (n,) standard deviations of the zeros that were free, else 0 [rad or m].
    """

    A: FloatArray
    b: FloatArray
    tool: FloatArray
    zero: FloatArray
    distances: FloatArray
    zero_std: FloatArray

    @property
    def rms(self) -> float:
        """Root mean square of the distances of rows that are not far off [m]."""
        near = self.distances[self.agree]
        return float(np.sqrt(np.mean(near**2)))

    @property
    def agree(self) -> NDArray[np.bool_]:
        """(N,) rows that are not far off beside those that fit best."""
        return np.asarray(self.distances <= _FAR * np.quantile(self.distances, _SOUND) + _TINY)

    def at(self, T: FloatArray) -> FloatArray:
        """(N, 3) points of poses (N, 4, 4) of the arm."""
        return np.asarray((T[:, :3, 3] + T[:, :3, :3] @ self.tool) @ self.A.T + self.b)


def base_matrix(T: FloatArray, position: FloatArray) -> FloatArray:
    """The matrix G (3, 3) for the base: where a reading is right a rotation, in another unit or mirrored."""
    return _robust_linear(T, position)[0]


def fitted(poses: Poses, q: FloatArray, position: FloatArray, free: Sequence[int] = ()) -> Frames:
    """The base and the tool that fit best, robustly, from no initial guess, and zeros of the joints `free`."""
    T = poses(q)
    G, _, tool = _robust_linear(T, position)
    A = nearest_rotation(G.T)
    h = T[:, :3, 3] + T[:, :3, :3] @ tool
    b = np.median(position - h @ A.T, axis=0)
    zero = np.zeros(q.shape[1])
    for _ in range(_ROUNDS):
        h = T[:, :3, 3] + T[:, :3, :3] @ tool
        at = h @ A.T
        r = at + b - position
        distances = np.linalg.norm(r, axis=1)
        scale = _SCALE * _middle(distances) + _TINY
        J = np.zeros((len(q), 3, 9 + len(free)))
        J[:, :, :3] = -_cross(at)
        J[:, :, 3:6] = np.eye(3)
        J[:, :, 6:9] = A @ T[:, :3, :3]
        if len(free):
            there = poses((q + zero + _STEP * np.eye(q.shape[1])[list(free), np.newaxis]).reshape(-1, q.shape[1]))
            moved = (there[:, :3, 3] + there[:, :3, :3] @ tool).reshape(len(free), *h.shape) - h
            J[:, :, 9:] = (moved @ A.T / _STEP).transpose(1, 2, 0)
        root = 1.0 / np.sqrt(1.0 + (distances / scale) ** 2)
        step = _least_squares((J * root[:, None, None]).reshape(-1, J.shape[2]), -(r * root[:, None]).ravel())
        turned = max(float(np.linalg.norm(step[:3])), float(np.abs(step[9:]).max(initial=0.0)))
        step *= min(1.0, _LARGEST_TURN / max(turned, _TINY))
        A, b, tool = _rotation(step[:3]) @ A, b + step[3:6], tool + step[6:9]
        zero[list(free)] += step[9:]
        if len(free):
            T = poses(q + zero)
        if np.linalg.norm(step) < _CONVERGED or not np.isfinite(step).all():
            break
    std = np.zeros(len(zero))
    if len(free):
        weighted = (J * root[:, None, None]).reshape(-1, J.shape[2])
        size = np.linalg.norm(weighted, axis=0)
        alike = weighted / (size + _TINY)
        deviation = np.sqrt(np.diag(np.linalg.inv(alike.T @ alike + _RIDGE * np.eye(len(size)))))
        unseen = np.full(len(size), np.inf)  # a joint that moves nothing, as of another arm
        std[list(free)] = scale / _SCALE * np.divide(deviation, size, out=unseen, where=size > 0)[9:]
    left = (T[:, :3, 3] + T[:, :3, :3] @ tool) @ A.T + b - position
    return Frames(A, b, tool, zero, np.linalg.norm(left, axis=1), std)


def _robust_linear(T: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """G, c and x of t + R x = G p - c, by least squares with Cauchy's weights."""
    N = len(T)
    middle = np.median(position, axis=0)
    system = np.zeros((N, 3, 15))
    for axis in range(3):
        system[:, axis, 3 * axis : 3 * axis + 3] = position - middle
        system[:, axis, 9 + axis] = 1.0
    system[..., 12:] = -T[:, :3, :3]
    root = np.ones((N, 1, 1))
    t = T[:, :3, 3, np.newaxis]
    for _ in range(_LINEAR_ROUNDS):
        x = _least_squares((system * root).reshape(-1, 15), (t * root).ravel())
        distances = np.linalg.norm(system @ x - t[..., 0], axis=1)
        root = 1.0 / np.sqrt(1.0 + (distances / (_SCALE * _middle(distances) + _TINY)) ** 2)[:, None, None]
    return x[:9].reshape(3, 3), x[9:12] - x[:9].reshape(3, 3) @ middle, x[12:]


def _middle(values: FloatArray) -> float:
    """The upper median of (N,): quick."""
    return float(np.partition(values, len(values) // 2)[len(values) // 2])


def _least_squares(A: FloatArray, b: FloatArray) -> FloatArray:
    """By normal equations with columns brought to length 1; what A does not show stays near 0."""
    size = np.linalg.norm(A, axis=0) + _TINY
    scaled = A / size
    return np.asarray(np.linalg.solve(scaled.T @ scaled + _RIDGE * np.eye(A.shape[1]), scaled.T @ b) / size)


def _cross(v: FloatArray) -> FloatArray:
    """(N, 3, 3) matrices of the cross products with v (N, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return out - out.transpose(0, 2, 1)


def _rotation(turn: FloatArray) -> FloatArray:
    """The rotation of a rotation vector (3,)."""
    angle = float(np.linalg.norm(turn))
    K = _cross(turn[np.newaxis])[0]
    half = np.sinc(angle / (2 * np.pi))
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * K + 0.5 * half**2 * K @ K)
