# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""numpy's .npz with the poses of a flange and of a board by their names, as scripts about calibrateHandEye keep them.

Of matrices, `T_base_ee` is the effector in the base; of `R_gripper2base` and `t_gripper2base` too. The other way round
they are inverse.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.poses import checked
from fastcal.io.regular_file import read_bytes
from fastcal.robot.se3 import inverse, pose_of_six

_MOST_BYTES = 64_000_000
_HANDS = frozenset({"gripper", "flange", "effector", "endeffector", "ee", "eef", "hand", "tcp", "tool", "end"})
_BASES = frozenset({"base", "world", "robot", "arm"})
_BOARDS = frozenset(
    {"target", "board", "object", "obj", "marker", "tag", "pattern", "chessboard", "checkerboard", "charuco", "aruco"}
)
_CAMERAS = frozenset({"cam", "camera", "eye", "sensor"})


def read_pose_arrays(path: Path) -> tuple[FloatArray, FloatArray] | None:
    """T_base_flange and T_camera_board (N, 4, 4) [m] of a .npz; None where it names no such arrays.

    Raises:
        ParseError: It does, and they are no poses, or not as many.
    """
    if path.suffix.lower() != ".npz":
        return None
    try:
        with np.load(io.BytesIO(read_bytes(path, _MOST_BYTES)), allow_pickle=False) as content:
            arrays = {name: np.asarray(content[name]) for name in content.files}
    except (ValueError, BadZipFile) as error:
        raise ParseError(f"is no file of numpy's arrays: {error}", path) from None
    found: dict[str, FloatArray] = {}
    for name, values in _poses(arrays, path).items():
        whose, is_inverse = _meaning(name)
        if whose and whose not in found:
            found[whose] = np.array([inverse(T) for T in values]) if is_inverse else values
    if found.keys() != {"hand", "board"}:
        return None
    if len(found["hand"]) != len(found["board"]):
        raise ParseError(f"holds {len(found['hand'])} poses of the arm and {len(found['board'])} of the board", path)
    return found["hand"], found["board"]


def _poses(arrays: Mapping[str, np.ndarray], path: Path) -> dict[str, FloatArray]:
    """(N, 4, 4) by the names of matrices, and by those of turns and places without their first letter."""
    out: dict[str, FloatArray] = {}
    for name, values in arrays.items():
        if values.ndim != 3 or values.dtype.kind not in "fiu":
            continue
        if values.shape[1:] in ((4, 4), (3, 4)):
            out[name] = _whole(values[:, :3, :3], values[:, :3, 3], path)
    for name, values in arrays.items():
        if not name.lower().startswith("r") or values.dtype.kind not in "fiu":
            continue
        place = next((arrays[of] for of in (f"t{name[1:]}", f"T{name[1:]}") if of in arrays), None)
        if place is None or place.dtype.kind not in "fiu" or place.size != 3 * len(values):
            continue
        if values.shape[1:] == (3, 3):
            turns = values
        elif values.size == 3 * len(values):
            turns = np.array([pose_of_six(np.append(np.zeros(3), v))[:3, :3] for v in values.reshape(-1, 3)])
        else:
            continue
        out[name[1:]] = _whole(turns, place.reshape(-1, 3), path)
    return out


def _whole(turns: np.ndarray, places: np.ndarray, path: Path) -> FloatArray:
    T = np.tile(np.eye(4), (len(turns), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = turns, places
    return np.array([checked(each, path, k) for k, each in enumerate(T)]).reshape(-1, 4, 4)


def _meaning(name: str) -> tuple[str, bool]:
    """Whose poses an array holds, hand or board or "", and whether they are inverse."""
    words = re.findall(r"[a-z]+|2", re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower())
    words = ["2" if word in ("to", "in") else word for word in words if word not in ("t", "r", "pose", "poses")]
    known = [word for word in words if word in _HANDS | _BASES | _BOARDS | _CAMERAS]
    groups = {"hand": _HANDS, "base": _BASES, "board": _BOARDS, "camera": _CAMERAS}
    kinds = {of for of, group in groups.items() if group & set(known)}
    if kinds in ({"hand", "base"}, {"board", "camera"}):
        whose, reference = ("hand", _BASES) if "hand" in kinds else ("board", _CAMERAS)
        return whose, (known[0] in reference) is ("2" in words)
    alone = {"hand": "hand", "base": "hand", "board": "board"}  # "robot" alone is its flange
    return (alone.get(kinds.pop(), ""), False) if len(kinds) == 1 else ("", False)
