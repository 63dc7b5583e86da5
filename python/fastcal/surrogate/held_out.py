# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Do the blocks of a surrogate predict what was left out of their fit?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.calibration.parallel import each
from fastcal.calibration.pose_folds import measuring_place
from fastcal.calibration.repeatability import place_groups, pose_groups
from fastcal.measurements.splits import deal
from fastcal.surrogate.blocks import Block, choose_blocks
from fastcal.surrogate.candidates import Candidate
from fastcal.surrogate.evidence import held_out_squares
from fastcal.surrogate.problem import FOLDS, ResidualProblem
from fastcal.surrogate.thresholds import Thresholds

_FEW_ROWS = 100  # where the choice of blocks itself is part of what poses left out must confirm
_CHOSEN_AGAIN = 400  # rows up to which that costs little for the one surrogate that has passed all else
_SHARED = 0.8  # distinct places over rows, from which on poses are as good as places


def at_other_poses(
    problem: ResidualProblem, blocks: list[Block], considered: Sequence[Candidate], thresholds: Thresholds
) -> float:
    """RMS of poses left out with the blocks over that without.

    Few rows choose blocks by chance: there the choice among `considered` is made again without each fold.
    """
    few = len(problem.data) < _FEW_ROWS
    return _ratio(*_left_out(problem, problem.fold, blocks, considered if few else [], thresholds))


def lead_at_other_poses(
    problem: ResidualProblem, blocks: list[Block], considered: Sequence[Candidate], thresholds: Thresholds
) -> float:
    """Standard errors by which the sum of squares of poses left out is less with blocks than without.

    As many as `blocks`, chosen among `considered` without each fold: a choice that saw the poses left out takes what
    is alike in them by chance for a curve.
    """
    again = considered if len(problem.data) <= _CHOSEN_AGAIN else []
    before, after = _left_out(problem, problem.fold, blocks, again, thresholds)
    return _lead(problem, before - after, problem.row >= 0)


def less_by_row(
    problem: ResidualProblem, blocks: list[Block], fold: NDArray[np.integer], thresholds: Thresholds
) -> FloatArray:
    """(N,) what the square of each row, left out with its fold (N,), is less by with blocks, without weights."""
    measured = problem.row >= 0
    of_number = np.where(measured, fold[problem.row], -1)
    before, after = _left_out(problem, of_number, blocks, [], thresholds)
    less = (before - after)[measured] / problem.weight[measured] ** 2
    return np.asarray(np.bincount(problem.row[measured], less, len(problem.data)), dtype=np.float64)


def lead_at_last_rows(problem: ResidualProblem, blocks: list[Block], thresholds: Thresholds) -> float:
    """Standard errors by which the last of the blocks lessens the sum of squares of the last part of measuring.

    Those are poses later than the ones that a block is fitted to; the blocks before it are there in both.
    """
    part = measuring_place(problem.data) * FOLDS // len(problem.data)
    last = np.where(problem.row >= 0, part[problem.row], -1) == FOLDS - 1
    fold = np.where(last, 0, -1)
    (_, without), (_, after) = (_left_out(problem, fold, some, [], thresholds) for some in (blocks[:-1], blocks))
    return _lead(problem, without - after, last)


def _lead(problem: ResidualProblem, less: FloatArray, among: NDArray[np.bool_]) -> float:
    """The sum of what squares (m,) are less by, of some numbers, over its standard error; poses are independent."""
    pose = np.unique(pose_groups(problem.data)[problem.row[among]], return_inverse=True)[1]
    by_pose = np.bincount(pose, less[among])
    error = float(np.std(by_pose, ddof=1)) * np.sqrt(len(by_pose)) if len(by_pose) > 1 else 0.0
    return float(by_pose.sum()) / error if error > 0 else 0.0


def at_other_inputs(
    problem: ResidualProblem,
    blocks: list[Block],
    block: Block,
    considered: Sequence[Candidate],
    thresholds: Thresholds,
) -> float:
    """The RMS of all rows at values of a block's inputs: poses of a grid share them, and what is wrong there.

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
    return _ratio(*_left_out(problem, fold_of_number, blocks, considered if few else [], thresholds))


def _left_out(
    problem: ResidualProblem,
    fold: NDArray[np.int64],
    blocks: list[Block],
    considered: Sequence[Candidate],
    thresholds: Thresholds,
) -> tuple[FloatArray, FloatArray]:
    """(m,) squares of what is left out of each fold, without and with blocks; 0 in the rows of priors.

    Where any are `considered`, as many as `blocks` are chosen among them for each fold.
    """

    def squares_of(k: int) -> tuple[FloatArray, FloatArray]:
        held = fold == k
        own = blocks
        if considered:
            as_many = replace(thresholds, evidence=0.0, blocks=len(blocks))
            again = choose_blocks(problem.without(held), considered, as_many)
            own = [block.over(problem) for block in again]
        C = np.hstack([block.columns for block in own]) if own else np.zeros((len(problem.r), 0))
        return held_out_squares(problem.A, C, problem.r, held)

    before, after = np.zeros((2, len(problem.r)))
    folds = [k for k in range(int(fold.max()) + 1) if (fold == k).any()]
    for k, squares in zip(folds, each(squares_of, folds), strict=True):
        before[fold == k], after[fold == k] = squares
    return before, after


def _ratio(before: FloatArray, after: FloatArray) -> float:
    """Of the RMS; 1 where nothing was left out."""
    whole = float(before.sum())
    return float(np.sqrt(after.sum() / whole)) if whole > 0 else 1.0
