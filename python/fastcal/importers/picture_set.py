# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sets of pictures and poses of other programs as files of fastcal: a table of postures, and the cell beside it.

`detect` then finds the boards of the cell in the pictures that the table names.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers.pose_pairs_out import joint_columns, named_beside, pose_columns
from fastcal.io.atomic import atomic_paths
from fastcal.io.tables import check_csv_name, csv_text
from fastcal.io.yaml_text import yaml_text
from fastcal.robot.robot import Robot

Spec = dict[str, Any]

_JPEG_SIZES = frozenset({*range(0xC0, 0xC4), *range(0xC5, 0xC8), *range(0xC9, 0xCC), *range(0xCD, 0xD0)})


@dataclass(frozen=True, eq=False)
class PictureSet:
    """Pictures, and where the arm was in each.

    Attributes:
        flange: (N, 4, 4) T_base_flange [m].
        pictures: (N,) the files.
        cell: Of an arm of poses, the camera and the board.
        read_as: What wrote it.
        joints: (N, n) as the controller counts them [rad], where they are known.
        notes: What a reader should know, a sentence each.
    """

    flange: FloatArray
    pictures: tuple[Path, ...]
    cell: Spec
    read_as: str
    joints: FloatArray | None = None
    notes: tuple[str, ...] = ()


def write_picture_set(path: Path, found: PictureSet, robot: Robot | None = None, name: str = "") -> Path:
    """Writes the table, and beside it the cell; returns the cell's path.

    Args:
        path: The table's.
        found: What was read.
        robot: The arm, where its joints shall be used and not its poses.
        name: By which the cell names it.

    Raises:
        InvalidInput: A file cannot be written, or is no CSV by its name, or there are no joints of that arm.
    """
    check_csv_name(path)
    cell = path.with_name(f"{path.stem}_cell.yaml")
    content, columns = found.cell, _posture_columns(found, robot)
    if robot is not None:
        content = {**content, "arms": {"arm": {"robot": named_beside(name, path)}}}
    columns["picture"] = [file.name for file in found.pictures]
    with atomic_paths([path, cell]) as (table, beside):
        table.write_text(csv_text(columns), encoding="utf-8", newline="\n")
        beside.write_text(yaml_text(content), encoding="utf-8", newline="\n")
    return cell


def _posture_columns(found: PictureSet, robot: Robot | None) -> dict[str, list[float] | list[str]]:
    if robot is None:
        return {**pose_columns(found.flange, "arm.{}")}
    if found.joints is None:
        raise InvalidInput(f"{found.read_as}: holds poses of the flange and no joints; leave out --robot")
    if found.joints.shape[1] != robot.joint_count:
        count = found.joints.shape[1]
        raise InvalidInput(f"{found.read_as}: holds {count} joints, and {robot.name} has {robot.joint_count}")
    return {**joint_columns(found.joints, robot)}


def picture_size(path: Path) -> tuple[int, int]:
    """Width and height of a PNG, BMP or JPEG file, by its first bytes.

    Raises:
        ParseError: It is not there, or none of these.
    """
    try:
        with path.open("rb") as file:
            head = file.read(1 << 16)
    except OSError:
        raise ParseError("there is no such picture", path) from None
    try:
        if head.startswith(b"\x89PNG\r\n\x1a\n"):
            width, height = struct.unpack(">II", head[16:24])
        elif head.startswith(b"BM"):
            width, height = struct.unpack("<ii", head[18:26])
        elif head.startswith(b"\xff\xd8"):
            width, height = _jpeg_size(head)
        else:
            raise ParseError("expected a PNG, BMP or JPEG file", path)
    except (struct.error, IndexError):
        raise ParseError("is a picture that is cut short", path) from None
    return int(width), abs(int(height))


def _jpeg_size(head: bytes) -> tuple[int, int]:
    """By the segment that begins the frame."""
    at = 2
    while head[at + 1] not in _JPEG_SIZES:
        at += 2 + int(struct.unpack(">H", head[at + 2 : at + 4])[0])
    height, width = struct.unpack(">HH", head[at + 5 : at + 9])
    return int(width), int(height)
