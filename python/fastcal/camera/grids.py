# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Grids of corners: their places on the board, in a picture of another size, and which corner is the first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.robot.rig import board_corners
from fastcal.units import from_si

Picture = NDArray[np.uint8]


def flat_mm(board: Mapping[str, Any]) -> FloatArray:
    """(K, 2) corners of a board in its plane [mm]."""
    return np.asarray(from_si(board_corners(board)[:, :2], "mm"))


def whole(at: Any, scale: float) -> FloatArray:
    """(K, 2) places in the whole picture of places in one that is `scale` times as large."""
    # Centres of pixels: the first lies half a pixel from the edge in both.
    return (np.asarray(at, dtype=np.float64).reshape(-1, 2) + 0.5) / scale - 0.5


def numbered(grey: Picture, grid: FloatArray, *, coloured: bool = False) -> FloatArray:
    """A grid (rows, columns, 2) turned so that x along rows and y down make a right-handed board, black square first.

    A grid that looks the same another way up stays as it is: which way is right, the arm's postures say.
    """
    ways = [grid, grid[::-1, ::-1]]
    if grid.shape[0] == grid.shape[1]:
        turned = grid.transpose(1, 0, 2)
        ways += [turned[::-1], turned[:, ::-1]]
    ways = [way if turns_right(way) else way[:, ::-1] for way in ways]
    if not coloured or min(grid.shape[:2]) < 2:
        return ways[0]
    return max(ways, key=lambda way: _black_first(grey, way) > 0)


def turns_right(grid: FloatArray) -> bool:
    """Does y down a grid (rows, columns, 2) lie to the right of x along its rows, as a board's seen from the front?"""
    across, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return bool(across[0] * down[1] - across[1] * down[0] > 0)


def _black_first(grey: Picture, grid: FloatArray) -> float:
    """How much darker the squares are that should be black: those of even column plus row.

    Squares with a corner that was not found say nothing.
    """
    centre = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    seen = np.isfinite(centre).all(axis=2)
    x, y = (np.clip(np.rint(centre[seen][:, k]).astype(int), 0, grey.shape[1 - k] - 1) for k in (0, 1))
    even = (np.indices(seen.shape).sum(axis=0) % 2 == 0)[seen]
    level = grey[y, x].astype(np.float64)
    return float(level[~even].mean() - level[even].mean()) if even.any() and (~even).any() else 0.0
