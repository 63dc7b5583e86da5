# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Motions that look like correlated noise: a base or a target that drifts, or is knocked and put back.

Rows in succession err alike then as well, and noise with a memory (`memory.py`) would take it in. It says less about
the rows: they are correlated, not which way they move. So each motion in time is tested beside that noise, in the
rows that it whitens, where noise with a memory leaves nothing: polynomials of time, a step, a block of rows between two
moments, of base and of tool. What is decisive there is no noise. A tool that slipped turns with the hand: in the frame
of the base successive rows need not be correlated at all, so that is no condition.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.change_point import gains
from fastcal.calibration.columns import unit_columns
from fastcal.calibration.pose_folds import measuring_place
from fastcal.calibration.tall import taken
from fastcal.diagnosis import rules
from fastcal.diagnosis.decorrelation import decorrelated
from fastcal.diagnosis.fits import Fit
from fastcal.diagnosis.generic import Generic, orthonormal, polynomials
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.memory import log_determinant, memory, remembering, without_memory
from fastcal.diagnosis.problem import Problem
from fastcal.diagnosis.projection import score_tests
from fastcal.diagnosis.robust_rows import ridged_basis, ridged_residual

Frames = dict[str, FloatArray]

_OWNERS = ("base", "tool")
_MOMENTS = 48  # that ends of a block are looked for at before every row near the best ones is
_MOST = 4  # motions of one data set
_ALL = 1.0 - 1e-12  # of a square
_NONE = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class SlowMotion:
    """A frame that moves with time.

    Attributes:
        owner: "base" or "tool".
        curves: (N, k) over all rows of the data: what each of its motions follows.
        block: Rows of the data that lie off together, between others that do not; none: a drift or a step.
        begins: The first row behind a step; None: a drift or a block.
    """

    owner: str
    curves: FloatArray
    block: IndexArray
    begins: int | None = None

    def columns(self, frames: Frames, problem: Problem, row: IndexArray) -> FloatArray:
        """(m, k') for numbers of the fitted rows `row` (m,), -1 a prior's; whitened as the problem has it."""
        measured = row >= 0
        curves, frame = self.curves[problem.rows[row[measured]]], frames[self.owner]
        moved = (frame[:, :, np.newaxis] * curves[:, np.newaxis]).reshape(len(frame), -1)
        out = np.zeros((len(row), moved.shape[1]))
        out[measured] = decorrelated(problem, moved, row[measured])
        return out


def is_in_time(block: Hypothesis | Generic) -> bool:
    """Does it let base or tool move with time?"""
    on = block.traits.depends_on if isinstance(block, Hypothesis) else block.curves.depends_on
    return block.owner in _OWNERS and "time_s" in on


@dataclass(frozen=True, eq=False)
class SlowMotions:
    """What is no noise with a memory, and the noise that remains.

    Attributes:
        found: That models can have, each likelier than noise by SLOW_MOTION_BIC.
        rho: The memory of the noise beside them.
        untimed: Base or tool where one drifts that no model can have, since no row has a time: it stays in the noise.
            What jumped is no drift: models have it by its row.
        share: Of the misfit, what that one explains.
    """

    found: list[SlowMotion]
    rho: float
    untimed: str | None = None
    share: float = 0.0

    @property
    def drifts(self) -> bool:
        """Is one of them no block of rows that could be left out?"""
        return any(len(motion.block) == 0 for motion in self.found)


def slow_motions(at: Fit, X: FloatArray, wrong: IndexArray, frames: Frames) -> SlowMotions:
    """Motions that noise with a memory would hide.

    A block comes alone: without its rows all of this is asked again.

    Args:
        at: A fit, whitened without a memory.
        X: (m, p) columns of a rich model at it in which nothing `is_in_time`.
        wrong: Rows that do not fit.
        frames: As `Columns` have them.
    """
    found: list[SlowMotion] = []
    rows = _Rows.of(at, X, wrong, frames)
    while len(found) < _MOST:
        likeliest = rows.with_likeliest()
        if likeliest is None or likeliest[0] < rules.SLOW_MOTION_BIC:
            break
        _worth, motion, after = likeliest
        if at.problem.data.time is None and not len(motion.block) and motion.begins is None:
            share = rows.explained(after) / max(at.remaining - at.freedom, 1.0)
            return SlowMotions(found, rows.rho, motion.owner, min(share, 1.0))
        found.append(motion)
        rows = after
        if len(motion.block):
            break
    return SlowMotions(found, rows.rho)


