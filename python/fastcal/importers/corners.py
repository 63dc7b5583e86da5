# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Corners of boards in pictures: a long table beside the poses, one line a corner."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fastcal.arrays import FloatArray, IntArray
from fastcal.calibration.moving_rig import speeds_of_times
from fastcal.calibration.pictures import SECOND
from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.cell import Cell
from fastcal.cells.readings import Readings
from fastcal.errors import FastcalError, InvalidInput, ParseError
from fastcal.importers.loading import load_measurements, load_or_open
from fastcal.io.table import Table
from fastcal.io.tables import read_table
from fastcal.io.tree_readings import load_readings
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.long_dataset import LongDataset
from fastcal.robot.rig import SQUARES, Seeing, corner_counts, has_rig, pictures
from fastcal.robot.robot import Robot

COLUMNS = ("row", "camera", "board", "corner", "u_px", "v_px")
# What other programs call them, where no column has our own name; a camera or board that is the only one needs none.
_ALSO = {
    "row": ("image", "frame", "picture", "pose", "view", "image_id", "frame_id", "pose_id", "img"),
    "camera": ("cam", "camera_id", "cam_id"),
    "board": ("target",),
    "corner": ("corner_id", "id", "charuco_id", "point", "point_id", "index"),
    "u_px": ("u", "x_px", "x", "px", "u_pixel"),
    "v_px": ("v", "y_px", "y", "py", "v_pixel"),
}
_MOST = 2**31  # more counts nothing
_BEYOND = 0.5  # of the picture's size: a corner that far out is none of this picture


def load_seen(files: Sequence[str | os.PathLike[str]], robot: Robot, corners: str | os.PathLike[str] | None) -> Dataset:
    """`load_measurements`, with the corners that cameras saw in these poses where they are given."""
    try:
        if corners is None:
            return load_measurements(files, robot)
        measured = load_measurements(files, robot, require_measured=False)
    except ParseError as error:
        raise _better(error, files, robot, corners) from None
    return with_corners(measured, corners, robot)


def _better(
    error: ParseError,
    files: Sequence[str | os.PathLike[str]],
    robot: Robot | None,
    corners: str | os.PathLike[str] | None,
) -> FastcalError:
    """The error, or what was probably meant: files that are exchanged, a table of corners that was left out."""
    for file in files:
        if _holds_corners(file):
            return InvalidInput(
                f"{file}: holds corners, which --corners takes; expected the postures of these pictures"
            )
    if corners is None and robot is not None and has_rig(robot.description) and _is_readable(files, robot):
        return InvalidInput(
            f"{files[0]}: holds nothing measured, and what the cameras saw is not given; expected --corners FILE, "
            "which fastcal detect makes of pictures"
        )
    return error


def _holds_corners(path: str | os.PathLike[str]) -> bool:
    try:
        return {"u_px", "v_px"} <= set(read_table(path).names)
    except FastcalError:
        return False


def _is_readable(files: Sequence[str | os.PathLike[str]], robot: Robot) -> bool:
    """Are they tables of postures, whatever was measured?"""
    try:
        load_measurements(files, robot, require_measured=False)
    except FastcalError:
        return False
    return True


def load_seen_readings(
    path: str | os.PathLike[str], cell: Cell, corners: str | os.PathLike[str] | None = None
) -> Readings:
    """`load_readings` of a cell, with the corners that its cameras saw in these postures where they are given."""
    try:
        readings = load_readings(path, cell, require_measured=corners is None)
    except ParseError as error:
        raise _better(error, [path], None, corners) from None
    if corners is None:
        return readings
    seen = load_corners(corners, cell, len(readings))
    return replace(readings, tables={**readings.tables, **seen.tables}, notes=(*readings.notes, *seen.notes))


def load_seen_or_open(
    files: Sequence[str | os.PathLike[str]],
    robot: Robot,
    corners: str | os.PathLike[str] | None,
    seen: Callable[[Dataset], Dataset],
) -> Dataset | LongDataset:
    """`load_seen`, or `load_or_open` where no camera saw anything."""
    if corners is not None:
        return seen(load_seen(files, robot, corners))
    try:
        return load_or_open(files, robot, seen)
    except ParseError as error:
        raise _better(error, files, robot, corners) from None


