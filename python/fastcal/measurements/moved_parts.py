# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Rows whose points belong to several set-ups: the instrument, the base or the target was moved between them.

A run of rows that agree with the nominal arm gives base and tool. In the rows that do not go with these, runs are
looked for that go with them once the base stands elsewhere (G. Wahba 1965, by the singular values of a 3x3), or the
tool does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IntArray
from fastcal.measurements.frame_fit import Frames
from fastcal.measurements.rotations import best_motion, nearest_rotation

_RUN = 6  # rows that show a part: three place it
_FEWEST = 4  # rows of a part between two moves
_MOST_PARTS = 10
_ROUNDS = 4
_EXPLAINED = 0.8  # of the rows, by the parts
_FEW = 0.1  # of the rows; where no more were moved, a robust fit does without them


@dataclass(frozen=True)
class MovedParts:
    """Rows of several set-ups.

    Attributes:
        firsts: The rows at which another set-up begins, ascending.
        again: Does an earlier set-up come back?
        as_read, better: Root mean square distances [m] of the points, as read and where each part is placed by itself.
        few: So few rows are elsewhere that a robust fit sets them aside.
    """

    firsts: tuple[int, ...]
    again: bool
    as_read: float
    better: float
    few: bool


def moved_parts(T: FloatArray, position: FloatArray, frames: Frames, near: float, far: float) -> MovedParts | None:
    """The set-ups that explain the points of all but few rows; None where there are none, or one alone does.

    Args:
        T: (N, 4, 4) poses of the nominal arm.
        position: (N, 3) points [m].
        frames: Base and tool of some rows that agree.
        near: [m] at which a point is where it should be.
        far: [m] beyond which some points must be: nearer, a calibration looks for moves.
    """
    part = np.full(len(T), -1)
    away = np.linalg.norm(frames.at(T) - position, axis=1)
    part[away <= near] = 0
    as_read = float(np.sqrt(np.mean(away**2)))
    if np.sum(away > far) < _FEWEST:
        return None
    for number in range(1, _MOST_PARTS):
        rows = np.flatnonzero(part < 0)
        found = _part(T[rows], position[rows], frames, near)
        if found is None:
            break
        agree, distances = found
        part[rows[agree]], away[rows[agree]] = number, distances[agree]
    runs = _runs(part)
    if len(runs) < 2:
        return None
    kept = np.concatenate([np.arange(first, end)[part[first:end] == k] for first, end, k in runs])
    if len(kept) < _EXPLAINED * len(T):
        return None
    parts = [k for *_, k in runs]
    firsts = tuple(first for first, *_ in runs[1:])
    better = float(np.sqrt(np.mean(away[kept] ** 2)))
    few = np.max(np.bincount(part[kept])) >= (1 - _FEW) * len(T)
    return MovedParts(firsts, len(set(parts)) < len(parts), as_read, better, bool(few))


def _part(
    T: FloatArray, position: FloatArray, frames: Frames, near: float
) -> tuple[NDArray[np.bool_], FloatArray] | None:
    """The rows that go with base and tool once one of the two is elsewhere, and all rows' distances then."""
    runs = np.arange(0, len(T) - _RUN + 1, _RUN // 2)[:, np.newaxis] + np.arange(_RUN)
    left = _left_by_runs(T, position, frames, runs)
    if not left.min(initial=np.inf) <= near:
        return None
    rows = runs[np.argmin(left)]
    for _ in range(_ROUNDS):
        distances = min(_elsewhere(T, position, frames, rows), key=lambda d: float(np.mean(d[rows] ** 2)))
        agree = distances <= near
        if np.array_equal(np.flatnonzero(agree), rows):
            break
        rows = np.flatnonzero(agree)
        if len(rows) < _FEWEST:
            return None
    return agree, distances


def _left_by_runs(T: FloatArray, position: FloatArray, frames: Frames, runs: IntArray) -> FloatArray:
    """(W,) root mean square distances in runs of rows (W, R) with the base, or the tool, that each fits best itself."""
    hand, own = (T[:, :3, 3] + T[:, :3, :3] @ frames.tool)[runs], position[runs]
    hand, own = (part - part.mean(axis=1, keepdims=True) for part in (hand, own))
    turned = hand @ nearest_rotation(own.swapaxes(1, 2) @ hand).swapaxes(1, 2) - own
    seen = (position - frames.b) @ frames.A - T[:, :3, 3]  # from the flange, in the arm's base
    tool = np.einsum("nji,nj->ni", T[:, :3, :3], seen)[runs].mean(axis=1)
    held = np.einsum("wrij,wj->wri", T[runs, :3, :3], tool) - seen[runs]
    squares = [np.mean(np.sum(left**2, axis=2), axis=1) for left in (turned, held)]
    return np.asarray(np.sqrt(np.minimum(*squares)))


def _elsewhere(T: FloatArray, position: FloatArray, frames: Frames, rows: IntArray) -> list[FloatArray]:
    """(N,) distances of all points with the base, and with the tool, that the given rows fit best."""
    hand, own = T[:, :3, 3] + T[:, :3, :3] @ frames.tool, position[rows]
    motion = best_motion(hand[rows], own)
    seen = (position - frames.b) @ frames.A - T[:, :3, 3]  # from the flange, in the arm's base
    tool = np.einsum("nji,nj->ni", T[rows, :3, :3], seen[rows]).mean(axis=0)
    return [
        np.linalg.norm(hand @ motion[:3, :3].T + motion[:3, 3] - position, axis=1),
        np.linalg.norm(T[:, :3, :3] @ tool - seen, axis=1),
    ]


def _runs(part: IntArray) -> list[tuple[int, int, int]]:
    """First row, row after the last, and part of each run of rows of one part; rows of none, or few, interrupt none."""
    while True:
        known = np.flatnonzero(part >= 0)
        changes = np.flatnonzero(np.diff(part[known])) + 1
        pieces = [piece for piece in np.split(known, changes) if len(piece)]
        short = [piece for piece in pieces if len(piece) < _FEWEST]
        if not short:
            return [(int(piece[0]), int(piece[-1]) + 1, int(part[piece[0]])) for piece in pieces]
        part = part.copy()
        part[min(short, key=len)] = -1