@dataclass(frozen=True, eq=False)
class _Rows:
    """The rows that a linear model fits, and the noise with a memory that it leaves: X (m, p), r and row (m,).

    `begun` are the degrees of freedom that the model left before any motion: motions are weighed in the rows beyond it,
    else a model that takes nearly all of them would make any motion likely.
    """

    problem: Problem
    frames: Frames
    X: FloatArray
    r: FloatArray
    row: IndexArray
    begun: int

    @staticmethod
    def of(at: Fit, X: FloatArray, wrong: IndexArray, frames: Frames) -> _Rows:
        """Without the rows that are wrong; the arguments as of `slow_motions`."""
        _A, r, row = at.whitened
        held = ~np.isin(row, wrong)
        left = np.delete(at.problem.rows, wrong)
        own = np.where(row < 0, -1, np.searchsorted(left, at.problem.rows[row]))
        used = np.zeros_like(at.problem.used)
        used[left] = True
        kept = {owner: frames[owner][held[row >= 0]] for owner in _OWNERS}
        begun = max(int(held.sum()) - X.shape[1], 1)
        return _Rows(at.problem.with_rows(used), kept, taken(X, np.flatnonzero(held)), r[held], own[held], begun)

    @property
    def may_take(self) -> float:
        """Columns that further motions may have: more leave too little to tell them from noise."""
        taken_columns = int(self.X.shape[1]) - (len(self.r) - self.begun)
        return rules.RICH_MODEL_SHARE * self.begun - taken_columns

    @cached_property
    def rho(self) -> float:
        """The memory."""
        return memory(self.problem, self.X, self.r, self.row, _NONE)

    def misfit(self, rho: float) -> float:
        """-2 log likelihood with noise of this memory, but for a constant."""
        if rho not in self._misfits:
            self._misfits[rho] = self._misfit(rho)
        return self._misfits[rho]

    @cached_property
    def _misfits(self) -> dict[float, float]:
        return {}

    def _misfit(self, rho: float) -> float:
        slow, measured = remembering(self.problem, rho), self.row >= 0

        def white(values: FloatArray) -> FloatArray:
            out = values.copy()
            out[measured] = without_memory(slow, values[measured], self.row[measured])
            return out

        left = ridged_residual(unit_columns(white(self.X)), white(self.r))
        return self.begun * float(np.log(left @ left)) + log_determinant(slow, self.row[measured])

    def worth(self, after: _Rows) -> float:
        """By how much a further motion lowers -2 log likelihood, each with the better one of the two memories.

        That which is found is the one that explains the correlation, and not the likeliest beside many columns.
        """
        both = {self.rho, after.rho}
        return min(map(self.misfit, both)) - min(map(after.misfit, both))

    @cached_property
    def at_rest(self) -> tuple[FloatArray, FloatArray]:
        """An orthonormal basis of the model, and what it leaves; white noise."""
        Q = ridged_basis(unit_columns(self.X))
        return Q, self.r - Q @ (Q.T @ self.r)

    def explained(self, after: _Rows) -> float:
        """By how much the sum of squares is less with more columns; white noise."""
        return float(np.sum(self.at_rest[1] ** 2) - np.sum(after.at_rest[1] ** 2))

    def with_likeliest(self) -> tuple[float, SlowMotion, _Rows] | None:
        """The motion that is likeliest beside the memory that it leaves, by how much BIC falls, and the rows with it.

        None where the rows are too few for any.

        Of blocks and of all else the likeliest beside white noise is tried. A block has to be decisively better and to
        leave no strong memory: batches that each lie off by their own make some block likely as well.
        """
        every = [(one, one[0].columns(self.frames, self.problem, self.row)) for one in _motions(self)]
        tried, columns = [], list[FloatArray]()
        for one, own in every:
            if own.shape[1] <= self.may_take:
                tried.append(one)
                columns.append(own)
        if not tried:
            return None
        Q, r = self.at_rest
        scores = score_tests(Q, np.hstack(columns), r, [c.shape[1] for c in columns]).scores
        share = np.clip(np.asarray(scores.statistic) / float(r @ r), 0.0, _ALL)
        paid = (np.asarray(scores.rank) + np.array([moments for _, moments in tried])) * np.log(self.begun)
        guess = -self.begun * np.log1p(-share) - paid
        is_block = np.array([len(motion.block) > 0 for motion, _ in tried])
        best: list[tuple[float, SlowMotion, _Rows]] = []
        for among in (np.flatnonzero(~is_block), np.flatnonzero(is_block)):
            if len(among):
                k = int(among[np.argmax(guess[among])])
                after = replace(self, X=np.hstack([self.X, columns[k]]))
                worth = self.worth(after) - float(paid[k])
                if is_block[k]:
                    worth = worth - rules.DECISIVE_BIC if after.rho < rules.STRONG_MEMORY else -np.inf
                best.append((worth, tried[k][0], after))
        return max(best, key=lambda found: found[0])


