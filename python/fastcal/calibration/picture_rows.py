# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The row whose posture each picture fits, and the order in which its corners were read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]

JUDGED = 5.0  # times better than as it is, in px
TURNED = 20.0  # times better in another order of corners, in its own row: no other posture draws that
OTHER_END = 3.0  # times better in another order, in its own row, which then fits as pictures do and did not before
ABOUT = 4.0  # times the median picture: an arm as it is drawn misses some pictures by more than others
FEWEST = 4  # pictures of a camera and a board, from which a few can be told from the many


@dataclass(frozen=True, eq=False)
class Picture:
    """What one camera saw of one board.

    Attributes:
        row: Where the table has it.
        uv: (K, 2) its corners [px], NaN where not seen.
        fits: The row whose posture it fits; its own unless another does far better.
        order: Of `orders` that in which its corners are.
    """

    row: int
    uv: FloatArray
    fits: int = -1
    order: int = 0

    def __post_init__(self) -> None:
        if self.fits < 0:
            object.__setattr__(self, "fits", self.row)


def placed(found: Sequence[Picture], drawn: FloatArray, order: Sequence[IntArray]) -> list[Picture]:
    """The pictures of one camera and board, each with the row whose posture it fits; `drawn` is (N, K, 2) [px]."""
    if len(found) < FEWEST:
        return list(found)
    ways = [drawn[:, of] for of in order]
    miss = np.array([[rms_to(picture.uv, way) for way in ways] for picture in found])  # (pictures, ways, postures)
    usual = float(np.median([of[:, picture.row].min() for of, picture in zip(miss, found, strict=True)]))
    out = []
    for of, picture in zip(miss, found, strict=True):
        own, best = of[:, picture.row], float(of.min())
        is_far = best > ABOUT * usual
        if is_far and own.min() * TURNED < own[0] and own.min() < min(TURNED * usual, 2 * best):
            out.append(replace(picture, order=int(np.argmin(own))))
            continue
        if best * JUDGED > own[0] or is_far:
            is_turned = (
                own.min() * OTHER_END < own[0] and own.min() <= min(ABOUT * usual, 2 * best) and ABOUT * usual < own[0]
            )
            out.append(replace(picture, order=int(np.argmin(own))) if is_turned else picture)
            continue
        way, posture = divmod(int(np.argmin(of)), len(drawn))
        if own.min() <= 2 * best:  # its own posture does as well
            way, posture = int(np.argmin(own)), picture.row
        out.append(replace(picture, fits=posture, order=way))
    return _in_pairs(out, miss)


def _in_pairs(fitted: Sequence[Picture], miss: FloatArray) -> list[Picture]:
    """The same; where one picture fits another's row, that other, if it fits the one's row best, is exchanged with it.

    `miss` is (pictures, orders, postures) [px]. What is plain of the one need only be likely of the other.
    """
    out = list(fitted)
    for picture in fitted:
        for k, other in enumerate(fitted):
            way, posture = divmod(int(np.argmin(miss[k])), miss.shape[2])
            if picture.fits == other.row != picture.row and other.fits == other.row and posture == picture.row:
                out[k] = replace(other, fits=posture, order=way)
    return out


def of_rows_with_their_own(placed: Sequence[Picture]) -> list[Picture]:
    """Pictures that fit another row, which has its own, and slipped there alone: of a pair only half mended by hand."""
    at_home = {picture.row for picture in placed if picture.fits == picture.row}
    steps = [picture.fits - picture.row for picture in placed]
    return [
        picture
        for picture, step in zip(placed, steps, strict=True)
        if step and picture.fits in at_home and picture.row not in at_home and steps.count(step) == 1
    ]


def rms_to(seen: FloatArray, drawn: FloatArray) -> FloatArray:
    """(N,) root mean square distance of a picture's corners (K, 2) from those (N, K, 2) that each posture draws."""
    known = np.isfinite(seen).all(axis=1)
    seen, drawn = seen[known], drawn[:, known]
    return np.asarray(np.sqrt(np.mean(np.sum((drawn - seen) ** 2, axis=2), axis=1)))
