# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do points stand in the rows of their poses? Rows that were exchanged, and blocks that slipped against the joints.

Base and tool are fitted to rows that agree: to all, or to a run of neighbouring rows, as read or some rows late. With
these, each row's joints say where its point should be, and the nearest measured point says in which row it stands.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IntArray
from fastcal.measurements.frame_fit import Frames, Poses, fitted, point_bounds
from fastcal.measurements.moved_parts import MovedParts, moved_parts

MOST_ROWS = 1500  # of more, nothing is said: distances of all rows from all points
_NEAR = 0.01  # of the reach, between a point and where it should be
_RUN = 14  # rows that are tried as a block in itself
_LATE = 3  # rows by which a block may have slipped
_CLEAR = 0.03  # of the spread that a block may leave at its bound
_EXPLAINED = 0.8  # of the rows, by an order that was found
_CHANCE = 0.01  # of any point near to a place in space
_AGREES = 0.2  # of what all rows leave, by a run of them
_FEW = 0.1  # of the rows; where no more stand elsewhere, a robust fit does without them
_TOLD = 6  # blocks


@dataclass(frozen=True)
class Order:
    """Where the points of rows stand.

    Attributes:
        words: As it stands after "with".
        as_read, better: Root mean square distances [m] of all rows as read, and of those that were found.
        few: So few rows are concerned that a robust fit sets them aside.
    """

    words: str
    as_read: float
    better: float
    few: bool


class Rows:
    """The rows of a data set in their order, beside the nominal arm."""

    def __init__(
        self, poses: Poses, q: FloatArray, position: FloatArray, as_read: Frames, reach: float, numbers: IntArray
    ) -> None:
        """All rows whose point is whole.

        Args:
            poses: Of the nominal arm.
            q: (N, n) joints.
            position: (N, 3) points.
            as_read: The fit of some of the rows as they are.
            reach: [m].
            numbers: (N,) of the rows, as a reader counts them.
        """
        self.poses, self.q, self.position, self.as_read, self.reach = poses, q, position, as_read, reach
        self.numbers, self.T = numbers, poses(q)

    @cached_property
    def block(self) -> Frames | None:
        """Base and tool of a run of rows that agree; None where there is none, or too few or too many rows."""
        if not 2 * _RUN < len(self.q) <= MOST_ROWS:
            return None
        return _block(self.poses, self.q, self.position, self.T, self.reach)

    def moved(self) -> MovedParts | None:
        """The set-ups in which all but few rows stand, each as read; None where they are not several."""
        far = _NEAR * self.reach
        agree = self.block is not None and self.block.rms < _AGREES * self.as_read.rms
        frames = self.block if agree else self.as_read if self.as_read.rms <= far else None
        return None if frames is None else moved_parts(self.T, self.position, frames, self._near(frames), far)

    def _near(self, block: Frames) -> float:
        return min(_NEAR * self.reach, 6.0 * block.rms + 1e-6)

    def other_order(self) -> Order | None:
        """The order of rows that explains the points, None where they stand in it or where none is found."""
        if not 2 * _RUN < len(self.q) <= MOST_ROWS:
            return None
        at, position = self.as_read.at(self.T), self.position
        own = np.linalg.norm(at - position, axis=1)
        near = min(_NEAR * self.reach, 5.0 * self.as_read.rms)
        if self.as_read.rms > _NEAR * self.reach:
            if self.block is None:
                return None
            at, near = self.block.at(self.T), self._near(self.block)
        elif (own <= 2.0 * near).all():
            return None
        stands = _rows_of(at, position, near)
        rows = np.arange(len(stands))  # a point that is where it belongs is no other row's, however near that is
        stands = np.where((stands >= 0) & (stands != rows) & (stands[stands] == stands), -1, stands)
        known = stands >= 0
        moved = np.flatnonzero(known & (stands != rows))
        apart = np.linalg.norm(position - np.median(position, axis=0), axis=1)
        by_chance = len(stands) * (near / np.median(apart)) ** 3
        if not len(moved) or np.mean(known) < _EXPLAINED or by_chance > _CHANCE:
            return None
        better = float(np.sqrt(np.mean(np.sum((at - position[stands])[known] ** 2, axis=1))))
        few = len(moved) <= _FEW * len(stands)
        return Order(_words(stands, self.numbers), float(np.sqrt(np.mean(own**2))), better, few)


