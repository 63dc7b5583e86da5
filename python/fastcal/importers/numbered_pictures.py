# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Folders with a picture and a pose of the flange to each number: RoboDK's Hand-Eye-Data, Zivid's hand-eye datasets.

RoboDK's example CameraHandEyeRecord.py writes N.png and N.json: joints [deg], and pose_flange x y z [mm] a b c [rad]
with R = Rx(a) Ry(b) Rz(c) (robodk.robomath.TxyzRxyz_2_Pose). Zivid's samples write imgNN and posNN.yaml, a 4 x 4 matrix
[mm], as OpenCV's PoseState or as their own FloatMatrix. Neither holds the lens, which the pictures show, nor the board.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers.picture_set import PictureSet, picture_size
from fastcal.io.hand_eye_read import matrix_mm
from fastcal.io.poses import checked
from fastcal.io.yaml_file import read_yaml
from fastcal.robot import se3
from fastcal.units import from_si, to_si

Spec = dict[str, Any]

_PICTURES = (".png", ".bmp", ".jpg", ".jpeg")
_OTHERS = (".zdf", ".tif", ".tiff")
_LEAST = 0.01  # [m] an arm reaches: less is metres taken for millimetres
_ROBODK_BOARD: Spec = {
    "kind": "charuco",
    "columns": 5,
    "rows": 7,
    "square_mm": 35,
    "marker_mm": 21,
    "dictionary": "6X6_100",
}
_ZIVID_BOARD: Spec = {"kind": "checkerboard", "columns": 8, "rows": 7, "square_mm": 30}


def read_numbered_pictures(files: Sequence[Path]) -> PictureSet | None:
    """The set in a folder; None: it is none of these.

    Raises:
        ParseError: A pose cannot be read, or has no picture that can be.
        InvalidInput: Its poses are not in millimetres.
    """
    if len(files) != 1 or not files[0].is_dir():
        return None
    folder = files[0]
    inside = sorted(folder.iterdir())
    taken = {int(file.stem): file for file in inside if file.suffix == ".json" and file.stem.isdigit()}
    if taken and all("pose_flange" in _mapping(file) for file in taken.values()):
        return _robodk(folder, taken, inside)
    taken = {int(m[1]): file for file in inside if (m := re.fullmatch(r"pos_?(\d+)\.ya?ml", file.name, re.I))}
    return _zivid(folder, taken, inside) if taken else None


def _mapping(path: Path) -> Mapping[str, Any]:
    content = read_yaml(path)
    return content if isinstance(content, Mapping) else {}


def _robodk(folder: Path, taken: Mapping[int, Path], inside: Sequence[Path]) -> PictureSet:
    flange, joints = [], []
    for file in (taken[number] for number in sorted(taken)):
        content = _mapping(file)
        try:
            x = np.asarray(content["pose_flange"], dtype=np.float64).reshape(6)
            q = np.asarray(content.get("joints", []), dtype=np.float64).ravel()
        except (TypeError, ValueError):
            raise ParseError("expected pose_flange of six numbers [mm, rad] and a list of joints", file) from None
        turns = [_core.exp_so3(a * e) for a, e in zip(x[3:], np.eye(3), strict=True)]
        flange.append(se3.pose(np.linalg.multi_dot(turns), to_si(x[:3], "mm")))
        joints.append(to_si(q, "deg"))
    same = len({len(q) for q in joints}) == 1 and len(joints[0]) > 0
    return _set(
        folder,
        (np.array(flange), np.array(joints) if same else None),
        _pictures(folder, taken, inside, r"0*(\d+)"),
        _ROBODK_BOARD,
        ("RoboDK's hand-eye data", "RoboDK's example"),
    )


def _zivid(folder: Path, taken: Mapping[int, Path], inside: Sequence[Path]) -> PictureSet:
    flange = [checked(matrix_mm(taken[number]), taken[number], number) for number in sorted(taken)]
    return _set(
        folder,
        (np.array(flange), None),
        _pictures(folder, taken, inside, r"(?:img|image|pic)?_?0*(\d+)"),
        _ZIVID_BOARD,
        ("Zivid's hand-eye dataset", "Zivid"),
    )


def _pictures(folder: Path, taken: Mapping[int, Path], inside: Sequence[Path], pattern: str) -> list[Path]:
    """The picture of each pose, by its number."""
    found: dict[int, Path] = {}
    for file in inside:
        if file.suffix.lower() in (*_PICTURES, *_OTHERS) and (match := re.fullmatch(pattern, file.stem, re.I)):
            is_read = file.suffix.lower() in _PICTURES
            if is_read or int(match[1]) not in found:
                found[int(match[1])] = file
    out = []
    for number in sorted(taken):
        if number not in found:
            raise ParseError(f"there is no picture {number} beside this pose in {folder}", taken[number])
        picture = found[number]
        if picture.suffix.lower() in _OTHERS:
            name = picture.with_suffix(".png").name
            raise ParseError(f"is no picture that is read here; save its 2D image beside it as {name}", picture)
        out.append(picture)
    return out


def _set(
    folder: Path,
    known: tuple[FloatArray, FloatArray | None],
    pictures: Sequence[Path],
    board: Spec,
    made_by: tuple[str, str],
) -> PictureSet:
    flange, joints = known
    far = float(np.median(np.linalg.norm(flange[:, :3, 3], axis=1)))
    if far < _LEAST:
        raise InvalidInput(
            f"{folder}: the arm reaches {from_si(far, 'mm'):.3g} mm; are its poses in m? {made_by[1]} has mm"
        )
    size = list(picture_size(pictures[0]))
    cell: Spec = {
        "arms": {"arm": {"robot": "pose"}},
        "cameras": {"camera": {"on": "arm", "size_px": size}},
        "boards": {"board": {"on": "world", **board}},
    }
    notes = (
        f"the board is taken for that of {made_by[1]}, {board['columns']} x {board['rows']} squares of "
        f"{board['square_mm']} mm: write yours into the cell",
        "the camera is taken to be on the arm: with the board there, write camera on: world, board on: arm",
        "the lens is found from the pictures; where you have it, name its file in the cell (lens)",
    )
    return PictureSet(flange, tuple(pictures), cell, f"{made_by[0]}: {folder}", joints, notes)
