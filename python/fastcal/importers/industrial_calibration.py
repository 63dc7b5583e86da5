# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Data folders of ROS-Industrial's industrial_calibration: cal_data.yaml, pictures, and a pose of the flange for each.

What they hold becomes a table of poses with the pictures' names, and the cell of camera and board: `detect` goes on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers.picture_set import PictureSet, picture_size
from fastcal.io.poses import posed
from fastcal.io.yaml_file import read_yaml
from fastcal.units import from_si

Spec = dict[str, Any]

DATA = "cal_data.yaml"
_BESIDE = {"target_finder": "target_finder.yaml", "intrinsics": "camera_intr.yaml"}
_PARTS = ("x", "y", "z", "qw", "qx", "qy", "qz")
_CHARUCO, _CIRCLES = "CharucoGridTargetFinder", ("ModifiedCircleGridTargetFinder", "CircleGridTargetFinder")
_LENS = ("fx", "fy", "cx", "cy")
# OpenCV's predefined dictionaries, by their number.
_DICTIONARIES = [f"{bits}X{bits}_{count}" for bits in (4, 5, 6, 7) for count in (50, 100, 250, 1000)]


def read_industrial_set(files: Sequence[Path]) -> PictureSet | None:
    """The set in a folder that has cal_data.yaml, or in such a file; None: it is none.

    Raises:
        ParseError: Something in it is missing, or a board is of a kind that is not known here.
    """
    if len(files) != 1:
        return None
    path = files[0] / DATA if files[0].is_dir() else files[0]
    if path.suffix.lower() not in (".yaml", ".yml") or not path.is_file():
        return None
    content = read_yaml(path)
    rows = content.get("data") if isinstance(content, Mapping) else None
    if not isinstance(rows, list) or not rows or not all(isinstance(row, Mapping) and "image" in row for row in rows):
        return None
    flange, pictures = [], []
    for k, row in enumerate(rows):
        if "pose" not in row:
            raise ParseError(f"data[{k}]: has a picture and no pose of the flange", path)
        flange.append(_pose(path.parent / str(row["pose"]), k))
        pictures.append(path.parent / str(row["image"]))
    finder, lens = (_block(content, key, path) for key in _BESIDE)
    size = picture_size(pictures[0])
    try:
        fx, fy, cx, cy = (float(lens[key]) for key in _LENS)
    except (KeyError, TypeError, ValueError):
        raise ParseError(f"intrinsics: expected numbers {', '.join(_LENS)}", path) from None
    camera, board = ("world", "arm") if content.get("static_camera") else ("arm", "world")
    cell: Spec = {
        "arms": {"arm": {"robot": "pose"}},
        "cameras": {"camera": {"on": camera, "size_px": list(size), "focal_px": [fx, fy], "centre_px": [cx, cy]}},
        "boards": {"board": {"on": board, **_board(finder, path)}},
    }
    return PictureSet(np.array(flange), tuple(pictures), cell, f"a data folder of industrial_calibration: {files[0]}")


def _pose(path: Path, row: int) -> FloatArray:
    """(4, 4) of x y z [m] and qx qy qz qw."""
    content = read_yaml(path)
    try:
        values = np.array([float(content[key]) for key in _PARTS])
    except (KeyError, TypeError, ValueError):
        raise ParseError(f"expected numbers {', '.join(_PARTS)}", path) from None
    return posed(values[:3], values[3:], path, row)


def _block(content: Mapping[str, Any], key: str, path: Path) -> Mapping[str, Any]:
    """A block of the file, or of the file beside it that holds it."""
    value = content.get(key)
    beside = path.with_name(_BESIDE[key])
    if value is None and beside.is_file():
        value = read_yaml(beside)
        value = value.get(key, value) if isinstance(value, Mapping) else value
    if not isinstance(value, Mapping):
        raise ParseError(f"has no {key}; expected it there or in {_BESIDE[key]} beside it", path)
    return value


def _board(finder: Mapping[str, Any], path: Path) -> Spec:
    kind = str(finder.get("type", "")).rpartition("::")[2].removesuffix("Plugin")
    if kind not in (_CHARUCO, *_CIRCLES):
        known = f"{_CHARUCO} and {_CIRCLES[0]}"
        raise InvalidInput(f"{path}: target_finder: '{kind:.60}' finds no board that is known here; known are {known}")
    mm = float(from_si(1.0, "mm"))
    try:
        size = {"columns": int(finder["cols"]), "rows": int(finder["rows"])}
        if kind == _CHARUCO:
            square, marker = mm * float(finder["chessboard_dim"]), mm * float(finder["aruco_marker_dim"])
            name = _dictionary(finder["dictionary"])
            return {"kind": "charuco", **size, "square_mm": square, "marker_mm": marker, "dictionary": name}
        return {"kind": "circles", **size, "square_mm": mm * float(finder["spacing"])}
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ParseError(f"target_finder: {kind}: the key {error} is missing or no number", path) from None


def _dictionary(value: Any) -> str:
    """The name that a board's key `dictionary` takes, of OpenCV's number or name."""
    return value.removeprefix("DICT_") if isinstance(value, str) else _DICTIONARIES[int(value)]
