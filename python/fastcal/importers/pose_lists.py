# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lists of poses as programs write them: TUM lines, 4 x 4 and 3 x 4 matrices, tvec and rvec columns; numpy's .npy."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import ParseError
from fastcal.io.poses import checked, posed
from fastcal.io.regular_file import is_file, read_bytes
from fastcal.io.tables import read_table
from fastcal.io.yaml_file import read_text, read_yaml
from fastcal.robot.se3 import pose, pose_of_six
from fastcal.units import UNITS, parse_name, to_si

_MOST_BYTES = 64_000_000
_LENGTHS = {8: "TUM lines (time x y z qx qy qz qw)", 7: "x y z qx qy qz qw", 16: "4 x 4 matrices", 12: "3 x 4 matrices"}
_SIX = {"rpy": "xyz", "wpr": "xyz", "abc": "ZYX", "zyz": "ZYZ", "xyz_moving": "XYZ", "rotation_vector": ""}
_LABELS = ({"hand", "robot", "arm", "flange", "gripper", "tool"}, {"eye", "camera", "board", "target", "marker", "tag"})
_VECTORS = [f"{of}_{axis}" for of in ("tvec", "rvec") for axis in "xyz"]


@dataclass(frozen=True, eq=False)
class PoseList:
    """Poses (N, 4, 4) [m], and their times (N,) [s] where the lines have them."""

    T: FloatArray
    times: FloatArray | None = None


def read_pose_list(path: Path, orientation: str | None = None) -> PoseList:
    """The poses of a file, in metres unless a header says otherwise.

    Args:
        path: The file.
        orientation: What the angles of six numbers a pose are; they are degrees where one is larger than a turn in rad.

    Raises:
        ParseError: It holds none; the sentence says what is read.
    """
    if path.suffix.lower() == ".npy":
        try:
            values = np.load(io.BytesIO(read_bytes(path, _MOST_BYTES)), allow_pickle=False)
        except ValueError as error:
            raise ParseError(f"is no array of numpy: {error}", path) from None
        return _of_rows(np.asarray(values, dtype=np.float64), path, orientation)
    if path.suffix.lower() in (".json", ".yaml", ".yml"):
        try:
            return _of_rows(np.asarray(read_yaml(path), dtype=np.float64), path, orientation)
        except (TypeError, ValueError) as error:
            if isinstance(error, ParseError):
                raise
            raise ParseError("expected a list of 4 x 4 matrices", path) from None
    text = read_text(path)
    if "rvec" in text[:2000].lower():
        return _of_vectors(path)
    lines = [line for line in re.split(r"[\r\n]+", text) if line.strip() and not line.lstrip().startswith("#")]
    try:
        rows = [[float(cell) for cell in re.split(r"[\s,;\[\]]+", line) if cell] for line in lines]
        values = np.array([row for row in rows if row], dtype=np.float64)
    except ValueError:
        raise ParseError(f"expected lines of numbers: {', '.join(_LENGTHS.values())}", path) from None
    if values.ndim == 2 and values.shape[1] == 4 and len(values) % 4 == 0:
        values = values.reshape(-1, 16)  # four lines a matrix
    return _of_rows(values, path, orientation)


def read_labelled_poses(path: Path, orientation: str | None = None) -> tuple[PoseList, PoseList] | None:
    """Poses of the flange and of the board of a file whose lines begin with hand or eye, or such; None: no such file.

    Raises:
        ParseError: Lines that are no poses, or not as many of each.
    """
    if path.suffix.lower() not in (".csv", ".txt") or not is_file(path) or path.stat().st_size > _MOST_BYTES:
        return None
    first_word = re.match(rb"\W*([A-Za-z]+)", read_bytes(path, _MOST_BYTES)[:100])
    if first_word is None or first_word[1].decode().lower() not in _LABELS[0] | _LABELS[1]:
        return None
    parts: tuple[list[list[str]], list[list[str]]] = ([], [])
    stray: tuple[int, str] | None = None
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        first, *cells = [cell for cell in re.split(r"[\s,;]+", line) if cell] or [""]
        own = [part for part, labels in zip(parts, _LABELS, strict=True) if first.lower() in labels]
        stray = stray or ((number, first) if line.strip() and not own else None)
        for part in own:
            part.append(cells)
    if not all(parts):
        return None
    if stray is not None:
        raise ParseError(f"line {stray[0]} begins with '{stray[1]:.40}', and those before with hand or eye", path)
    if len(parts[0]) != len(parts[1]):
        raise ParseError(f"holds {len(parts[0])} poses of the arm and {len(parts[1])} of the board", path)
    try:
        hand, board = (np.array(part, dtype=np.float64) for part in parts)
    except ValueError:
        raise ParseError("expected as many numbers in each line", path) from None
    return _of_rows(hand, path, orientation), _of_rows(board, path, orientation)


def _of_six(rows: FloatArray, path: Path, orientation: str | None) -> PoseList:
    """Of a place and three angles."""
    from scipy.spatial.transform import Rotation  # takes long to import

    if orientation not in _SIX:
        got = "nothing says" if orientation is None else f"{orientation} does not say"
        raise ParseError(
            f"holds six numbers a pose, and {got} what its angles are: give --orientation {', '.join(_SIX)}", path
        )
    angles = rows[:, 3:]
    turns = to_si(angles, "deg") if np.abs(angles).max(initial=0.0) > 2 * np.pi else angles
    sequence = _SIX[orientation]
    R = (Rotation.from_euler(sequence, turns) if sequence else Rotation.from_rotvec(turns)).as_matrix()
    return PoseList(np.array([pose(each, place) for each, place in zip(R, rows[:, :3], strict=True)]))


def _of_rows(values: FloatArray, path: Path, orientation: str | None) -> PoseList:
    rows = values.reshape(len(values), -1) if values.ndim >= 2 else values.reshape(0, 0)
    width = rows.shape[1]
    if width == 6 and np.isfinite(rows).all():
        return _of_six(rows, path, orientation)
    if width not in _LENGTHS or not np.isfinite(rows).all():
        raise ParseError(f"expected {', '.join(_LENGTHS.values())}; got {width} numbers a pose", path)
    if width in (7, 8):
        at = rows[:, -7:]
        T = [posed(row[:3], row[[6, 3, 4, 5]], path, k) for k, row in enumerate(at)]
        return PoseList(np.array(T), rows[:, 0] if width == 8 else None)
    last = np.tile((0.0, 0.0, 0.0, 1.0), (len(rows), 1))
    whole = rows if width == 16 else np.column_stack([rows, last])
    return PoseList(np.array([checked(row.reshape(4, 4), path, k) for k, row in enumerate(whole)]))


def _of_vectors(path: Path) -> PoseList:
    """tvec_x, tvec_y, tvec_z, rvec_x ..., as OpenCV's solvePnP gives them, with or without a unit at the end."""
    table = read_table(path)
    named = {parse_name(title)[0].lower(): place for place, title in enumerate(table.names)}
    bare = {title.lower(): place for place, title in enumerate(table.names)}
    columns = []
    for name in _VECTORS:
        place = bare.get(name, named.get(name))
        if place is None:
            raise table.error(f"there is no column {name}; expected {', '.join(_VECTORS)}")
        unit = parse_name(table.names[place])[1] if place != bare.get(name) else None
        values = table.numbers(place)
        if np.isnan(values).any():
            raise table.wrong_cell(place, int(np.argmax(np.isnan(values))), "a number")
        columns.append(values if unit is None or unit not in UNITS else to_si(values, unit))
    return PoseList(np.array([pose_of_six(six) for six in np.column_stack(columns)]))
