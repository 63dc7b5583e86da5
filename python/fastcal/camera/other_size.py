# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where no picture shows a checkerboard as its file describes it: does one show a board of another size?

Files that count inner corners instead of squares, or that are of the board beside it, are a column or a row or two off.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.camera.finding import find_board
from fastcal.camera.opencv import opencv
from fastcal.camera.thumbnails import MOST_BYTES
from fastcal.io.regular_file import read_bytes
from fastcal.said import said

_FARTHEST = 2  # columns and rows more or fewer
_PICTURES = 2  # that are looked at
_SIDE = 1280  # pixels of the larger side in which they are
_FEWEST = 4  # columns or rows of a board: with fewer, parts of others pass for it


def other_size(
    pictures: Sequence[Path], boards: Mapping[str, Mapping[str, Any]], *, larger: bool = False
) -> str:
    """What the pictures show in place of the boards, a sentence; empty where that is not found.

    Args:
        pictures: Files that can be read as pictures, in none of which a board was found.
        boards: As the cell describes them.
        larger: Boards were found, and may be a part of one with a column or row more: the detector takes any part.
    """
    cv2 = opencv()
    steps = [of for of in product(range(-_FARTHEST, _FARTHEST + 1), repeat=2) if any(of)]
    steps.sort(key=lambda of: (abs(of[0]) + abs(of[1]), of[0] != of[1], of))
    steps = [(1, 1), (1, 0), (0, 1)] if larger else steps
    for path in pictures[:: max(1, -(-len(pictures) // _PICTURES))]:
        grey = cv2.imdecode(np.frombuffer(read_bytes(path, MOST_BYTES), np.uint8), cv2.IMREAD_GRAYSCALE)
        least = min(_SIDE / max(grey.shape), 1.0)
        grey = cv2.resize(grey, None, fx=least, fy=least, interpolation=cv2.INTER_AREA)
        for name, board in boards.items():
            tried = {"checkerboard": steps, "charuco": [] if larger else [(0, 0), *steps]}.get(str(board["kind"]), [])
            for more in tried:
                columns, rows = (int(board[key]) + of for key, of in zip(("columns", "rows"), more, strict=True))
                if min(columns, rows) < _FEWEST:
                    continue
                if find_board(grey, {**board, "kind": "checkerboard", "columns": columns, "rows": rows}).count:
                    return said(
                        "{picture} shows a checkerboard of {across} x {down} inner corners: for board {name} write "
                        "kind: checkerboard, columns: {columns}, rows: {rows}, which count squares",
                        picture=path.name,
                        across=columns - 1,
                        down=rows - 1,
                        name=name,
                        columns=columns,
                        rows=rows,
                    )
    return ""
