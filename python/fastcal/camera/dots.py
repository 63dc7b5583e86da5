# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Boards of dots, dark on paper or bright on black: grids of circles and lists of points.

A bright dot is a dark one of the negative. A dot is found where its darkness weighs, which is not where its middle is
seen: perspective makes the near half of a disc the larger one, and a lens that bends lines moves what is far from its
middle. The outlines of all dots are drawn by a homography and one number of the lens, which are fitted to where the
dots weigh, and the way from the middle of each outline to its dot's is taken off. For a lens that bends nothing that is
what the dual conic of a disc says (J. Heikkila, 2000, eq. 9).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from fastcal.arrays import FloatArray, thin_svd
from fastcal.camera.grids import flat_mm, numbered, turns_right, whole
from fastcal.robot.rig import board_corners
from fastcal.units import from_si

Picture = NDArray[np.uint8]

_LEAST_AREA = 20.0  # square pixels of a dot
_ROUND, _CONVEX, _LONG = 0.6, 0.9, 0.15  # least circularity, convexity, and short by long axis of a dot
_NEAR = 0.3  # of the distance between two points: a dot is that point
_FEWEST = 4
_EDGE = 7  # pixels, in which a blurred dot ends on both sides
_AS_GOOD, _STRAY = 2.0, 1.0  # times the error of the best order of the dots, and pixels: another is as good
_OUTLINE = 64  # places round a dot
_SMALL = 1e-3  # of a board's extent: the radius of dots at first
_FEWEST_BENT = 5  # dots, from which a lens that bends is fitted as well
_FLAT = 1e-6  # of their extent: points lie in a plane


def find_circles(
    cv2: Any, grey: Picture, small: Picture, scale: float, board: Mapping[str, Any]
) -> tuple[FloatArray | None, str]:
    """Middles of the circles of a grid, row by row."""
    size, is_asymmetric = (int(board["columns"]), int(board["rows"])), bool(board.get("asymmetric"))
    kinds = [cv2.CALIB_CB_SYMMETRIC_GRID, cv2.CALIB_CB_ASYMMETRIC_GRID]
    own, other = kinds[::-1] if is_asymmetric else kinds
    shades = ((grey, small), (255 - grey, 255 - small))
    for whole_picture, part in shades:
        found, at = cv2.findCirclesGrid(part, size, flags=own, blobDetector=_detector(cv2, part))
        if found:
            grid = whole(at, scale).reshape(size[1], size[0], 2)
            grid = _asymmetric(cv2, grid, flat_mm(board)) if is_asymmetric else numbered(grey, grid)
            return _middles(cv2, whole_picture, grid.reshape(-1, 2), flat_mm(board)), ""
    why = f"no grid of {size[0]} x {size[1]} circles was found"
    if is_asymmetric:
        why = f"no asymmetric grid of {size[0]} x {size[1]} circles was found"
    if any(cv2.findCirclesGrid(part, size, flags=other, blobDetector=_detector(cv2, part))[0] for _, part in shades):
        why += ", but a symmetric one" if is_asymmetric else ", but an asymmetric one (asymmetric: true)"
    return None, why


def _asymmetric(cv2: Any, grid: FloatArray, flat: FloatArray) -> FloatArray:
    """A grid (rows, columns, 2) turned to where its rows are shifted as those of the board (K, 2) are.

    With an odd number of rows that tells both ends; with an even one the board looks the same from both.
    """
    ways = [grid, grid[::-1, ::-1], grid[::-1], grid[:, ::-1]]
    ways = [way for way in ways if turns_right(way)]

    def left(way: FloatArray) -> float:
        H, _ = cv2.findHomography(flat, way.reshape(-1, 2))
        drawn = cv2.perspectiveTransform(flat[np.newaxis], H)[0] if H is not None else np.inf
        return float(np.sum((drawn - way.reshape(-1, 2)) ** 2))

    return min(ways, key=left)