def with_corners(data: Dataset, path: str | os.PathLike[str], robot: Robot) -> Dataset:
    """The poses with what cameras saw in them.

    Args:
        data: The poses, one row a posture.
        path: A table with the columns row, camera, board, corner, u_px, v_px and, where known, sigma_px; `row` counts
            the data rows of the poses from 0. A cell's only camera or board needs no column.
        robot: The arm with its cameras and boards.

    Raises:
        ParseError: A row beyond the poses, an unknown camera or board, a corner that the board does not have or that
            lies outside the picture; the sentence names the line.
    """
    seen = load_corners(path, robot.description, len(data))
    return replace(
        data, observed={**data.observed, **seen.tables}, notes=(*data.notes, *seen.notes), speed=_speeds(data)
    )


@dataclass(frozen=True, eq=False)
class Corners:
    """What cameras saw in N postures.

    Attributes:
        tables: `corner` (N, 2 K), u and v of each corner of each picture [px], NaN where not seen; SECOND, likewise,
            where a row has two pictures of one board; `sigma_corner` (N, K) where given.
        notes: What a reader should know, a sentence each.
    """

    tables: dict[str, FloatArray]
    notes: tuple[str, ...] = ()


def load_corners(path: str | os.PathLike[str], rig: Seeing, count: int) -> Corners:
    """The corners of a table; see `with_corners`.

    Args:
        path: The table.
        rig: The robot's spec or the cell that has the cameras and boards.
        count: Postures.
    """
    if not has_rig(rig):
        raise ParseError(
            "holds corners, and the file has no cameras or no boards to see them; give a cell file that has both", path
        )
    table = read_table(path)
    try:
        return _corners(table, rig, count)
    except ParseError:
        if table.exact is None:
            raise
    return _corners(table.exact(), rig, count)


def picture_files(path: str | os.PathLike[str] | None) -> dict[tuple[int, str], Path]:
    """The files of the pictures by row and camera, where a table of corners names them; none where it does not."""
    if path is None:
        return {}
    table = read_table(path)
    place = {name: k for k, name in enumerate(table.names)}
    if not {"row", "camera", "picture"} <= place.keys() or isinstance(table.columns[place["picture"]], np.ndarray):
        return {}
    rows, cameras, names = _whole(table, place["row"]), table.labels(place["camera"]), table.labels(place["picture"])
    return {
        (int(row), camera): Path(path).parent / name
        for row, camera, name in zip(rows, cameras, names, strict=True)
        if name
    }


def _corners(table: Table, rig: Seeing, rows: int) -> Corners:
    place, notes = _places(table, rig)
    row, corner = (_whole(table, place[name]) for name in ("row", "corner"))
    if table.names[place["row"]] != "row" and len(row) and row.min() == 1 and row.max() == rows:
        row -= 1
        notes = (*notes, f"its {table.names[place['row']]} counts from 1: 1 is the first row of the poses")
    if (bad := np.flatnonzero((row < 0) | (row >= rows))).size:
        raise table.error(f"row must be 0 to {rows - 1}, as the poses have {rows} rows, got {row[bad[0]]}", int(bad[0]))
    camera = _named(table, place.get("camera"), list(rig.cameras), "camera")
    board = _named(table, place.get("board"), list(rig.boards), "board")
    counts = np.array(corner_counts(rig))[board]
    if (bad := np.flatnonzero((corner < 0) | (corner >= counts))).size:
        k = bad[0]
        name = list(rig.boards)[board[k]]
        count = "; columns and rows count squares" if rig.boards[name]["kind"] in SQUARES else ""
        raise table.error(f"corner must be 0 to {counts[k] - 1} on board {name}, got {corner[k]}{count}", int(k))
    uv = np.column_stack([_numbers(table, place[name]) for name in ("u_px", "v_px")])
    sizes = np.array([entry["size_px"] for entry in rig.cameras.values()], dtype=np.float64)[camera]
    beyond = (uv < -_BEYOND * sizes) | (uv > (1 + _BEYOND) * sizes)
    if (bad := np.flatnonzero(beyond.any(axis=1))).size:
        k = bad[0]
        name = list(rig.cameras)[camera[k]]
        size = f"{sizes[k, 0]:.0f} x {sizes[k, 1]:.0f}"
        raise table.error(
            f"({uv[k, 0]:g}, {uv[k, 1]:g}) px lies outside the pictures of camera {name} ({size}); is size_px right?",
            int(k),
        )
    where = list(pictures(rig).values())
    first = np.array([part.start for part in where]).reshape(len(rig.cameras), -1)
    at = first[camera, board] + corner
    width = where[-1].stop
    # A row may hold two pictures of a board: one of them belongs to another row, and the arm will say which.
    which = row * width + first[camera, board]
    rest = _second_pictures(which, at)
    seen = np.full((2, rows, width, 2), np.nan)
    for those, own in zip(seen, (np.setdiff1d(np.arange(len(row)), rest), rest), strict=True):
        _, once = np.unique((row * width + at)[own], return_index=True)
        if len(once) < len(own):
            k = int(np.delete(own, once)[0])
            raise table.error(f"row {row[k]}, corner {corner[k]} of this camera and board is given three times", k)
        those[row[own], at[own]] = uv[own]
    tables = {CORNERS: seen[0].reshape(rows, -1)}
    if len(rest):
        tables[SECOND] = seen[1].reshape(rows, -1)
        twice = ", ".join(map(str, np.unique(row[rest]).tolist()))
        notes = (*notes, f"two pictures of a board by the same camera are in row {twice}: the one that fits is used")
    if "sigma_px" in place:
        sigma = _numbers(table, place["sigma_px"])
        if (bad := np.flatnonzero(~(sigma > 0))).size:
            raise table.error(f"sigma_px must be above 0, got {sigma[bad[0]]:g}", int(bad[0]))
        given = np.full((rows, width), np.nan)
        given[row, at] = sigma
        tables["sigma_corner"] = given
    return Corners(tables, notes)


