# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where no picture shows a board as its file describes it: does one show a board of another size, or its mirror image?

Files that count inner corners instead of squares, or that are of the board beside it, are a column or a row or two off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.camera.finding import Picture, charuco_size, find_board, grid_size
from fastcal.camera.opencv import opencv
from fastcal.camera.thumbnails import MOST_BYTES
from fastcal.io.regular_file import read_bytes
from fastcal.said import said

_FARTHEST = 2  # columns and rows more or fewer
_PICTURES = 3  # that are looked at
_SIDE = 1280  # pixels of the larger side in which they are


def other_size(pictures: Sequence[Path], boards: Mapping[str, Mapping[str, Any]], *, larger: bool = False) -> str:
    """What the pictures show in place of the boards, a sentence; empty where that is not found.

    Args:
        pictures: Files that can be read as pictures, in none of which a board was found.
        boards: As the cell describes them.
        larger: Boards were found, and may be a part of one with a column or row more: the detector takes any part.
    """
    cv2 = opencv()
    for path in pictures[:: max(1, -(-len(pictures) // _PICTURES))]:
        grey = cv2.imdecode(np.frombuffer(read_bytes(path, MOST_BYTES), np.uint8), cv2.IMREAD_GRAYSCALE)
        least = min(_SIDE / max(grey.shape), 1.0)
        grey = cv2.resize(grey, None, fx=least, fy=least, interpolation=cv2.INTER_AREA)
        for name, board in {} if larger else boards.items():  # first: a part of such a board passes for a checkerboard
            if text := _with_markers(cv2, grey, path.name, name, board):
                return text
        size = grid_size(cv2, grey)
        for name, board in boards.items():
            shown = None if size is None else _shown(board, size, larger=larger)
            if shown is not None:
                return said(
                    "{picture} shows a checkerboard of {across} x {down} inner corners: for board {name} write "
                    "kind: checkerboard, columns: {columns}, rows: {rows}, which count squares",
                    picture=path.name,
                    across=shown[0],
                    down=shown[1],
                    name=name,
                    columns=shown[0] + 1,
                    rows=shown[1] + 1,
                )
    return ""


def _with_markers(cv2: Any, grey: Picture, picture: str, name: str, board: Mapping[str, Any]) -> str:
    """What a picture shows in place of a board with markers: its mirror image, or a ChArUco board of another size."""
    if str(board["kind"]) not in ("charuco", "april_grid"):
        return ""
    if find_board(np.ascontiguousarray(grey[:, ::-1]), board).count:
        return said(
            "{picture} is mirrored, left for right, as some programs show pictures: its mirror image shows board "
            "{name}",
            picture=picture,
            name=name,
        )
    size = charuco_size(cv2, grey, board) if board["kind"] == "charuco" else None
    if size is None:
        return ""
    return said(
        "{picture} shows a ChArUco board of {columns} x {rows} squares: for board {name} write columns: {columns}, "
        "rows: {rows}",
        picture=picture,
        name=name,
        columns=size[0],
        rows=size[1],
    )


def _shown(board: Mapping[str, Any], size: tuple[int, int], *, larger: bool) -> tuple[int, int] | None:
    """Corners across and down of what was found, the way round that is nearer to the board; None: it is no such one."""
    kind = str(board["kind"])
    if kind not in ("checkerboard", "charuco") or (larger and kind == "charuco"):
        return None
    own = np.array([int(board["columns"]) - 1, int(board["rows"]) - 1])
    more = min((np.array(of) - own for of in (size, size[::-1])), key=lambda of: int(np.abs(of).sum()))
    is_other = kind == "charuco" or more.any()
    if not is_other or np.abs(more).max() > _FARTHEST or (larger and more.min() < 0):
        return None
    across, down = (own + more).tolist()
    return across, down
