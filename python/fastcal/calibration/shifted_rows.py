# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Did the instrument, the base or the target move between rows? A search for the rows of the changes.

The motion of the base, or of the target, is tried from every row on, beside the parameters of the fit (change_point),
or where that explains little, between every two rows; and then another one beside those that were found. They count
where together they explain more than half of what remains, more than a drift in the order of the rows with as many
numbers does, and each more than chance could by an F test over all rows. One more counts where it, or two, explain more
than half of what the others leave. A body that moved is a jump that stands out among the changes between other rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fastcal.arrays import FloatArray, IntArray
from fastcal.calibration.change_point import find_step, find_stretch
from fastcal.calibration.gamma_tail import gamma_tail
from fastcal.calibration.row_weights import huber_weights

_CHANCE = 1e-6
EXPLAINED = 0.5  # of the weighted squares
_SHOWN = 0.25  # of a move must be left by a fit without it
_FEWEST = 4  # rows on each side: three points place a body, the fourth tests it
_MOST = 5  # moves
_AHEAD = 2  # moves that may be needed together
_STANDS_OUT, _WINDOWS = 2.0, 5  # times the largest change elsewhere, over a fifth of the shortest part
_LOOKED_AT = 60  # places elsewhere
_ROUNDS = 5
_RANK = 1e-10
_POSTURE = 6  # numbers


@dataclass(frozen=True, eq=False)
class Shift:
    """From each of the rows `firsts` on, the points lie elsewhere again, by `size` [m] (RMS) from the first place.

    `columns` (m, k) are those of the motions, 0 before their rows, and `left` the cost (`huber_fit`) that they leave.
    `stands_out`: a body moved; else a condition may have changed there, or what an arm misses, slowly.
    """

    firsts: tuple[int, ...]
    size: float
    columns: FloatArray
    left: float
    stands_out: bool

    def parts(self, count: int) -> list[IntArray]:
        """The rows, of `count`, before, between and after the changes."""
        return np.split(np.arange(count), self.firsts)

    def kept(self, count: int) -> IntArray:
        """The rows of the longest part."""
        return max(self.parts(count), key=len)


def find_shift(
    J: FloatArray, motions: list[FloatArray], residual: FloatArray, row: IntArray, scale: float
) -> Shift | None:
    """The changes that explain the residual, or None.

    Args:
        J: (m, p) whitened columns of the fit's parameters.
        motions: (m, 6 or 3) columns of motions of the base and of the target.
        residual: (m,) whitened, predicted less measured.
        row: (m,) the row of the data that each number belongs to, ascending.
        scale: [m] the standard deviation that a whitened 1 stands for.
    """
    rows = np.unique(row)
    if len(rows) < 2 * _FEWEST or _numbers(row) - J.shape[1] - 6 < 6:
        return None
    alone = _left(J, residual, row)
    steps = _steps(J, motions, residual, row, alone)
    if not steps:
        return None
    firsts = tuple(sorted(first for step in steps for first in step.firsts))
    columns = np.hstack([step.columns for step in steps])
    squares = steps[-1].left
    order = (row - rows.mean()) / max(float(np.ptp(rows)), 1.0)
    powers = [order[:, np.newaxis] ** (k + 1) for k in range(len(firsts))]
    drift = min(_left(np.hstack([J, *(motion * power for power in powers)]), residual, row) for motion in motions)
    if squares > drift:
        return None
    _, found = huber_fit(np.hstack([J, columns]), residual, row)
    moved = columns @ found[J.shape[1] :]
    late = row >= firsts[0]
    size = float(np.sqrt(np.sum(moved[late] ** 2) / np.sum(rows >= firsts[0])))
    _, x = huber_fit(J, residual, row)
    left = float(np.sqrt(np.sum((residual - J @ x)[late] ** 2) / np.sum(rows >= firsts[0])))
    if left < _SHOWN * size:  # the parameters make up for it: along a path early and late postures differ
        return None
    stands_out = _stand_out(steps, firsts, residual - J @ found[: J.shape[1]], row)
    return Shift(firsts, size * scale, columns, squares, stands_out)


@dataclass(frozen=True, eq=False)
class _Step:
    """Changes at one row or two, the columns of their motions, and the cost that is left with those before them.

    `motion` (m, 6 or 3) are the columns of the motion in every row, `columns` those of each change, 0 before its row.
    """

    firsts: tuple[int, ...]
    motion: FloatArray
    columns: FloatArray
    left: float


def _steps(J: FloatArray, motions: list[FloatArray], residual: FloatArray, row: IntArray, alone: float) -> list[_Step]:
    """As many changes as are needed, in the order in which they were found; the last one's cost is that of all."""
    found: list[_Step] = []
    needed, cost = 0, alone
    while len(found) < min(_MOST, needed + _AHEAD if needed else _MOST):
        step = _next(np.hstack([J, *(step.columns for step in found)]), motions, residual, row, found)
        if step is None or not _beyond_chance(J, motions, residual, row, [*found, step], cost):
            break
        found.append(step)
        cost = step.left
        if cost < EXPLAINED * (found[needed - 1].left if needed else alone):
            needed = len(found)
    return found[:needed]