def _places(table: Table, rig: Seeing) -> tuple[dict[str, int], tuple[str, ...]]:
    """Where each of COLUMNS stands, by our own name or by one of _ALSO, and a sentence where it is one of these."""
    place = {name: k for k, name in enumerate(table.names)}
    lower = {name.strip().lower(): k for name, k in place.items()}
    read_as = []
    for name, others in _ALSO.items():
        other = next((of for of in others if of in lower), None)
        if name not in place and other is not None:
            place[name] = lower[other]
            read_as.append(f"{table.names[lower[other]]} as {name}")
    needed = [name for name in COLUMNS if not (name in ("camera", "board") and len(getattr(rig, f"{name}s")) == 1)]
    missing = [name for name in needed if name not in place]
    if missing:
        raise table.error(
            f"column '{missing[0]}' is missing; expected {', '.join(COLUMNS)}, got {', '.join(table.names)}"
        )
    return place, ((f"its columns are read as ours: {', '.join(read_as)}",) if read_as else ())


def _speeds(data: Dataset) -> FloatArray | None:
    if data.speed is not None or data.time is None:
        return data.speed
    return speeds_of_times(data.q, data.time)


def _second_pictures(which: IntArray, at: IntArray) -> IntArray:
    """Lines of second pictures: of each picture `which`, from the line on that gives a corner `at` again."""
    _, first = np.unique(np.column_stack([which, at]), axis=0, return_index=True)
    again = np.setdiff1d(np.arange(len(at)), first)
    begins = {int(picture): int(again[which[again] == picture][0]) for picture in np.unique(which[again])}
    of = [k for picture, begin in begins.items() for k in np.flatnonzero(which == picture) if k >= begin]
    return np.array(sorted(of), dtype=np.int64)


def _numbers(table: Table, place: int) -> FloatArray:
    values = table.numbers(place)
    if (bad := np.flatnonzero(np.isnan(values))).size:
        raise table.wrong_cell(place, int(bad[0]), "a number")
    return values


def _whole(table: Table, place: int) -> IntArray:
    values = _numbers(table, place)
    if (bad := np.flatnonzero((values != np.round(values)) | (np.abs(values) > _MOST))).size:
        raise table.wrong_cell(place, int(bad[0]), "a whole number")
    return values.astype(np.int64)


def _named(table: Table, place: int | None, names: list[str], what: str) -> IntArray:
    """Which of the names each line has; without a column the only one."""
    if place is None:
        return np.zeros(len(table.columns[0]), dtype=np.int64)
    given = table.labels(place)
    for k, value in enumerate(given):
        if value not in names:
            raise table.error(f"there is no {what} '{value:.60}'; expected {', '.join(names)}", int(k))
    index = {name: k for k, name in enumerate(names)}
    return np.array([index[value] for value in given], dtype=np.int64)
