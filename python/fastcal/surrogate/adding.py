# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a model leaves something without a name, a smooth shrunk function of the place is added to it.

Each block (a place and what it may depend on) is a Gaussian process beside the geometry, one amplitude by marginal
likelihood; the block with the most evidence first, the next beside it. A block must have evidence, and the whole must
predict poses that were left out, also where blocks are chosen without them: what is added where nothing is missing does
harm on other poses. The whole model must leave less than the one before, recomputed and not from the linearization. The
function comes with the shift of the geometry that makes both together orthogonal to the geometry (`surrogate.cpp`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray, IndexArray
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot, Spec
from fastcal.surrogate.blocks import Block, choose_blocks
from fastcal.surrogate.candidates import SLOW, Candidate, candidates
from fastcal.surrogate.entries import curve, effect_entries
from fastcal.surrogate.held_out import (
    at_other_inputs,
    at_other_poses,
    lead_at_last_rows,
    lead_at_other_poses,
    less_by_row,
)
from fastcal.surrogate.problem import ResidualProblem, misfit, residual_problem
from fastcal.surrogate.thresholds import Thresholds

_ROWS = 1200  # that blocks are chosen on: more add nothing about a smooth curve
_ROWS_FITTED = 6000


@dataclass(frozen=True, eq=False)
class AddedSurrogate:
    """What `add_surrogate` found.

    Attributes:
        model: With the surrogates in it; the model that was given where `added` is empty.
        added: Names such as "surrogate@joint5".
        owner, depends_on: The place with the most evidence and what it depends on; None and () where none has any.
        share: Of the sum of squares of what was left, what that block explains.
        evidence: Of that block, twice a log ratio of likelihoods.
        held_out: RMS of poses left out with everything that was tried over that without; 1 where nothing was, or where
            blocks that are chosen without these poses do not lead. Beside a first block without enough evidence,
            nothing else is tried.
        inputs, curve: (N, inputs) and (N, directions) [rad, m]: the first block's function over the rows.
        unknowns: (U,) of the observations, shifted as the geometry is.
        less: (N,) by how much the square of each row, left out with its fold, is less with what was added [of `noise`,
            squared]; 0 where nothing was.
    """

    model: Robot
    added: tuple[str, ...]
    owner: str | None
    depends_on: tuple[str, ...]
    share: float
    evidence: float
    held_out: float
    inputs: FloatArray
    curve: FloatArray
    unknowns: FloatArray
    less: FloatArray


def add_surrogate(
    model: Robot,
    data: Dataset,
    *,
    noise: tuple[float, float, float],
    thresholds: Thresholds,
    unknowns: FloatArray | None = None,
    exclude: frozenset[str] = frozenset(),
    folds: Sequence[IndexArray] = (),
    threads: int = 1,
) -> AddedSurrogate:
    """Places what a calibrated model leaves and adds a surrogate of it, if evidence and poses left out both agree.

    Args:
        model: As `calibrate` or `diagnose` made it; its parameters stay as they are.
        data: The rows that it was fitted to, without outliers.
        noise: Standard deviation common to all numbers: positions [m], rotations [rad], lengths [m]. A wrong one
            weights kinds of numbers against each other wrongly, and nothing else: their common factor is estimated.
        thresholds: What it must show to be added.
        unknowns: (U,) of the observations: places of anchors, planes ...
        exclude: Places and inputs to leave out, such as "workspace", "time".
        folds: (N,) parts in which rows are left out, for `AddedSurrogate.less`: several ways, of which it is the mean.
        threads: Cores; the result does not depend on it.
    """
    found, is_slow = _added(model, data, noise, thresholds, unknowns, exclude, folds, threads)
    if is_slow:  # what moves otherwise may be added all the same
        still, _ = _added(model, data, noise, thresholds, unknowns, exclude | SLOW, folds, threads)
        return still if still.added else found
    return found


def _added(
    model: Robot,
    data: Dataset,
    noise: tuple[float, float, float],
    thresholds: Thresholds,
    unknowns: FloatArray | None,
    exclude: frozenset[str],
    folds: Sequence[IndexArray],
    threads: int,
) -> tuple[AddedSurrogate, bool]:
    """`add_surrogate`, and whether nothing is added since what was found first changes with time or temperature."""
    considered = [c for c in candidates(model, data, threads) if not exclude & {c.owner, *c.inputs}]
    problem, blocks = _chosen(model, data, noise, thresholds, unknowns, considered, threads)
    places = np.zeros(0) if unknowns is None else np.ravel(unknowns)
    none, no_less = np.zeros((0, 0)), np.zeros(len(data))
    if not blocks:
        return AddedSurrogate(model, (), None, (), 0.0, 0.0, 1.0, none, none, places, no_less), False
    ratios = [at_other_poses(problem, blocks[: k + 1], considered, thresholds) for k in range(len(blocks))]
    blocks = blocks[: ratios.index(min(ratios)) + 1]  # a further block must help poses left out
    blocks, leads_later = _leading_later(problem, blocks, thresholds)
    before = misfit(model, data, noise, places, threads)
    while True:
        entries, share, moved = effect_entries(problem, blocks)
        extended, beside = _with_effects(model, entries), places + moved
        is_less = misfit(extended, data, noise, beside, threads) < before
        if is_less or len(blocks) == 1:
            break
        blocks = blocks[:-1]  # the data leave so much of the geometry open that its shift goes past what is linear
    first = blocks[0]
    ratio = ratios[len(blocks) - 1]
    for block in blocks:
        if ratio < thresholds.held_out:  # one that fails is enough
            ratio = max(ratio, at_other_inputs(problem, blocks, block, considered, thresholds))
    may_be_added = is_less and first.evidence >= thresholds.evidence and ratio < thresholds.held_out
    is_slow = may_be_added and not leads_later
    if is_slow or (may_be_added and lead_at_other_poses(problem, blocks, considered, thresholds) < thresholds.lead):
        may_be_added, ratio = False, 1.0
    found = AddedSurrogate(
        model=model,
        added=(),
        owner=first.candidate.owner,
        depends_on=first.candidate.inputs,
        share=share,
        evidence=first.evidence,
        held_out=ratio,
        inputs=problem.inputs(first.candidate.inputs),
        curve=curve(problem, first, entries[0]),
        unknowns=places,
        less=no_less,
    )
    if not may_be_added:
        return found, is_slow
    names = tuple(f"surrogate@{b.candidate.owner}" for b in blocks)
    rows, less = _some(len(data), len(problem.data)), no_less.copy()
    for fold in folds:
        less[rows] += less_by_row(problem, blocks, fold[rows], thresholds) / len(folds)
    return replace(found, model=extended, added=names, unknowns=beside, less=less), False


def _chosen(
    model: Robot,
    data: Dataset,
    noise: tuple[float, float, float],
    thresholds: Thresholds,
    unknowns: FloatArray | None,
    considered: Sequence[Candidate],
    threads: int,
) -> tuple[ResidualProblem, list[Block]]:
    """Blocks among the `considered`, and the problem with the rows that they are fitted to."""
    few = data.select(_some(len(data), _ROWS))
    owners = list(dict.fromkeys(c.owner for c in considered))
    problem = residual_problem(model, few, noise, unknowns, owners, threads)
    blocks = choose_blocks(problem, considered, thresholds)
    if not blocks or len(data) == len(few):
        return problem, blocks
    rows = data.select(_some(len(data), _ROWS_FITTED))
    owners = list(dict.fromkeys(block.candidate.owner for block in blocks))
    problem = residual_problem(model, rows, noise, unknowns, owners, threads)
    return problem, [block.over(problem) for block in blocks]


def _leading_later(problem: ResidualProblem, blocks: list[Block], thresholds: Thresholds) -> tuple[list[Block], bool]:
    """Blocks before the first that changes with time or temperature without leading on the last rows measured.

    And whether that is not the very first, which is kept as the place. What changes so tells of poses that are
    measured in between; the model is used on those that are measured later.
    """
    for k, block in enumerate(blocks):
        if SLOW.isdisjoint(block.candidate.inputs):
            continue
        if lead_at_last_rows(problem, blocks[: k + 1], thresholds) < thresholds.later:
            return blocks[: max(k, 1)], k > 0
    return blocks, True


def _with_effects(model: Robot, entries: list[Spec]) -> Robot:
    return model.with_(effects=[*model.entries, *entries])


def _some(rows: int, most: int) -> NDArray[np.int64]:
    """Rows spread evenly, `most` of them at most."""
    return np.unique(np.linspace(0, rows - 1, min(rows, most)).round().astype(np.int64))
