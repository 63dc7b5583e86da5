# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is printed on a board: the brightness, 0 black to 1 white, of a place in the plane of its corners."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.camera.opencv import charuco, dictionary, opencv
from fastcal.errors import InvalidInput
from fastcal.robot.rig import SQUARES, board_corners
from fastcal.units import from_si

Pattern = Callable[[FloatArray, FloatArray], FloatArray]

_DOT = 0.25  # radius of a circle, of the distance between two


def pattern(board: Mapping[str, Any]) -> tuple[Pattern, tuple[float, ...]]:
    """The print of a board, and the paper that it is on: x from, y from, x to, y to [mm].

    Args:
        board: An entry of `boards`; of `points` one whose points have z = 0.

    Raises:
        InvalidInput: Its points do not lie in the plane, or OpenCV does not know its markers.
    """
    if board["kind"] in SQUARES:
        side = float(board["square_mm"])
        return _squares(board), (-1.5 * side, -1.5 * side, *((int(board[k]) - 0.5) * side for k in ("columns", "rows")))
    if board["kind"] == "april_grid":
        gap, step = float(board["gap_mm"]), float(board["tag_mm"] + board["gap_mm"])
        return _tags(board), (-2 * gap, -2 * gap, *(int(board[k]) * step + gap for k in ("columns", "rows")))
    at = from_si(board_corners(board), "mm")
    if np.ptp(at[:, 2]) > 0:
        raise InvalidInput("only points in one plane can be drawn; expected the same z in points_mm")
    apart = float(board["square_mm"]) if "square_mm" in board else _nearest(at)
    low, high = at[:, :2].min(axis=0) - apart, at[:, :2].max(axis=0) + apart
    return _dots(at[:, :2], _DOT * apart), (*low.tolist(), *high.tolist())


def _squares(board: Mapping[str, Any]) -> Pattern:
    """Black where column plus row is even; the markers of a ChArUco board in its white squares."""
    side, columns, rows = float(board["square_mm"]), int(board["columns"]), int(board["rows"])
    marked = _markers_of_charuco(board) if board["kind"] == "charuco" else None

    def brightness(x: FloatArray, y: FloatArray) -> FloatArray:
        across, down = x / side + 1, y / side + 1  # from the outer corner, in squares
        i, j = np.floor(across).astype(np.int32), np.floor(down).astype(np.int32)
        inside = (i >= 0) & (j >= 0) & (i < columns) & (j < rows)
        white = (((i ^ j) & 1 != 0) | ~inside).astype(np.float64)
        if marked is not None:
            bits, share = marked
            own = [(value - np.floor(value) - (1 - share) / 2) / share for value in (across, down)]
            within = inside & (white > 0) & (own[0] >= 0) & (own[0] < 1) & (own[1] >= 0) & (own[1] < 1)
            count = bits.shape[-1]
            cells = [np.clip((value * count).astype(int), 0, count - 1) for value in own]
            white[within] = bits[j[within], i[within], cells[1][within], cells[0][within]]
        return np.asarray(white)

    return brightness


def _markers_of_charuco(board: Mapping[str, Any]) -> tuple[FloatArray, float]:
    """(rows, columns, n, n) cells of the marker in each square, and the side of a marker, of that of a square."""
    cv2 = opencv()
    made = charuco(cv2, board)
    markers = dictionary(cv2, board)
    count = int(markers.markerSize) + 2
    side = float(board["square_mm"])
    bits = np.ones((int(board["rows"]), int(board["columns"]), count, count))
    for number, corners in zip(np.ravel(made.getIds()), made.getObjPoints(), strict=True):
        i, j = np.floor(np.mean(corners, axis=0)[:2] / side).astype(int)
        bits[j, i] = cv2.aruco.generateImageMarker(markers, int(number), count) > 0
    return bits, float(board["marker_mm"]) / side


def _tags(board: Mapping[str, Any]) -> Pattern:
    """Tags from the lower left on, x to the right and y up, with a black square where four gaps meet."""
    cv2 = opencv()
    markers = dictionary(cv2, board)
    tag, gap = float(board["tag_mm"]), float(board["gap_mm"])
    columns, rows, step = int(board["columns"]), int(board["rows"]), tag + gap
    count = int(markers.markerSize) + 2
    drawn = [cv2.aruco.generateImageMarker(markers, number, count)[::-1] > 0 for number in range(columns * rows)]
    bits = np.array(drawn, dtype=np.float64).reshape(rows, columns, count, count)

    def brightness(x: FloatArray, y: FloatArray) -> FloatArray:
        i, j = np.floor((x + gap) / step).astype(int), np.floor((y + gap) / step).astype(int)
        own = [(value + gap) % step - gap for value in (x, y)]
        white = np.ones_like(x)
        between = (own[0] < 0) & (own[1] < 0) & (i >= 0) & (j >= 0) & (i <= columns) & (j <= rows)
        white[between] = 0.0
        within = (own[0] >= 0) & (own[1] >= 0) & (i >= 0) & (j >= 0) & (i < columns) & (j < rows)
        cells = [np.clip((value[within] / tag * count).astype(int), 0, count - 1) for value in own]
        white[within] = bits[j[within], i[within], cells[1], cells[0]]
        return white

    return brightness


def _dots(at: FloatArray, radius: float) -> Pattern:
    """Black discs about places (K, 2) [mm]."""

    def brightness(x: FloatArray, y: FloatArray) -> FloatArray:
        white = np.ones_like(x)
        for place in at:
            white[(x - place[0]) ** 2 + (y - place[1]) ** 2 < radius**2] = 0.0
        return white

    return brightness


def _nearest(at: FloatArray) -> float:
    """The least distance between two of (K, 3) points [mm]."""
    apart = np.linalg.norm(at[:, np.newaxis] - at, axis=2)
    return float(apart[~np.eye(len(at), dtype=bool)].min())
