# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do the blocks of a surrogate predict what was left out of their fit?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.parallel import each
from fastcal.calibration.repeatability import place_groups
from fastcal.measurements.splits import deal
from fastcal.surrogate.blocks import Block, choose_blocks
from fastcal.surrogate.candidates import Candidate
from fastcal.surrogate.evidence import held_out_squares
from fastcal.surrogate.problem import FOLDS, ResidualProblem
from fastcal.surrogate.thresholds import Thresholds

_FEW_ROWS = 100  # where the choice of blocks itself is part of what poses left out must confirm
_SHARED = 0.8  # distinct places over rows, from which on poses are as good as places


def at_other_poses(
    problem: ResidualProblem, blocks: list[Block], considered: Sequence[Candidate], thresholds: Thresholds
) -> float:
    """RMS of poses left out with the blocks over that without.

    Few rows choose blocks by chance: there the choice among `considered` is made again without each fold.
    """
    few = len(problem.data) < _FEW_ROWS
    return _without_folds(problem, problem.fold, blocks, considered if few else [], thresholds)


def at_other_inputs(
    problem: ResidualProblem,
    blocks: list[Block],
    block: Block,
    considered: Sequence[Candidate],
    thresholds: Thresholds,
) -> float:
    """The same of all rows at values of a block's inputs: poses of a grid share them, and what is wrong there.

    0 where the inputs have few values, such as a direction of approach, or hardly any that rows share: poses left out
    test these.
    """
    values = problem.inputs(block.candidate.inputs)
    place = place_groups(values, thresholds.bins)
    if not 2 * FOLDS <= place.max() < _SHARED * len(place):
        return 0.0
    fold = deal(int(place.max()) + 1, FOLDS, np.random.default_rng(0))[place]
    few = len(np.unique(values, axis=0)) < _FEW_ROWS
    fold_of_number = np.where(problem.row >= 0, fold[problem.row], -1)
    return _without_folds(problem, fold_of_number, blocks, considered if few else [], thresholds)


def _without_folds(
    problem: ResidualProblem,
    fold: NDArray[np.int64],
    blocks: list[Block],
    considered: Sequence[Candidate],
    thresholds: Thresholds,
) -> float:
    """RMS of what is left out with the blocks over that without; those among `considered` are chosen for each fold."""

    def squares_of(k: int) -> tuple[float, float]:
        held = fold == k
        if not held.any():
            return 0.0, 0.0
        own = blocks
        if considered:
            as_many = replace(thresholds, evidence=0.0, blocks=len(blocks))
            again = choose_blocks(problem.without(held), considered, as_many)
            own = [block.over(problem) for block in again]
        C = np.hstack([block.columns for block in own]) if own else np.zeros((len(problem.r), 0))
        return held_out_squares(problem.A, C, problem.r, held)

    squares = np.sum([(0.0, 0.0), *each(squares_of, range(int(fold.max()) + 1))], axis=0)
    return float(np.sqrt(squares[1] / squares[0])) if squares[0] > 0 else 1.0
