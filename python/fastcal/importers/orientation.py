# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Conventions of orientation, brought to the contract's columns: rx ry rz (roll, pitch, yaw) or a quaternion.

R turns the target's axes into the measuring frame's.
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.units import to_si

# Name of a convention: what its numbers mean.
CONVENTIONS = {
    "rpy": "R = Rz(rz) Ry(ry) Rx(rx): roll, pitch, yaw about fixed axes",
    "abc": "KUKA: R = Rz(A) Ry(B) Rx(C)",
    "wpr": "FANUC: R = Rz(R) Ry(P) Rx(W)",
    "rotation_vector": "a turn by |r| about r, as Universal Robots",
    "zyz": "R = Rz(a) Ry(b) Rz(c)",
    "xyz_moving": "R = Rx(a) Ry(b) Rz(c): about moving axes",
    "matrix": "nine numbers, row by row",
    "wxyz": "a quaternion, the scalar first",
    "xyzw": "a quaternion, the scalar last",
}
_SKEW = 1e-3  # of a matrix from orthonormal: four written decimals lose 1e-4


def check_convention(name: str) -> None:
    """Refuses what is no convention known here.

    Raises:
        InvalidInput: The sentence lists those that are.
    """
    if name not in CONVENTIONS:
        raise InvalidInput(f"--orientation: expected {', '.join(CONVENTIONS)}, got '{name}'")


def converted(convention: str, values: FloatArray, unit: tuple[str, float]) -> dict[str, FloatArray]:
    """Columns of the contract of an orientation (N, 3), (N, 4) or (N, 9); rows of NaN where it was not measured.

    Raises:
        ValueError: A matrix is none of a rotation; its argument is the row.
    """
    if convention in ("rpy", "wpr", "abc"):
        order = (2, 1, 0) if convention == "abc" else (0, 1, 2)
        return {f"r{axis}_{unit[0]}": values[:, k] * unit[1] for axis, k in zip("xyz", order, strict=True)}
    if convention in ("wxyz", "xyzw"):
        order4 = (0, 1, 2, 3) if convention == "wxyz" else (3, 0, 1, 2)
        return {f"q{part}": values[:, k] for part, k in zip("wxyz", order4, strict=True)}
    from scipy.spatial.transform import Rotation  # takes long to import

    known = ~np.isnan(values).any(axis=1)
    wxyz = np.full((len(values), 4), np.nan)
    given = values[known]
    if convention == "matrix":
        R = given.reshape(-1, 3, 3)
        off = np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) > _SKEW
        off |= np.linalg.det(R) < 0
        if off.any():
            raise ValueError(int(np.flatnonzero(known)[np.argmax(off)]))
        turns = Rotation.from_matrix(R)
    else:
        turn = to_si(given * unit[1], unit[0])
        sequence = {"zyz": "ZYZ", "xyz_moving": "XYZ"}
        if convention == "rotation_vector":
            turns = Rotation.from_rotvec(turn)
        else:
            turns = Rotation.from_euler(sequence[convention], turn)
    if known.any():
        wxyz[known] = turns.as_quat()[:, [3, 0, 1, 2]]
    return {f"q{part}": wxyz[:, k] for k, part in enumerate("wxyz")}