def find_points(
    cv2: Any, grey: Picture, small: Picture, scale: float, board: Mapping[str, Any]
) -> tuple[FloatArray | None, str]:
    """Dots at the points of a list in a plane, whichever way up: the one that fits the dots best."""
    flat = _in_their_plane(board_corners(board))
    if flat is None:
        return (
            None,
            "its points do not lie in a plane: no detector here finds them, give their corners as a table",
        )
    why = []
    for whole_picture, part in ((grey, small), (255 - grey, 255 - small)):
        blobs = _detector(cv2, part).detect(part)
        if len(blobs) < len(flat):
            why.append(f"{len(blobs)} dots are seen, expected {len(flat)}")
            continue
        size = np.log([blob.size for blob in blobs])
        alike = np.argsort(np.abs(size - np.median(size)), kind="stable")[: len(flat)]
        ways = _matched(cv2, flat, whole([blobs[k].pt for k in alike], scale))
        if len(ways) == 1:
            return _middles(cv2, whole_picture, ways[0], flat), ""
        if ways:
            return None, (
                f"{len(flat)} dots are seen that match its points in {len(ways)} ways, as they are arranged "
                "symmetrically (four always are): which dot is which can't be told; add a dot or move one"
            )
        why.append(f"{len(blobs)} dots are seen, which do not lie as the {len(flat)} points do")
    return None, why[0]


def _detector(cv2: Any, picture: Picture) -> Any:
    given = cv2.SimpleBlobDetector_Params()
    given.minArea, given.maxArea = _LEAST_AREA, 0.05 * picture.size
    given.minDistBetweenBlobs = 3.0
    given.minCircularity, given.minConvexity, given.minInertiaRatio = _ROUND, _CONVEX, _LONG
    given.filterByCircularity = given.filterByConvexity = given.filterByInertia = given.filterByColor = True
    given.blobColor = 0
    return cv2.SimpleBlobDetector_create(given)


def _in_their_plane(at: FloatArray) -> FloatArray | None:
    """(K, 2) of points (K, 3) in axes of their plane [mm]; None where they lie in none."""
    centred = from_si(at - at.mean(axis=0), "mm")
    _, sizes, axes = thin_svd(centred)
    if sizes[2] > _FLAT * sizes[0]:
        return None
    if np.ptp(at[:, 2]) <= _FLAT * sizes[0]:
        return np.asarray(from_si(at[:, :2], "mm"))
    return np.asarray(centred @ axes[:2].T)


def _matched(cv2: Any, flat: FloatArray, dots: FloatArray) -> list[FloatArray]:
    """The dots (K, 2) in the order of the points, by each homography that fits them, the best first.

    The hull's order round is kept by every picture of a plane.
    """
    hull = _hull(cv2, flat, len(flat))
    seen = _hull(cv2, dots, len(hull))
    if len(seen) != len(hull) or len(hull) < _FEWEST:
        return []
    between = np.linalg.norm(dots[:, np.newaxis] - dots, axis=2)
    near = _NEAR * float(between[~np.eye(len(dots), dtype=bool)].min())
    fits: list[tuple[float, FloatArray]] = []
    for way in (seen, seen[::-1]):
        for turn in range(len(way)):
            H, _ = cv2.findHomography(flat[hull], dots[np.roll(way, turn)])
            if H is None:
                continue
            drawn = cv2.perspectiveTransform(flat[np.newaxis], H)[0]
            apart = np.linalg.norm(drawn[:, np.newaxis] - dots, axis=2)
            own = np.argmin(apart, axis=1)
            error = float(np.sqrt(np.mean(apart[np.arange(len(own)), own] ** 2)))
            if len(set(own.tolist())) == len(own) and error < near:
                fits.append((error, dots[own]))
    fits.sort(key=lambda fit: fit[0])
    return [fit for error, fit in fits if error < max(_AS_GOOD * fits[0][0], _STRAY)]


def _hull(cv2: Any, at: FloatArray, most: int) -> NDArray[np.intp]:
    """Places in `at` of the corners of its convex hull, in order round; the flattest are left out beyond `most`."""
    hull = np.ravel(cv2.convexHull(at.astype(np.float32), returnPoints=False)).astype(np.intp)
    while len(hull) > max(most, 3):
        a, b, c = (at[np.roll(hull, turn)] for turn in (1, 0, -1))
        area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        hull = np.delete(hull, int(np.argmin(area)))
    return hull


def _middles(cv2: Any, grey: Picture, at: FloatArray, flat: FloatArray) -> FloatArray:
    """Where the middles of dots near (K, 2) are seen, to a fraction of a pixel; `flat` (K, 2) on the board [mm]."""
    apart = np.linalg.norm(at[:, np.newaxis] - at, axis=2)
    np.fill_diagonal(apart, np.inf)
    found = [
        _weighed(cv2, grey, place, 0.5 * reach) for place, reach in zip(at, apart.min(axis=1).tolist(), strict=True)
    ]
    middles, areas = np.array([place for place, _ in found]), np.array([area for _, area in found])
    H, _ = cv2.findHomography(flat, middles)
    if H is None or not (areas > 0).all():
        return middles
    return np.asarray(middles - _aside(H, middles, areas, flat, grey.shape))


