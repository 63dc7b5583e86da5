# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures of a board as a camera takes them: drawn by the lens model that the fit uses, then blurred and made noisy.

The ray of a pixel is the lens turned round, x <- x - (draw(x) - u) / f, and meets the board's plane z = 0 at
c = (R^T d) t - R^T p with t such that c_z = 0. Rays are found on a lattice of pixels and the places on the board are
interpolated between; each pixel is the mean of what lies under it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.camera.patterns import pattern
from fastcal.robot.rig import lens_numbers
from fastcal.units import from_si

Picture = NDArray[np.uint8]

_STEP = 4  # pixels between the rays that are found
_ROUNDS = 30  # of turning the lens round


@dataclass(frozen=True)
class Exposure:
    """How a picture is taken.

    Attributes:
        blur_px: Standard deviation of what the lens spreads a point over.
        noise: Standard deviation of a pixel, in grey levels of 255.
        black, white, behind: Grey levels of ink, paper and what is behind the board.
        samples: Places across a pixel that are looked at.
    """

    blur_px: float = 0.7
    noise: float = 2.0
    black: float = 30.0
    white: float = 220.0
    behind: float = 110.0
    samples: int = 4


def render(
    camera: Mapping[str, Any],
    board: Mapping[str, Any],
    T_camera_board: FloatArray,
    *,
    exposure: Exposure | None = None,
    seed: int = 0,
) -> Picture:
    """(height, width) grey picture of a flat board.

    Args:
        camera: An entry of `cameras`: its lens and the size of its pictures.
        board: An entry of `boards`.
        T_camera_board: (4, 4) [m], the board's frame in the camera's.
        exposure: Blur, noise and grey levels.
        seed: The same seed gives the same noise.
    """
    taken = exposure or Exposure()
    width, height = (int(side) for side in camera["size_px"])
    print_on, paper = pattern(board)
    x, y = _places(camera, T_camera_board, width, height)
    out = np.full((height, width), taken.behind, dtype=np.float64)
    with np.errstate(invalid="ignore"):
        on = (x > paper[0]) & (y > paper[1]) & (x < paper[2]) & (y < paper[3])
    if on.any():
        # Only the part of the picture that shows the board, in whole cells of the lattice.
        rows, columns = (np.flatnonzero(on.any(axis=axis)) for axis in (1, 0))
        top, left = max(int(rows[0]) - 1, 0), max(int(columns[0]) - 1, 0)
        part = np.s_[top : int(rows[-1]) + 2, left : int(columns[-1]) + 2]
        shown = _cells(x[part], y[part], taken.samples, print_on, paper, taken)
        there = out[top * _STEP : top * _STEP + len(shown), left * _STEP : left * _STEP + shown.shape[1]]
        there[:] = shown[: len(there), : there.shape[1]]
    out = gaussian_filter(out, taken.blur_px)
    out += np.random.default_rng(seed).normal(0.0, taken.noise, out.shape)
    return np.asarray(np.clip(np.rint(out), 0, 255), dtype=np.uint8)


def _places(camera: Mapping[str, Any], T: FloatArray, width: int, height: int) -> tuple[FloatArray, FloatArray]:
    """Where the corners of the lattice's cells are on the board [mm], NaN where their rays miss its plane."""
    rays = _rays(str(camera["model"]), tuple(lens_numbers(dict(camera))), width, height)
    R, p = T[:3, :3], T[:3, 3]
    d, origin = rays @ R, R.T @ p
    with np.errstate(divide="ignore", invalid="ignore"):
        t = origin[2] / d[:, 2]
        t[~(t > 0)] = np.nan
        at = from_si(d * t[:, np.newaxis] - origin, "mm")
    shape = (-(-height // _STEP) + 1, -(-width // _STEP) + 1)
    return at[:, 0].reshape(shape), at[:, 1].reshape(shape)


@lru_cache(maxsize=4)  # the pictures of a session are of one camera, or a few
def _rays(model: str, numbers: tuple[float, ...], width: int, height: int) -> FloatArray:
    """(K, 3) directions with z = 1 that are drawn at the corners of the lattice's cells, row by row."""
    # A cell begins at the edge of a pixel, half a pixel before its centre.
    u, v = np.meshgrid(*(np.arange(-(-side // _STEP) + 1) * _STEP - 0.5 for side in (width, height)))
    uv = np.column_stack([u.ravel(), v.ravel()])
    focal, centre = np.asarray(numbers[:2]), np.asarray(numbers[2:4])
    rays = np.column_stack([(uv - centre) / focal, np.ones(len(uv))])
    for _ in range(_ROUNDS):
        rays[:, :2] -= (_core.draw(model, list(numbers), rays) - uv) / focal
    rays.flags.writeable = False
    return rays


def _cells(
    x: FloatArray, y: FloatArray, samples: int, print_on: Any, paper: tuple[float, ...], taken: Exposure
) -> FloatArray:
    """The pixels of the cells between places x, y (a, b) on the board."""
    count = _STEP * samples
    t = (np.arange(count) + 0.5) / count

    def between(of: FloatArray) -> FloatArray:
        down = of[:-1, np.newaxis] * (1 - t)[:, np.newaxis] + of[1:, np.newaxis] * t[:, np.newaxis]
        down = down.reshape(-1, of.shape[1])
        across = down[:, :-1, np.newaxis] * (1 - t) + down[:, 1:, np.newaxis] * t
        return np.asarray(across.reshape(len(down), -1))

    at_x, at_y = between(x), between(y)
    with np.errstate(invalid="ignore"):
        on = (at_x > paper[0]) & (at_y > paper[1]) & (at_x < paper[2]) & (at_y < paper[3])
    grey = np.full(at_x.shape, taken.behind, dtype=np.float64)
    grey[on] = taken.black + (taken.white - taken.black) * print_on(at_x[on], at_y[on])
    rows = reduce(np.add, (grey[k::samples] for k in range(samples)))
    return np.asarray(reduce(np.add, (rows[:, k::samples] for k in range(samples))) / samples**2)
