# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The rich model: a fit with so many additional blocks that only noise remains, whatever is missing.

As many named and unnamed blocks as RICH_MODEL_SHARE and RICH_MODEL_COLUMNS allow, linear at the fit (Baarda 1968, with
the alternatives themselves as the model).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.columns import unit_columns
from fastcal.diagnosis import rules
from fastcal.diagnosis.blocks import Blocks, Columns, blocks, columns_at
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.generic import Generic
from fastcal.diagnosis.hypothesis import Hypothesis
from fastcal.diagnosis.noise_scales import with_own_scales
from fastcal.diagnosis.problem import Noise, Problem
from fastcal.diagnosis.robust_rows import RichFit, without_outliers
from fastcal.diagnosis.slow_motion import SlowMotion, is_in_time

# Gain of BIC that each block must bring that enters the rich model first (odds of 1 : 22 000).
CLEAR_BLOCK_BIC = 20.0

# Columns of the rich model at most, as many as a thousand numbers have: more cost time and show no more.
RICH_MODEL_COLUMNS = 350
# Blocks that enter the rich model first at most: each costs a fit, and the others enter together.
MAX_CLEAR_BLOCKS = 12
# Rounds of the noise of one kind of observation beside another's: where one is far finer than it was taken for, each
# brings it half way.
SCALE_ROUNDS = 12
_NONE = np.zeros(0, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class RichModel:
    """A fit, the blocks beside it, and what both leave.

    Attributes:
        fit: Where it is linear.
        offered: Columns of all blocks at the fit; `tested` how much each explains.
        columns: (m, p) unit columns of the model.
        slow: Motions in time that it holds as well.
        left: What it leaves.
    """

    fit: Fit
    offered: Columns
    tested: Blocks
    columns: FloatArray
    slow: Sequence[SlowMotion]
    left: RichFit

    @classmethod
    def of(cls, at: Fit, begun: IndexArray | None = None, slow: Sequence[SlowMotion] = ()) -> RichModel:
        """The rich model at a fit; `begun` as in `without_outliers`."""
        offered = columns_at(at)
        tested = blocks(at, offered)
        X = _beside(slow, _rich_columns(tested, offered), at, offered)
        return cls(at, offered, tested, X, slow, without_outliers(X, *at.whitened[1:], begun))

    @property
    def problem(self) -> Problem:
        """Of the fit."""
        return self.fit.problem

    @property
    def noise(self) -> Noise:
        """That it is whitened with."""
        return self.problem.noise

    @property
    def at_rest(self) -> FloatArray:
        """(m, p') unit columns of a rich model in which neither base nor tool moves with time."""
        blocks: list[Hypothesis | Generic] = [*self.tested.names, *self.tested.generics]
        if not any(map(is_in_time, blocks)):
            return self.columns
        return _rich_columns(self.tested, self.offered, at_rest=True)

    def with_motions(self, slow: Sequence[SlowMotion]) -> RichModel:
        """With motions in time."""
        X = _beside(slow, self.columns, self.fit, self.offered)
        return replace(self, columns=X, slow=slow, left=without_outliers(X, *self.fit.whitened[1:], self.left.wrong))

    def again(self, noise: Noise) -> RichModel:
        """With other noise, at a fit to what is not grossly wrong: the model is linear, and centimetres bend it."""
        used = self.problem.used.copy()
        used[self.problem.rows[self.left.gross]] = False
        at = fit(self.problem.with_noise(noise).with_rows(used), self.fit.added, self.fit)
        return RichModel.of(at.on_every_row, self.left.wrong, self.slow)

    @property
    def without_gross(self) -> RichModel:
        """At a fit that holds no row which is grossly wrong beside it."""
        out, gone = self, _NONE
        for _ in range(rules.MAX_REFITS):
            if np.isin(out.left.gross, gone).all():
                break
            gone, out = np.union1d(gone, out.left.gross), out.again(out.noise)
        return out

    @property
    def by_kind(self) -> RichModel:
        """With a scale for each kind of observation that has noise of its own."""
        out = self
        for _ in range(SCALE_ROUNDS):
            noise = with_own_scales(out.fit, out.left)
            if noise is out.noise:
                break
            out = out.again(noise)
        return out


def _beside(slow: Sequence[SlowMotion], X: FloatArray, at: Fit, offered: Columns) -> FloatArray:
    """The columns X with those of the motions."""
    if not slow:
        return X
    row = at.whitened[2]
    return unit_columns(X, *(motion.columns(offered.frames, at.problem, row) for motion in slow))


def _rich_columns(tested: Blocks, offered: Columns, *, at_rest: bool = False) -> FloatArray:
    """Unit columns of the parameters and as many blocks as are allowed, those that are clear first.

    `at_rest`: without those that let base or tool move with time, which `slow_motions` looks for itself.
    """
    ranks = np.asarray(tested.tests.scores.rank)
    in_time = [*map(is_in_time, tested.names), *map(is_in_time, tested.generics)]
    allowed = np.flatnonzero(~(at_rest & np.array(in_time)))
    budget = min(rules.RICH_MODEL_SHARE * tested.at.freedom, RICH_MODEL_COLUMNS)
    columns = [tested.at.whitened[0]]
    for index in dict.fromkeys([*_clear(tested, allowed), *_order(tested)]):
        if index in allowed and 0 < ranks[index] <= budget:
            columns.append(offered.of(index))
            budget -= ranks[index]
    return unit_columns(*columns)


def _clear(blocks: Blocks, among: IndexArray | None = None) -> list[int]:
    """Blocks in the order in which each explains most for its functions beyond those before it, while that is clear.

    They come first: a missing effect must not pass for noise because the model was full before its turn. `among`: of
    these blocks only.
    """
    among = np.arange(len(blocks.sizes)) if among is None else among
    added: list[int] = []
    while len(added) < MAX_CLEAR_BLOCKS:
        left = blocks.tests.given(added)
        worth = blocks.worth(np.asarray(left.statistic)[among], np.asarray(left.rank)[among], among)
        best = int(np.argmax(worth))
        if worth[best] < CLEAR_BLOCK_BIC:
            break
        added.append(int(among[best]))
    return added


def _order(blocks: Blocks) -> list[int]:
    """Names without their variants, curves of one variable, then the rest."""
    seen: set[tuple[Any, ...]] = set()
    first: list[int] = []
    later: list[int] = []
    for i, name in enumerate(blocks.names):
        (later if name.cause in seen else first).append(i)
        seen.add(name.cause)
    single = [blocks.count + i for i, g in enumerate(blocks.generics) if len(g.curves.depends_on) != 2]
    pairs = [blocks.count + i for i, g in enumerate(blocks.generics) if len(g.curves.depends_on) == 2]
    return [*first, *single, *pairs, *later]