def _weighed(cv2: Any, grey: Picture, at: FloatArray, reach: float) -> tuple[FloatArray, float]:
    """Where the darkness about a place weighs, within half the distance to the next dot, and its area [px^2]."""
    height, width = grey.shape
    x0, x1 = max(int(at[0] - reach), 0), min(int(at[0] + reach) + 2, width)
    y0, y1 = max(int(at[1] - reach), 0), min(int(at[1] + reach) + 2, height)
    part = grey[y0:y1, x0:x1].astype(np.float64)
    y, x = np.mgrid[y0:y1, x0:x1]
    if min(part.shape) < 3:
        return at, 0.0
    middle = grey[int(at[1]) : int(at[1]) + 2, int(at[0]) : int(at[0]) + 2]
    dark, bright = float(middle.mean()), float(np.percentile(part, 90))
    # The dot and its edge alone: what is beside the board may be dark too.
    _, of = cv2.connectedComponents((part < (dark + bright) / 2).astype(np.uint8))
    own = of[min(round(at[1]) - y0, y1 - y0 - 1), min(round(at[0]) - x0, x1 - x0 - 1)]
    dot = cv2.dilate(((of == own) & (own > 0)).astype(np.uint8), np.ones((_EDGE, _EDGE), np.uint8))
    # Paper and its noise weigh nothing, ink all; the edge by its share.
    weight = np.clip((0.9 * bright + 0.1 * dark - part) / max(0.8 * (bright - dark), 1.0), 0, 1) * dot
    total = float(weight.sum())
    if total <= 0:
        return at, 0.0
    return np.array([np.sum(weight * x), np.sum(weight * y)]) / total, total


def _aside(
    H: FloatArray, middles: FloatArray, areas: FloatArray, flat: FloatArray, shape: tuple[int, ...]
) -> FloatArray:
    """(K, 2) from where the middle of each dot is drawn to the middle of its outline [px].

    A place x on the board [mm] is drawn at c + (1 + b |d|^2) d, d = H x - c, c the middle of the picture, lengths in
    halves of its diagonal; H and b are those that draw the outlines' middles nearest to where the dots weigh.

    Args:
        H: (3, 3) homography of the dots as they are seen, to begin with.
        middles: (K, 2) where the dots weigh [px].
        areas: (K,) how many pixels they cover.
        flat: (K, 2) the dots' middles on the board [mm].
        shape: Height and width of the picture.
    """
    size = np.array(shape[1::-1])
    centre, half = (size - 1) / 2, float(np.linalg.norm(size)) / 2
    seen = (middles - centre) / half
    H = np.array([[1 / half, 0, -centre[0] / half], [0, 1 / half, -centre[1] / half], [0, 0, 1]]) @ H
    angles = 2 * np.pi * np.arange(_OUTLINE) / _OUTLINE
    ring: FloatArray = np.column_stack([np.cos(angles), np.sin(angles)])
    is_bent = len(flat) >= _FEWEST_BENT

    def draw(numbers: FloatArray, at: FloatArray) -> FloatArray:
        straight = at @ numbers[:6].reshape(2, 3)[:, :2].T + numbers[[2, 5]]
        straight /= (at @ numbers[6:8] + 1.0)[..., np.newaxis]
        bend = numbers[8] if is_bent else 0.0
        return np.asarray(straight * (1 + bend * np.sum(straight**2, axis=-1, keepdims=True)))

    def weighed(numbers: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
        return _polygons(draw(numbers, flat[:, np.newaxis] + radius * ring))

    numbers, radius = np.append((H / H[2, 2]).ravel()[:8], [0.0] if is_bent else []), _SMALL * float(np.ptp(flat))
    for _ in range(2):  # how large the dots are, and where they are drawn
        radius *= float(np.median(np.sqrt(areas / (half**2 * weighed(numbers, radius)[1]))))
        numbers = least_squares(
            lambda x, r: np.ravel(weighed(x, r)[0] - seen), numbers, x_scale="jac", args=(radius,)
        ).x
    return np.asarray(half * (weighed(numbers, radius)[0] - draw(numbers, flat)))


def _polygons(outlines: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(K, 2) middles and (K,) areas of polygons (K, n, 2)."""
    x, y = np.moveaxis(outlines - outlines[:, :1], -1, 0)
    cross = x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y
    twice = cross.sum(axis=1)
    middle = np.column_stack([np.sum((of + np.roll(of, -1, axis=1)) * cross, axis=1) for of in (x, y)])
    return outlines[:, 0] + middle / (3 * twice[:, np.newaxis]), np.abs(twice) / 2