def _motions(rows: _Rows) -> Iterator[tuple[SlowMotion, int]]:
    """Motions to be tested, and the moments that each was searched at."""
    data, place = rows.problem.data, measuring_place(rows.problem.data)
    Q, left = rows.at_rest
    own = place[rows.problem.rows]
    turn = np.argsort(own, kind="stable")
    rank = np.empty(len(own), dtype=np.intp)
    rank[turn] = np.arange(len(own))
    order = np.flatnonzero(rows.row >= 0)
    order = order[np.argsort(rank[rows.row[order]], kind="stable")]
    # What moves base or instrument moves successive rows alike.
    for owner in _OWNERS if rows.rho > 0 else ("tool",):
        for degree in range(1, rules.TIME_DEGREE + 1):
            slow = polynomials(place.astype(float) if data.time is None else data.time, degree)
            yield SlowMotion(owner, orthonormal(slow), _NONE), 0
        blocks = _Blocks(Q[order], rows.frames[owner][order], left[order], rank[rows.row[order]], len(own))
        for first, end in blocks.best():
            # Wrong rows beside the block are of it: what is far off stands among the first on that list.
            inside = place > own[turn[first - 1]]
            inside &= place < own[turn[end]] if end < len(own) else True
            block = np.flatnonzero(inside & data.measured) if end < len(own) else _NONE
            begins = int(rows.problem.rows[turn[first]]) if end == len(own) else None
            yield SlowMotion(owner, inside[:, np.newaxis].astype(float), block, begins), 1 + (end < len(own))


class _Blocks:
    """What a motion of the rows of places first ... end - 1 explains beside a model, of all such blocks.

    As `change_point` does it, with sums over the rows: |r|^2 falls by b^T A^-1 b.
    """

    def __init__(self, Q: FloatArray, F: FloatArray, clean: FloatArray, place: IndexArray, count: int) -> None:
        """Q (m, p) is an orthonormal basis of the model, F (m, k) the motion, by ascending `place` (m,) of `count`."""
        self._Q, self._F, self._clean, self._place, self._count = Q, F, clean, place, count

    def best(self) -> Iterator[tuple[int, int]]:
        """The best block between other rows, of half of the rows at most, and the best step: (first, end)."""
        count, least = self._count, rules.MIN_ROWS_BESIDE_STEP
        if count < 3 * least:
            return
        inner = np.unique(np.linspace(least, count - least, _MOMENTS).round().astype(np.intp))
        for ends in (inner, np.array([count])):
            first, end = self._best(inner, ends)
            step = -(-count // _MOMENTS)
            near = [inner, ends] if len(inner) > count - 2 * least else [_near(first, step), _near(end, step)]
            near = [np.intersect1d(moments, np.arange(least, count - least + 1)) for moments in near]
            yield self._best(near[0], near[1] if end < count else ends)

    def _best(self, firsts: IndexArray, ends: IndexArray) -> tuple[int, int]:
        """The best of these moments; of all rows but the first and last ones."""
        moments = np.union1d(firsts, ends)
        squares, held, along = self._sums(moments)
        chosen, most = (int(firsts[0]), int(ends[-1])), -1.0
        for first in firsts:
            i = int(np.searchsorted(moments, first))
            allowed = (ends >= first + rules.MIN_ROWS_BESIDE_STEP) & (
                (ends == self._count) | (ends - first <= self._count // 2)
            )
            if not allowed.any():
                continue
            j = np.searchsorted(moments, ends[allowed])
            gain = gains(squares[j] - squares[i], held[j] - held[i], along[j] - along[i])
            k = int(np.argmax(gain))
            if gain[k] > most:
                most, chosen = float(gain[k]), (int(first), int(ends[allowed][k]))
        return chosen

    def _sums(self, moments: IndexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """F^T F, F^T Q and F^T r of the rows before each moment."""
        cuts = [int(k) for k in np.searchsorted(self._place, [0, *moments.tolist()])]
        parts = [slice(cuts[k], cuts[k + 1]) for k in range(len(moments))]

        def before(other: FloatArray) -> FloatArray:
            return np.cumsum([self._F[part].T @ other[part] for part in parts], axis=0)

        return before(self._F), before(self._Q), before(self._clean)


def _near(moment: int, step: int) -> IndexArray:
    return np.arange(moment - step, moment + step + 1)
