# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses out of the numbers of files: from a place and a quaternion, or a matrix, checked to be poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.measurements.rotations import nearest_rotation
from fastcal.robot import se3


def posed(p: FloatArray, wxyz: FloatArray, path: Path, row: int) -> FloatArray:
    """(4, 4) of a place [m] and a quaternion.

    Raises:
        ParseError: The quaternion is none.
    """
    length = float(np.linalg.norm(wxyz))
    if not abs(length - 1) < 1e-2:
        raise ParseError(f"pose {row}: expected a quaternion of length 1, got {length:.4g}", path)
    return se3.pose(_core.quaternion_to_rotation(wxyz / length), p)


def checked(T: FloatArray, path: Path, row: int) -> FloatArray:
    """The matrix, whose turn is made one but for rounding.

    Raises:
        ParseError: It is no pose.
    """
    R = T[:3, :3]
    if not (np.abs(R @ R.T - np.eye(3)).max() < 1e-3 and np.linalg.det(R) > 0 and np.allclose(T[3], (0, 0, 0, 1))):
        raise ParseError(f"pose {row}: is no pose; expected a rotation and a last row 0 0 0 1", path)
    out = T.copy()
    out[:3, :3] = nearest_rotation(R)
    return out