def _next(
    J: FloatArray, motions: list[FloatArray], residual: FloatArray, row: IntArray, found: list[_Step]
) -> _Step | None:
    """The change that explains most beside the columns J; None where none leaves enough rows on each side."""
    best: _Step | None = None
    alone = found[-1].left if found else _left(J, residual, row)
    for is_stretch in (False, True):
        for columns in motions:
            firsts: tuple[int, ...]
            if is_stretch:
                firsts = find_stretch(J, columns, residual, row, _FEWEST) or ()
            else:
                at, _ = find_step(J, columns, residual, row, np.arange(row[-1] + 1, dtype=float))
                firsts = (int(np.ceil(at)),)
            if not firsts or not _apart(row, [*firsts, *(first for step in found for first in step.firsts)]):
                continue
            moved = np.hstack([columns * (row >= first)[:, np.newaxis] for first in firsts])
            squares = _left(np.hstack([J, moved]), residual, row)
            if best is None or squares < best.left:
                best = _Step(firsts, columns, moved, squares)
        if best is not None and best.left < EXPLAINED * alone:
            break
    return best


def _stand_out(steps: list[_Step], firsts: tuple[int, ...], residual: FloatArray, row: IntArray) -> bool:
    """Is each change, from some rows before it to as many after it, far larger than any other in the residual?

    What an arm misses changes slowly along a path, and a motion for each part fits it well: but then the rows change as
    much elsewhere.
    """
    rows = np.unique(row)
    places = np.searchsorted(rows, firsts)
    ends = [0, *places.tolist(), len(rows)]
    width = max(2, min(b - a for a, b in pairwise(ends)) // _WINDOWS)
    within = np.concatenate([np.arange(a + width, b - width + 1) for a, b in pairwise(ends)])
    others = within[:: max(1, len(within) // _LOOKED_AT)]
    for step in steps:
        usual = max((_jump(step.motion, residual, row, rows, at, width) for at in others.tolist()), default=0.0)
        for first in step.firsts:
            at = int(np.searchsorted(rows, first))
            if _jump(step.motion, residual, row, rows, at, width) < _STANDS_OUT * usual:
                return False
    return True


def _jump(motion: FloatArray, residual: FloatArray, row: IntArray, rows: IntArray, at: int, width: int) -> float:
    """How far a motion fitted to the rows from place `at` on moves these, from where that of those before them does."""
    ends = (rows[max(at - width, 0)], rows[at], rows[min(at + width, len(rows)) - 1] + 1)
    before, after = (slice(*np.searchsorted(row, (a, b))) for a, b in pairwise(ends))
    earlier, later = (np.linalg.lstsq(motion[of], residual[of], rcond=_RANK)[0] for of in (before, after))
    return float(np.sqrt(np.mean((motion[after] @ (later - earlier)) ** 2)))


def _apart(row: IntArray, firsts: list[int]) -> bool:
    """Are there enough rows before, between and after some rows?"""
    rows = np.unique(row)
    ends = sorted([int(rows[0]), int(rows[-1]) + 1, *firsts])
    return all(np.sum((rows >= a) & (rows < b)) >= _FEWEST for a, b in pairwise(ends))


def _beyond_chance(
    J: FloatArray,
    motions: list[FloatArray],
    residual: FloatArray,
    row: IntArray,
    steps: list[_Step],
    before: float,
) -> bool:
    """Does the last of the steps explain more than chance could, anywhere in the rows?"""
    last = steps[-1]
    numbers = 6 * len(last.firsts)
    freedom = _numbers(row) - J.shape[1] - 6 * sum(len(step.firsts) for step in steps)
    if freedom < 6:
        return False
    F = (before - last.left) / numbers / (last.left / freedom)
    tried = len(motions) * float(len(np.unique(row))) ** len(last.firsts)
    # Far out, F with finite freedom is likelier than with infinite: what this rules out, the other would too.
    if gamma_tail(numbers / 2, numbers * max(F, 0.0) / 2) * tried > _CHANCE:
        return False
    from scipy import special  # takes longer to import than a fit, and few files come so far

    return bool(special.fdtrc(numbers, freedom, max(F, 0.0)) * tried <= _CHANCE)


def _numbers(row: IntArray) -> int:
    """Independent numbers: a row has six at most, as all corners of a picture share the error of its posture."""
    return int(np.sum(np.minimum(np.unique(row, return_counts=True)[1], _POSTURE)))


def _left(J: FloatArray, residual: FloatArray, row: IntArray) -> float:
    return huber_fit(J, residual, row)[0]


def huber_fit(J: FloatArray, residual: FloatArray, row: IntArray) -> tuple[float, FloatArray]:
    """The Huber cost in squares at unit noise that a fit of the columns J leaves, and its parameters.

    A row counts with its square up to some ten deviations and linearly beyond, so that neither a gross point nor a
    shifted part decides by its size alone.
    """
    weight = np.ones(len(residual))
    found: FloatArray = np.zeros(J.shape[1])
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)
        found = np.asarray(np.linalg.lstsq(J * root[:, np.newaxis], residual * root, rcond=_RANK)[0], dtype=np.float64)
        left = residual - J @ found
        weight = huber_weights(left, row)
    return float(np.sum(weight * left**2)), found
