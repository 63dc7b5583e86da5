# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Every other way in which the columns of an orientation may have been meant, and how well orientations fit an arm.

Three angles are the turns about the axes of a sequence, or a rotation vector; a quaternion has its scalar first or
last; both may mean the inverse. R is of shape (N, 3, 3) throughout.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.measurements.joint_maps import unit_slips
from fastcal.measurements.rotations import nearest_rotation, rotations

SEQUENCES = tuple("".join(s) for s in product("XYZ", repeat=3) if s[0] != s[1] != s[2])
AS_READ = "as read"  # Rz(rz) Ry(ry) Rx(rx): turns about the fixed axes X, Y, Z
NAMES = {
    "extrinsic XYZ": AS_READ,
    "intrinsic ZYX": "KUKA's A, B, C (about Z, Y, X, each about the axes already turned)",
    "intrinsic XYZ": "intrinsic XYZ Euler angles (each about the axes already turned)",
    "intrinsic ZYZ": "ZYZ Euler angles",
    "intrinsic ZXZ": "ZXZ Euler angles",
}
_ROUNDS = 8
_SOUND = 0.7  # of the rows are taken to be no gross ones
_FAR = 5.0  # times what those leave at most: farther off, a row is gross


def quaternion_readings(quaternion: FloatArray) -> Iterator[tuple[int, str, FloatArray]]:
    """Rank, words and R of every other reading of qw, qx, qy, qz (N, 4); rank 0 is the simplest."""
    yield 0, "the orientation inverted (the quaternion conjugated)", inverse(of_quaternion(quaternion))
    # Whatever their order in the file, numbers under the names of the other order stand one place off, either way.
    for words, shift in (("qx qy qz qw under qw qx qy qz", 1), ("qw qx qy qz under qx qy qz qw", -1)):
        R = of_quaternion(np.roll(quaternion, shift, axis=1))
        yield 0, f"the quaternion as {words}", R
        yield 1, f"the quaternion as {words}, and inverted", inverse(R)


def angle_readings(angles: FloatArray) -> Iterator[tuple[int, str, FloatArray]]:
    """Rank, words and R of every other reading of rx, ry, rz (N, 3) [rad]; rank 0 is the simplest."""
    for unit, ratio in (("", 1.0), *unit_slips("angle")):
        for rank, convention, R in _conventions(angles * ratio):
            words = "the orientation" if convention == AS_READ else f"the orientation's angles as {convention}"
            words += f", in {unit}" if unit else ""
            if unit or convention != AS_READ:
                yield rank + bool(unit), words, R
            yield (0 if words == "the orientation" else 3), f"{words}, and inverted", inverse(R)


def _conventions(angles: FloatArray) -> Iterator[tuple[int, str, FloatArray]]:
    """Rank, words and R of three angles (N, 3) [rad] as they are read, and by every other convention."""
    yield 0, "a rotation vector", of_rotation_vector(angles)
    for sequence in SEQUENCES:
        for kind, R in (("in", of_angles(sequence, angles)), ("ex", of_angles(sequence[::-1], angles[:, ::-1]))):
            name = f"{kind}trinsic {sequence}"
            yield (0 if name in NAMES else 2), NAMES.get(name, f"{name} Euler angles"), R


def misfit(R: FloatArray, measured: FloatArray, base: FloatArray | None = None) -> float:
    """RMS angle [rad] between `measured` and A R B, gross rows left out, with the rotations A and B that fit best.

    Relative rotations free A of B: skew(M_i M_j') = A skew(R_i R_j') for every pair, solved by Kabsch; then B and A in
    turn, each by the nearest rotation to a sum (orthogonal Procrustes) weighted by Cauchy's weights.

    Args:
        R: (N, 3, 3) of the arm.
        measured: (N, 3, 3).
        base: A (3, 3), where it is known.
    """
    angles = _off(R, measured, *placed(R, measured, base))
    return float(np.sqrt(np.mean(angles[angles <= _FAR * np.quantile(angles, _SOUND)] ** 2)))


def placed(R: FloatArray, measured: FloatArray, base: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """The rotations A and B of `misfit`."""
    A = base
    if A is None:
        i, j = np.triu_indices(len(R), k=1)
        theirs, mine = (_skew(rotations[i] @ inverse(rotations[j])) for rotations in (measured, R))
        A = nearest_rotation(theirs.T @ mine)
    weight = np.ones(len(R))
    for _ in range(_ROUNDS):
        B = nearest_rotation(np.einsum("n,nji,njk->ik", weight, A @ R, measured))
        if base is None:
            A = nearest_rotation(np.einsum("n,nij,nkj->ik", weight, measured, R @ B))
        angles = _off(R, measured, A, B)
        weight = 1.0 / (1.0 + (angles / (2.0 * np.median(angles) + 1e-12)) ** 2)
    return A, B


def _off(R: FloatArray, measured: FloatArray, A: FloatArray, B: FloatArray) -> FloatArray:
    """(N,) angles [rad]."""
    return np.asarray(2 * np.arcsin(np.minimum(np.linalg.norm(A @ R @ B - measured, axis=(1, 2)) / np.sqrt(8.0), 1.0)))


def angle(R: FloatArray) -> float:
    """Of one rotation (3, 3) [rad]."""
    return float(2 * np.arcsin(min(np.linalg.norm(R - np.eye(3)) / np.sqrt(8.0), 1.0)))


def inverse(R: FloatArray) -> FloatArray:
    """The transposes."""
    return np.swapaxes(R, 1, 2)


def of_quaternion(quaternion: FloatArray) -> FloatArray:
    """R of quaternions w, x, y, z (N, 4) of any length."""
    return rotations(quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True))


def of_rotation_vector(vector: FloatArray) -> FloatArray:
    """R of rotation vectors (N, 3) [rad]."""
    half = np.linalg.norm(vector, axis=1, keepdims=True) / 2
    return of_quaternion(np.hstack([np.cos(half), vector * np.sinc(half / np.pi) / 2]))


def of_angles(sequence: str, angles: FloatArray) -> FloatArray:
    """R = R_s1(a1) R_s2(a2) R_s3(a3) for a sequence of axes such as ZYX and angles (N, 3) [rad]."""
    first, second, third = (
        of_rotation_vector(np.outer(angle, np.eye(3)["XYZ".index(axis)]))
        for axis, angle in zip(sequence, angles.T, strict=True)
    )
    return np.asarray(first @ second @ third)


def _skew(R: FloatArray) -> FloatArray:
    """Axis times sine of the angle (N, 3)."""
    return 0.5 * np.column_stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]])
