# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Corners of a board in a grey picture, to a fraction of a pixel, numbered as the board numbers them.

Boards are looked for in a smaller picture first, which is faster, and in the whole one where nothing was found there.
Their corners are then found in the whole picture where the grey levels' gradients about a corner are all at right
angles to the way to it (W. Förstner and E. Gülch, 1987, as OpenCV's cornerSubPix does it).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.camera.dots import find_circles, find_points
from fastcal.camera.grids import flat_mm, numbered, whole
from fastcal.camera.opencv import charuco, dictionary, opencv
from fastcal.robot.rig import board_corners

Picture = NDArray[np.uint8]

LEAST_GRID = 3  # inner corners across and down that the detector of checkerboards asks for
_SIDE = 1280  # pixels of the larger side in which boards are looked for first
_WINDOW = (2, 11)  # pixels, half the side of the least and of the largest window about a corner
_SMOOTH = 1.0  # pixels over which noise is smoothed before gradients are taken
_NEIGHBOURS = 12  # corners that say where the one between them is
_STRAY = 1.0  # pixels from there
_FEWEST = 4  # corners, or tags, from which the place of a board can be told
_WIDENED = ((1, 1), (2, 3), (1, 3))  # times as large, and pixels of a square over which the brightest counts
_SHARP = 25.0  # variance of the Laplacian below which a picture is called blurred
_DARK, _BRIGHT = 30.0, 225.0  # grey levels of a picture that is exposed wrongly
_WHITE, _WASHED = 254, 0.05  # grey level from which a pixel is clipped, and a share of such pixels that is large


@dataclass(frozen=True, eq=False)
class Seen:
    """A board in a picture.

    Attributes:
        uv: (K, 2) where its corners are [px], (0, 0) the centre of the first pixel; NaN where not seen.
        why: Why nothing was found; empty where something was.
        doubt: What may be wrong with a picture in which less than half of the board was found.
    """

    uv: FloatArray
    why: str = ""
    doubt: str = ""

    @property
    def count(self) -> int:
        """Corners that were found."""
        return int(np.isfinite(self.uv[:, 0]).sum())


def find_board(grey: Picture, board: Mapping[str, Any]) -> Seen:
    """The corners of a board in a picture (height, width).

    Raises:
        InvalidInput: OpenCV is not installed, or does not know the board's markers.
    """
    cv2 = opencv()
    find = {
        "checkerboard": _checkerboard,
        "charuco": _charuco,
        "april_grid": _april_grid,
        "circles": find_circles,
        "points": find_points,
    }[str(board["kind"])]
    least = min(_SIDE / max(grey.shape), 1.0)
    uv, why = None, ""
    for scale in dict.fromkeys((least, 1.0)):
        small = grey if scale == 1 else cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
        uv, why = find(cv2, grey, small, scale, board)
        if uv is not None:
            break
    if uv is None:
        return Seen(np.full((len(board_corners(board)), 2), np.nan), f"{why}{_doubt(cv2, grey)}")
    height, width = grey.shape
    outside = ~((uv >= 0) & (uv <= (width - 1, height - 1))).all(axis=1)
    uv[outside] = np.nan
    is_half = 2 * int(np.isfinite(uv[:, 0]).sum()) >= len(uv)
    return Seen(uv, doubt="" if is_half else _doubt(cv2, grey))


def _checkerboard(
    cv2: Any, grey: Picture, small: Picture, scale: float, board: Mapping[str, Any]
) -> tuple[FloatArray | None, str]:
    inner = (int(board["columns"]) - 1, int(board["rows"]) - 1)
    found, other = False, None
    if min(inner) >= LEAST_GRID:  # what the better detector asks for
        found, at = cv2.findChessboardCornersSB(small, inner, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
        other = None if found else grid_size(cv2, small)
    if not found and other is None:  # on a grid of another size it would search for many seconds
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
        found, at = cv2.findChessboardCorners(small, inner, flags=flags)
    if not found:
        there = "" if other is None else f", but one of {other[1]} x {other[0]}"
        return None, f"no checkerboard of {inner[0]} x {inner[1]} inner corners was found{there}"
    uv = _refined(cv2, grey, whole(at, scale), 0.35)
    return numbered(grey, uv.reshape(inner[1], inner[0], 2), coloured=True).reshape(-1, 2), ""


def grid_size(cv2: Any, grey: Picture) -> tuple[int, int] | None:
    """Inner corners down and across of the checkerboard in a picture, LEAST_GRID at least each; None: there is none."""
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_LARGER
    found, _, meta = cv2.findChessboardCornersSBWithMeta(grey, (LEAST_GRID, LEAST_GRID), flags=flags)
    return meta.shape if found else None


def _charuco(
    cv2: Any, grey: Picture, small: Picture, scale: float, board: Mapping[str, Any]
) -> tuple[FloatArray | None, str]:
    uv = np.full((len(board_corners(board)), 2), np.nan)
    markers = 0
    for legacy in (False, True):
        at, numbers, _, ids = cv2.aruco.CharucoDetector(charuco(cv2, board, legacy=legacy)).detectBoard(small)
        markers = max(markers, 0 if ids is None else len(ids))
        if numbers is not None and len(numbers) >= _FEWEST:
            free = (1 - float(board["marker_mm"]) / float(board["square_mm"])) / 2  # of a square, between the markers
            uv[np.ravel(numbers)] = _refined(cv2, grey, whole(at, scale), free)
            return _without_strays(cv2, uv, flat_mm(board)), ""
    return None, f"no corners of a ChArUco board were found: {markers} markers of {board['dictionary']} are seen"


def charuco_size(cv2: Any, grey: Picture, board: Mapping[str, Any]) -> tuple[int, int] | None:
    """Columns and rows of the ChArUco board in a picture; None: it is none of a size that is easily mistaken.

    Those are columns and rows exchanged, and inner corners counted in place of squares. The markers of one board are no
    grid of another, of which few corners are then found.
    """
    markers = dictionary(cv2, board)
    corners, ids, _ = cv2.aruco.ArucoDetector(markers).detectMarkers(grey)
    if ids is None or len(ids) < _FEWEST:
        return None
    columns, rows = int(board["columns"]), int(board["rows"])
    sizes = [(rows, columns), (columns + 1, rows + 1), (rows + 1, columns + 1), (columns - 1, rows - 1)]
    found: dict[tuple[int, int], int] = {}
    for size in sizes:
        needed = size[0] * size[1] // 2
        if min(size) <= LEAST_GRID or not int(ids.max()) < needed <= len(markers.bytesList):
            continue
        for legacy in (False, True):
            own = charuco(cv2, {**board, "columns": size[0], "rows": size[1]}, legacy=legacy)
            numbers = cv2.aruco.CharucoDetector(own).detectBoard(grey, markerCorners=corners, markerIds=ids)[1]
            found[size] = max(found.get(size, 0), 0 if numbers is None else len(numbers))
    best = max(found, key=lambda size: found[size], default=None)
    return best if best is not None and found[best] >= max(_FEWEST, len(ids) // 2) else None


def _april_grid(
    cv2: Any, grey: Picture, small: Picture, scale: float, board: Mapping[str, Any]
) -> tuple[FloatArray | None, str]:
    # The black squares between the tags touch their corners: paper is widened, so that each tag stands by itself.
    detector = cv2.aruco.ArucoDetector(dictionary(cv2, board), _tag_parameters(cv2))
    count = int(board["columns"]) * int(board["rows"])
    best: dict[int, FloatArray] = {}
    for times, wide in _WIDENED:
        large = cv2.resize(small, None, fx=times, fy=times, interpolation=cv2.INTER_CUBIC) if times > 1 else small
        corners, ids, _ = detector.detectMarkers(cv2.dilate(large, np.ones((wide, wide), np.uint8)))
        for number, at in zip([] if ids is None else np.ravel(ids).tolist(), corners, strict=True):
            if number < count:
                best.setdefault(int(number), whole(at, scale * times))
        if len(best) == count:
            break
    if not best or (len(best) < _FEWEST and count >= _FEWEST):
        return None, f"{len(best)} of the {count} tags of {board['dictionary']} are seen, expected {_FEWEST} at least"
    uv = np.full((4 * count, 2), np.nan)
    for number, corners in _own_corners(cv2, best, board).items():
        uv[4 * number : 4 * number + 4] = corners
    seen = np.isfinite(uv[:, 0])
    sides = np.linalg.norm(np.diff(uv[seen].reshape(-1, 4, 2), axis=1), axis=2)
    uv[seen] = _refined(cv2, grey, uv[seen], 0.1, float(sides.min()))
    return _without_strays(cv2, uv, flat_mm(board)), ""


def _tag_parameters(cv2: Any) -> Any:
    out = cv2.aruco.DetectorParameters()
    out.minMarkerPerimeterRate = 0.02
    return out


def _own_corners(cv2: Any, found: Mapping[int, FloatArray], board: Mapping[str, Any]) -> dict[int, FloatArray]:
    """Corners (4, 2) of each tag in the board's order: where the places of all tags say, whichever way a tag is up."""
    flat = flat_mm(board).reshape(-1, 4, 2)
    at = {number: np.asarray(corners).reshape(4, 2) for number, corners in found.items()}
    numbers = list(at)
    centres = flat[numbers].mean(axis=1)
    if len(numbers) >= _FEWEST and np.linalg.matrix_rank(centres - centres.mean(axis=0), tol=1e-6) == 2:
        H, _ = cv2.findHomography(centres, np.array([at[number].mean(axis=0) for number in numbers]), cv2.RANSAC, 5.0)
        if H is not None:
            return {number: _nearest_way(at[number], cv2.perspectiveTransform(flat[[number]], H)[0]) for number in at}
    # OpenCV goes round from the upper left with the clock, Kalibr from the lower left against it.
    return {number: corners[::-1] for number, corners in at.items()}


def _nearest_way(corners: FloatArray, drawn: FloatArray) -> FloatArray:
    """The four corners of a tag in the order in which they lie nearest to where they are drawn (4, 2)."""
    ways = [np.roll(way, turn, axis=0) for way in (corners, corners[::-1]) for turn in range(4)]
    return min(ways, key=lambda way: float(np.sum((way - drawn) ** 2)))


def _without_strays(cv2: Any, uv: FloatArray, flat: FloatArray) -> FloatArray:
    """Corners (K, 2), NaN where one is not where its neighbours (by the homography of most of them) say."""
    there = np.flatnonzero(np.isfinite(uv[:, 0]))
    if len(there) <= _NEIGHBOURS:
        return uv
    out = uv.copy()
    for k in there:
        apart = np.linalg.norm(flat[there] - flat[k], axis=1)
        near = there[np.argsort(apart, kind="stable")[1 : _NEIGHBOURS + 1]]
        if np.linalg.matrix_rank(flat[near] - flat[near].mean(axis=0), tol=1e-6) < 2:
            continue
        H, _ = cv2.findHomography(flat[near], uv[near], cv2.LMEDS)
        if H is None or np.linalg.norm(cv2.perspectiveTransform(flat[k].reshape(1, 1, 2), H)[0, 0] - uv[k]) > _STRAY:
            out[k] = np.nan
    return out


def _refined(cv2: Any, grey: Picture, at: FloatArray, share: float, apart: float | None = None) -> FloatArray:
    """Corners to a fraction of a pixel, each from a window of `share` of the distance to its nearest neighbour.

    `apart`: that distance [px], where it is known: of the sides of tags.
    """
    reach = apart
    if reach is None:
        between = np.linalg.norm(at[:, np.newaxis] - at, axis=2)
        reach = float(np.min(between[~np.eye(len(at), dtype=bool)]))
    half = int(np.clip(round(share * reach), *_WINDOW))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)
    start = np.ascontiguousarray(at, dtype=np.float32).reshape(-1, 1, 2)
    # Where the window is small, smoothing would draw in what is beside it.
    smooth = cv2.GaussianBlur(grey, (0, 0), _SMOOTH) if apart is None else grey
    out = np.asarray(cv2.cornerSubPix(smooth, start, (half, half), (-1, -1), stop), dtype=np.float64).reshape(-1, 2)
    out[np.linalg.norm(out - at, axis=1) > half] = np.nan
    return out


def _doubt(cv2: Any, grey: Picture) -> str:
    """What may be wrong with a picture in which nothing was found, or little."""
    level = float(grey.mean())
    if level < _DARK:
        return f"; the picture is dark (mean {level:.0f} of 255)"
    if level > _BRIGHT:
        return f"; the picture is too bright (mean {level:.0f} of 255)"
    if (washed := float(np.mean(grey >= _WHITE))) > _WASHED:
        return f"; {100 * washed:.0f} % of the picture are overexposed (white): shorter exposure, or less light"
    if float(cv2.Laplacian(grey, cv2.CV_64F).var()) < _SHARP:
        return "; the picture is blurred or empty"
    return ""
