# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Blocks of a surrogate: the features of a candidate as columns, chosen by their evidence beside the geometry."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.parallel import each
from fastcal.surrogate.candidates import Candidate, directions
from fastcal.surrogate.evidence import Beside, Weighed
from fastcal.surrogate.features import Features
from fastcal.surrogate.problem import ResidualProblem
from fastcal.surrogate.thresholds import Thresholds

_WIDTHS = {1: (0.07, 0.15, 0.35, 0.8), 2: (0.25, 0.6), 3: (0.4, 0.8)}  # of an input's range, by the number of inputs
_NODES = {1: 24, 2: 40, 3: 60}
_FEWER = 12  # nodes of a place that moves in six directions
_PROMISING = 40  # candidates that are weighed again beside the first: what has no evidence alone has none beside it
_NO_EVIDENCE = 1e-9  # below this the first block is nothing at all


@dataclass(frozen=True, eq=False)
class Block:
    """A candidate as a Gaussian process over the rows of a problem.

    Attributes:
        candidate: The place and its inputs.
        kernel: The features of the inputs.
        low, high: (inputs,) ranges of the inputs over the rows that it was chosen on.
        scale: (directions,) a unit of each direction [rad, m] that has a mean square of 1 in noise.
        columns: (m, features x directions), times the size.
        size: Most likely standard deviation of the process in units of `scale`.
        evidence: Twice the log of a ratio of likelihoods, with the block over without.
    """

    candidate: Candidate
    kernel: Features
    low: FloatArray
    high: FloatArray
    scale: FloatArray
    columns: FloatArray
    size: float = 1.0
    evidence: float = 0.0

    def over(self, problem: ResidualProblem) -> Block:
        """The same process over the rows of another problem."""
        phi = self.kernel(problem.inputs(self.candidate.inputs))
        return replace(self, columns=self.size * _columns(problem, self.candidate, phi, self.scale))


def choose_blocks(problem: ResidualProblem, considered: Sequence[Candidate], thresholds: Thresholds) -> list[Block]:
    """Blocks by evidence, each beside those before it."""
    problem.find(name for candidate in considered for name in candidate.inputs)
    blocks: list[Block] = []
    A, r = problem.A, problem.r
    while len(blocks) < thresholds.blocks:
        chosen = {block.candidate for block in blocks}
        others = [candidate for candidate in considered if candidate not in chosen]
        best, evidence = _most_evident(problem, Beside(A, r), len(r) - len(problem.r), others)
        if best is None or best.evidence < (thresholds.further_evidence if blocks else _NO_EVIDENCE):
            break
        best = replace(best, columns=best.size * best.columns)
        blocks.append(best)
        if len(blocks) == 1 and best.evidence < thresholds.evidence:
            break  # nothing is added, whatever lies beside it
        considered = sorted(evidence, key=lambda candidate: -evidence[candidate])[:_PROMISING]
        # What was chosen is part of the model from here on, its weights ~ N(0, I).
        count = best.columns.shape[1]
        A = np.block([[A, _padded(best.columns, len(r))], [np.zeros((count, A.shape[1])), np.eye(count)]])
        r = np.append(r, np.zeros(count))
    return blocks


def _most_evident(
    problem: ResidualProblem, beside: Beside, padding: int, considered: Sequence[Candidate]
) -> tuple[Block | None, dict[Candidate, float]]:
    """The block with the most evidence, None where none has any, and the largest evidence of each candidate.

    `beside` has `padding` rows more than the problem: the priors of blocks chosen before.
    """

    def weighed(candidate: Candidate) -> list[Weighed]:
        blocks = _candidate_blocks(problem, candidate)
        return [beside.weigh(_padded(block.columns, len(problem.r) + padding)) for block in blocks]

    alike: dict[tuple[str, ...], list[Candidate]] = {}  # with the same features, which one thread makes for all
    for candidate in considered:
        alike.setdefault(candidate.inputs, []).append(candidate)
    of_group = each(lambda group: {candidate: weighed(candidate) for candidate in group}, alike.values())
    every = {candidate: of for group in of_group for candidate, of in group.items()}
    found = {candidate: every[candidate] for candidate in considered if every[candidate]}
    evidence = {candidate: max(w.evidence for w in of) for candidate, of in found.items()}
    if not any(evidence.values()):
        return None, evidence
    chosen = max(evidence, key=evidence.__getitem__)
    k, best = max(enumerate(found[chosen]), key=lambda item: item[1].evidence)
    block = next(islice(_candidate_blocks(problem, chosen), k, None))
    return replace(block, size=best.size, evidence=best.evidence), evidence


def _candidate_blocks(problem: ResidualProblem, candidate: Candidate) -> Iterator[Block]:
    """A candidate with each length scale, columns of mean square 1; none where it moves nothing that was measured."""
    x = problem.inputs(candidate.inputs)
    low, high = x.min(axis=0), x.max(axis=0)
    size = np.sqrt((problem.place[candidate.owner] ** 2).mean(axis=0))
    if not (high > low).all() or not size.any():
        return
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 1e-9 * size.max())
    sign = np.array([name.startswith("approach") for name in candidate.inputs])
    most = _NODES[len(candidate.inputs)] if directions(candidate.owner) < 6 else _FEWER
    for share in _WIDTHS[len(candidate.inputs)]:
        kernel, phi = problem.features(candidate.inputs, np.where(sign, 1.0, share * (high - low)), most)
        yield Block(candidate, kernel, low, high, scale, _columns(problem, candidate, phi, scale))


def _columns(problem: ResidualProblem, candidate: Candidate, phi: FloatArray, scale: FloatArray) -> FloatArray:
    """(m, features x directions) what a unit of each feature, phi (N, features), does; 0 in the rows of priors."""
    motion = problem.place[candidate.owner] * scale
    by_row = np.take(phi, problem.row, axis=0)
    return (by_row[:, :, np.newaxis] * motion[:, np.newaxis, :]).reshape(len(motion), -1)


def _padded(columns: FloatArray, rows: int) -> FloatArray:
    """The columns with rows of zeros below, `rows` in all."""
    if len(columns) == rows:
        return columns
    return np.vstack([columns, np.zeros((rows - len(columns), columns.shape[1]))])
