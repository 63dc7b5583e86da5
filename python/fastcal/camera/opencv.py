# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""OpenCV, where it is installed, and its dictionaries of markers by the names that cell files give them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastcal.errors import InvalidInput

_LEAST = (4, 8)  # the first version whose boards and detectors are those of today


def opencv() -> Any:
    """The module cv2, working on one core: pictures are shared among processes, not one picture among cores.

    Raises:
        InvalidInput: It is not installed, or too old; the sentence says how to get it.
    """
    try:
        import cv2
    except ImportError:
        raise InvalidInput(
            "pictures need OpenCV: pip install 'fastcal[camera]' brings opencv-python-headless"
        ) from None
    version = str(cv2.__version__)
    if tuple(int(part) for part in version.split(".")[:2]) < _LEAST:
        raise InvalidInput(f"pictures need OpenCV 4.8 or newer, got {version}: pip install -U 'fastcal[camera]'")
    cv2.setNumThreads(1)
    return cv2


def dictionary(cv2: Any, board: Mapping[str, Any]) -> Any:
    """The markers of a board.

    Raises:
        InvalidInput: OpenCV has no dictionary of that name; the sentence lists those that it has.
    """
    name = str(board["dictionary"])
    known = {title.removeprefix("DICT_").lower(): title for title in dir(cv2.aruco) if title.startswith("DICT_")}
    bare = name.lower().removeprefix("dict_").removeprefix("tag").removeprefix("t")
    for each in (bare, f"apriltag_{bare}"):
        if each in known:
            return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, known[each]))
    listed = ", ".join(sorted({title.removeprefix("DICT_") for title in known.values()}))
    raise InvalidInput(f"there is no dictionary of markers '{name:.60}'; expected one of {listed}")


def charuco(cv2: Any, board: Mapping[str, Any], *, legacy: bool = False) -> Any:
    """The ChArUco board, as OpenCV draws it; `legacy`: as it did before version 4.6 where rows are even."""
    size = (int(board["columns"]), int(board["rows"]))
    markers = dictionary(cv2, board)
    needed = size[0] * size[1] // 2
    if (there := len(markers.bytesList)) < needed:
        raise InvalidInput(f"a board of {needed} markers needs a larger dictionary: {board['dictionary']} has {there}")
    out = cv2.aruco.CharucoBoard(size, float(board["square_mm"]), float(board["marker_mm"]), markers)
    if legacy:
        out.setLegacyPattern(True)
    return out