def _rows_of(at: FloatArray, position: FloatArray, near: float) -> IntArray:
    """(N,) the row in which the point of each row stands: its own where it is near, else the nearest; -1: none."""
    distances = np.linalg.norm(at[:, np.newaxis] - position, axis=2)
    nearest = np.argmin(distances, axis=1)
    rows = np.arange(len(at))
    stands = np.where(distances[rows, nearest] <= near, nearest, -1)
    return np.where(distances[rows, rows] <= 2.0 * near, rows, stands)


def _block(poses: Poses, q: FloatArray, position: FloatArray, T: FloatArray, reach: float) -> Frames | None:
    """Base and tool of the run of rows that agree best, as read or some rows late."""
    best = (_CLEAR, 0, 0)
    for late in range(-_LATE, _LATE + 1):
        firsts = np.arange(max(0, -late), len(q) - _RUN - max(0, late) + 1, _RUN // 2)
        runs = firsts[:, np.newaxis] + np.arange(_RUN)
        bounds = point_bounds(T[runs], position[runs + late])
        best = min([best, *zip(bounds.tolist(), firsts.tolist(), [late] * len(firsts), strict=True)])
    bound, first, late = best
    if bound >= _CLEAR:
        return None
    rows = np.arange(first, first + _RUN)
    for _ in range(3):
        frames = fitted(poses, q[rows], position[rows + late])
        away = np.linalg.norm(frames.at(T) - position[np.clip(np.arange(len(q)) + late, 0, len(q) - 1)], axis=1)
        more = np.flatnonzero(away <= 3.0 * frames.rms + 1e-9)
        more = more[(more + late >= 0) & (more + late < len(q))]
        if len(more) <= len(rows):
            break
        rows = more
    return frames if frames.rms <= _NEAR * reach else None


def _words(stands: IntArray, numbers: IntArray) -> str:
    """Rows that are exchanged, and runs of rows of which the points stand elsewhere."""
    rows = np.arange(len(stands))
    pairs = [(i, int(j)) for i, j in enumerate(stands) if j > i and stands[j] == i]
    told = [f"rows {numbers[i]} and {numbers[j]} exchanged" for i, j in pairs]
    left = np.where(np.isin(rows, np.array(pairs, dtype=np.int64).ravel()), rows, stands)
    step = _filled(left - rows, left >= 0)
    ends = np.flatnonzero(np.diff(np.concatenate([[0], step, [0]])))
    for first, end in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        if step[first]:
            told.append(_run(first, end - 1, int(step[first]), numbers))
    listed = told[:_TOLD] + ([f"{len(told) - _TOLD} more such places"] if len(told) > _TOLD else [])
    *most, last = listed
    return f"{', '.join(most)} and {last}" if most else last


def _filled(step: IntArray, known: NDArray[np.bool_]) -> IntArray:
    """(N,) how far away each row's point stands; gross points between two that stand alike do as these."""
    rows = np.arange(len(step))
    before = np.maximum.accumulate(np.where(known, rows, -1))
    after = np.minimum.accumulate(np.where(known, rows, len(step))[::-1])[::-1]
    one, other = step[before], step[np.minimum(after, len(step) - 1)]
    return np.where(known, step, np.where((before >= 0) & (after < len(step)) & (one == other), one, 0))


def _run(first: int, last: int, step: int, numbers: IntArray) -> str:
    if first == last:
        return f"the point of row {numbers[first + step]} in row {numbers[first]}"
    begin, end = numbers[first], numbers[last]
    rows = "the points" if (first, last) == (0, len(numbers) - 1) else f"the points of rows {begin} to {end}"
    rows = f"the points from row {begin} on" if first and last >= len(numbers) - 1 - abs(step) else rows
    much = "one row" if abs(step) == 1 else f"{abs(step)} rows"
    return f"{rows} taken from {much} {'below' if step > 0 else 'above'}"
