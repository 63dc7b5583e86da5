# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""From pictures to corners: every board of a cell looked for in every picture, in processes side by side."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.calibration.processes import workers
from fastcal.camera.finding import Seen, find_board
from fastcal.camera.joining import Joined, camera_of, joined, picture_files
from fastcal.camera.opencv import opencv
from fastcal.camera.thumbnails import MOST_BYTES, small_jpeg
from fastcal.errors import FastcalError, InvalidInput
from fastcal.io.regular_file import read_bytes
from fastcal.io.table import Table
from fastcal.robot.rig import Seeing, has_rig
from fastcal.said import joined as one_text
from fastcal.said import said

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class PictureSeen:
    """One picture and what was found in it.

    Attributes:
        path: Its file.
        camera: That took it.
        row: Of the poses, from 0; None where it is of none.
        boards: What was seen of each board, by its name.
        size: Width and height [px]; (0, 0) where it cannot be read.
        why: Why nothing was looked for; empty where it was.
        thumb: A small JPEG of it.
    """

    path: Path
    camera: str
    row: int | None
    boards: Mapping[str, Seen] = field(default_factory=dict)
    size: tuple[int, int] = (0, 0)
    why: str = ""
    thumb: bytes = b""

    @property
    def count(self) -> int:
        """Corners that were found."""
        return sum(seen.count for seen in self.boards.values())

    @property
    def told(self) -> str:
        """What was found and why not, in words."""
        where = said("of no row of the poses") if self.row is None else said("row {number}", number=self.row)
        if self.why:
            return one_text(": ", [where, self.why])
        found = [
            one_text(
                "",
                [
                    said("{count} of {all} corners of {board}", count=seen.count, all=len(seen.uv), board=name),
                    seen.doubt,
                ],
            )
            for name, seen in self.boards.items()
            if seen.count
        ]
        missed = [one_text(": ", [name, seen.why]) for name, seen in self.boards.items() if not seen.count]
        return one_text(": ", [where, one_text(", ", found) if found else one_text("; ", missed)])


@dataclass(frozen=True, eq=False)
class Detection:
    """What was found in all pictures; `joins` says of each camera how its pictures were joined to rows."""

    pictures: tuple[PictureSeen, ...]
    joins: Mapping[str, str]

    @property
    def empty(self) -> list[PictureSeen]:
        """Pictures without a board."""
        return [picture for picture in self.pictures if not picture.count]

    def columns(self, folder: Path) -> dict[str, list[Any]]:
        """The table of corners: row, camera, board, corner, u_px, v_px and the picture's file as seen from `folder`."""
        out: dict[str, list[Any]] = {key: [] for key in ("row", "camera", "board", "corner", "u_px", "v_px", "picture")}
        for picture in sorted(self.pictures, key=lambda picture: -1 if picture.row is None else picture.row):
            if picture.row is None:
                continue
            file = Path(os.path.relpath(picture.path, folder)).as_posix()
            for name, seen in picture.boards.items():
                for corner in np.flatnonzero(np.isfinite(seen.uv[:, 0])).tolist():
                    u, v = (round(float(value), 4) for value in seen.uv[corner])
                    values = (picture.row, picture.camera, name, corner, u, v, file)
                    for key, value in zip(out, values, strict=True):
                        out[key].append(value)
        return out


def detect(
    cell: Seeing,
    given: Sequence[Path],
    *,
    poses: Table | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Detection:
    """Finds the boards of a cell in pictures.

    Args:
        cell: With cameras and boards: the spec of an arm that has them, or a cell of several arms.
        given: Pictures, or folders of them.
        poses: The table of poses, one row a posture; None: names and numbers of the pictures say the rows.
        jobs: Processes; no result depends on it.
        progress: Called with a sentence at each picture.

    Raises:
        InvalidInput: OpenCV is not installed, the cell has no cameras or boards, a picture is of no camera, or nothing
            says which row it belongs to.
    """
    opencv()
    if not has_rig(cell):
        raise InvalidInput(f"{cell.name}: has no cameras or no boards; expected a cell file with both")
    files = picture_files(given)
    of = {path: camera_of(path, list(cell.cameras)) for path in files}
    joins: dict[str, Joined] = {}
    rows: dict[Path, int | None] = {}
    for camera in cell.cameras:
        if own := [path for path in files if of[path] == camera]:
            joins[camera] = joined(own, poses)
            rows |= dict(zip(own, joins[camera].rows, strict=True))
    work = partial(_looked_at, dict(cell.cameras), dict(cell.boards))
    found = []
    with workers(min(jobs, len(files)), None) as side_by_side:
        for k, seen in enumerate(side_by_side.results(work, [(path, of[path], rows[path]) for path in files]), start=1):
            found.append(seen)
            if progress is not None:
                progress(f"looking for boards, picture {k} of {len(files)}")
    return Detection(tuple(found), {camera: join.how for camera, join in joins.items()})


def _looked_at(
    cameras: Mapping[str, Any], boards: Mapping[str, Any], given: tuple[Path, str, int | None]
) -> PictureSeen:
    """The boards in one picture."""
    path, camera, row = given
    cv2 = opencv()
    try:
        content = np.frombuffer(read_bytes(path, MOST_BYTES), np.uint8)
        grey = cv2.imdecode(content, cv2.IMREAD_GRAYSCALE) if len(content) else None
    except FastcalError as error:
        return PictureSeen(path, camera, row, why=str(error))
    if grey is None:
        return PictureSeen(path, camera, row, why="it cannot be read as a picture")
    size = (int(grey.shape[1]), int(grey.shape[0]))
    thumb = small_jpeg(cv2, grey)
    wanted = tuple(cameras[camera]["size_px"])
    if size != wanted:
        why = f"it is {size[0]} x {size[1]} pixels, and those of camera {camera} are {wanted[0]} x {wanted[1]}"
        return PictureSeen(path, camera, row, {}, size, why, thumb)
    return PictureSeen(path, camera, row, {name: find_board(grey, of) for name, of in boards.items()}, size, "", thumb)
