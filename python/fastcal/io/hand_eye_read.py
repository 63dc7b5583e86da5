# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a camera is, out of the results of other programs: `place: FILE` of a camera in a cell file.

| file | written by |
|---|---|
| parameters, transform | easy_handeye2 (.calib) |
| parameters, transformation | easy_handeye (NAME_eye_on_hand.yaml) |
| FloatMatrix, PoseState | Zivid (mm) |
| rows, cols, data of six numbers | ViSP (eMc.yaml) |
| T_gripper_camera, T_base_camera | OpenCV's FileStorage, as fastcal writes it (m) |
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.lens_file import storage
from fastcal.io.poses import checked, posed
from fastcal.robot.se3 import pose_of_six
from fastcal.units import to_si

_OURS = ("T_gripper_camera", "T_base_camera")
_ZIVID = ("FloatMatrix", "PoseState", "PoseState0")


def read_hand_eye(path: Path) -> FloatArray:
    """(4, 4) of the camera in its parent's frame [m].

    Raises:
        ParseError: It is none of these.
    """
    content = storage(path)
    if isinstance(content.get("transform"), Mapping):
        at = content["transform"]
        return _of_ros(at.get("translation"), at.get("rotation"), "", path)
    if isinstance(content.get("transformation"), Mapping):
        return _of_ros(content["transformation"], content["transformation"], "q", path)
    if any(name in content for name in _ZIVID):
        return checked(matrix_mm(path), path, 0)
    for name in _OURS:
        if name in content:
            return checked(_numbers(content[name], 16, path).reshape(4, 4), path, 0)
    if "data" in content:
        return pose_of_six(_numbers(content, 6, path))
    raise ParseError(
        "holds no place of a camera; expected the result of easy_handeye, easy_handeye2, Zivid, ViSP or fastcal", path
    )


def matrix_mm(path: Path) -> FloatArray:
    """(4, 4) [m] of Zivid's matrix in mm: FloatMatrix of its library, or PoseState of its older samples.

    Raises:
        ParseError: It holds none.
    """
    content = storage(path)
    value = next((content[name] for name in _ZIVID if name in content), None)
    if isinstance(value, Mapping) and "Data" in value:
        value = value["Data"]
    if value is None:
        raise ParseError(f"holds no matrix of 4 x 4; expected {' or '.join(_ZIVID[:2])}, as Zivid writes it", path)
    T = _numbers(value, 16, path).reshape(4, 4)
    T[:3, 3] = to_si(T[:3, 3], "mm")
    return T


def _of_ros(p: Any, q: Any, prefix: str, path: Path) -> FloatArray:
    try:
        at = np.array([float(p[axis]) for axis in "xyz"])
        turn = np.array([float(q[prefix + axis]) for axis in "wxyz"])
    except (TypeError, KeyError, ValueError):
        raise ParseError("expected numbers x y z [m] and a quaternion of the camera's place", path) from None
    return posed(at, turn, path, 0)


def _numbers(value: Any, count: int, path: Path) -> FloatArray:
    try:
        return np.array(value["data"] if isinstance(value, Mapping) else value, dtype=np.float64).reshape(count)
    except (TypeError, KeyError, ValueError):
        raise ParseError(f"expected {count} numbers of the camera's place", path) from None
