# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Where a model leaves something without a name, a smooth shrunk function of the place is added to it.

Each block (a place and what it may depend on) is a Gaussian process beside the geometry, one amplitude by marginal
likelihood; the block with the most evidence first, the next beside it. A block must have evidence, and the whole must
predict poses that were left out: what is added where nothing is missing does harm on other poses. The whole model must
leave less than the one before, recomputed and not from the linearization. The function comes with the shift of the
geometry that makes both together orthogonal to the geometry (`surrogate.cpp`).
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from fastcal.calibration.repeatability import place_groups
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.splits import deal
from fastcal.robot.robot import Robot, Spec
from fastcal.surrogate.candidates import Candidate, candidates, directions
from fastcal.surrogate.evidence import Beside, held_out_squares
from fastcal.surrogate.features import Features
from fastcal.surrogate.problem import FOLDS, RestProblem, misfit, rest_problem

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_WIDTHS = {1: (0.07, 0.15, 0.35, 0.8), 2: (0.25, 0.6), 3: (0.4, 0.8)}  # of an input's range, by the number of inputs
_NODES = {1: 24, 2: 40, 3: 60}
_FEWER = 12  # nodes of a place that moves in six directions
_PROMISING = 40  # candidates that are weighed again beside the first: what has no evidence alone has none beside it
_ROWS = 1200  # that blocks are chosen on: more add nothing about a smooth curve
_ROWS_FITTED = 6000
_FEW_ROWS = 100  # where the choice of blocks itself is part of what poses left out must confirm
_SHARED = 0.8  # distinct places over rows, from which on poses are as good as places
_COMPONENTS = 8  # of the function's uncertainty that a model keeps


@dataclass(frozen=True)
class Gates:
    """What a surrogate must show to be added; the defaults are those of the diagnosis (`fastcal.diagnosis.rules`).

    Attributes:
        evidence: Of the first block, twice the log of a ratio of likelihoods.
        more_evidence: Of a further block.
        held_out: RMS of poses left out with everything that is added over that without.
        blocks: At most.
        bins: Parts of an input's range: rows in the same parts of all inputs are left out together.
    """

    evidence: float = 60.0
    more_evidence: float = 30.0
    held_out: float = 0.95
    blocks: int = 3
    bins: int = 40


@dataclass(frozen=True, eq=False)
class Block:
    """A candidate with its kernel, its features as columns, and what was found of it."""

    candidate: Candidate
    kernel: Features
    low: FloatArray
    high: FloatArray
    scale: FloatArray  # (directions,) a unit of each direction [rad, m] that has a mean square of 1 in noise
    columns: FloatArray  # (m, features x directions), times the size
    size: float
    evidence: float


@dataclass(frozen=True, eq=False)
class AddedSurrogate:
    """What `add_surrogate` found.

    Attributes:
        model: With the surrogates in it; the model that was given where `added` is empty.
        added: Names such as "surrogate@joint5".
        owner, depends_on: The place with the most evidence and what it depends on; None and () where none has any.
        share: Of the sum of squares of what was left, what that block explains.
        evidence: Of that block, twice a log ratio of likelihoods.
        held_out: RMS of poses left out with everything that was tried over that without; 1 where nothing was.
        inputs, curve: (N, inputs) and (N, directions) [rad, m]: the first block's function over the rows.
        unknowns: (U,) of the observations, shifted as the geometry is.
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


def add_surrogate(
    model: Robot,
    data: Dataset,
    *,
    noise: tuple[float, float, float],
    unknowns: FloatArray | None = None,
    exclude: frozenset[str] = frozenset(),
    threads: int = 1,
    gates: Gates = Gates(),
) -> AddedSurrogate:
    """Places what a calibrated model leaves and adds a surrogate of it, if evidence and poses left out both agree.

    Args:
        model: As `calibrate` or `diagnose` made it; its parameters stay as they are.
        data: The rows that it was fitted to, without outliers.
        noise: Standard deviation common to all numbers: positions [m], rotations [rad], lengths [m]. A wrong one
            weights kinds of numbers against each other wrongly, and nothing else: their common factor is estimated.
        unknowns: (U,) of the observations: places of anchors, planes ...
        exclude: Places and inputs to leave out, such as "workspace", "time".
        threads: Cores; the result does not depend on it.
        gates: What it must show to be added.
    """
    open_ones = [c for c in candidates(model, data) if not exclude & {c.owner, *c.inputs}]
    owners = list(dict.fromkeys(c.owner for c in open_ones))
    few = data.select(_some(len(data), _ROWS))
    problem = rest_problem(model, few, noise, unknowns, owners, threads)
    blocks = _chosen(problem, open_ones, gates)
    places = np.zeros(0) if unknowns is None else np.ravel(unknowns)
    nothing = AddedSurrogate(model, (), None, (), 0.0, 0.0, 1.0, np.zeros((0, 0)), np.zeros((0, 0)), places)
    if not blocks:
        return nothing
    if len(data) > len(few):
        rows = data.select(_some(len(data), _ROWS_FITTED))
        problem = rest_problem(model, rows, noise, unknowns, list({b.candidate.owner for b in blocks}), threads)
        blocks = [_block(problem, b.candidate, b.kernel, b.low, b.high, b.scale, b.size, b.evidence) for b in blocks]
    ratios = [_held_out(problem, blocks[: k + 1], open_ones, gates) for k in range(len(blocks))]
    blocks = blocks[: ratios.index(min(ratios)) + 1]  # a further block must help poses left out
    before = misfit(model, data, noise, places, threads)
    while True:
        entries, share, moved = _entries(problem, blocks)
        extended, beside = _with_effects(model, entries), places + moved
        is_less = misfit(extended, data, noise, beside, threads) < before
        if is_less or len(blocks) == 1:
            break
        blocks = blocks[:-1]  # the data leave so much of the geometry open that its shift goes past what is linear
    first = blocks[0]
    ratio = ratios[len(blocks) - 1]
    for block in blocks:
        if ratio < gates.held_out:  # one that fails is enough
            ratio = max(ratio, _elsewhere(problem, blocks, block, open_ones, gates))
    found = AddedSurrogate(
        model=model,
        added=(),
        owner=first.candidate.owner,
        depends_on=first.candidate.inputs,
        share=share,
        evidence=first.evidence,
        held_out=ratio,
        inputs=problem.inputs(first.candidate.inputs),
        curve=_curve(problem, first, entries[0]),
        unknowns=places,
    )
    if first.evidence < gates.evidence or ratio >= gates.held_out or not is_less:
        return found
    names = tuple(f"surrogate@{b.candidate.owner}" for b in blocks)
    return replace(found, model=extended, added=names, unknowns=beside)


def _with_effects(model: Robot, entries: list[Spec]) -> Robot:
    spec = copy.deepcopy(model.spec)
    spec["effects"] = [*(spec.get("effects") or []), *entries]
    return Robot(spec)


def _some(rows: int, most: int) -> NDArray[np.int64]:
    """Rows spread evenly, `most` of them at most."""
    return np.unique(np.linspace(0, rows - 1, min(rows, most)).round().astype(np.int64))


def _held_out(problem: RestProblem, blocks: list[Block], open_ones: list[Candidate], gates: Gates) -> float:
    """RMS of poses left out with the blocks over that without."""
    few = len(problem.data) < _FEW_ROWS
    return _without_folds(problem, problem.fold, blocks, open_ones if few else [], gates)


def _elsewhere(
    problem: RestProblem, blocks: list[Block], block: Block, open_ones: list[Candidate], gates: Gates
) -> float:
    """The same of all rows at values of a block's inputs: poses of a grid share them, and what is wrong there.

    0 where the inputs have few values, such as a direction of approach, or hardly any that rows share: poses left out
    test these.
    """
    values = problem.inputs(block.candidate.inputs)
    place = place_groups(values, gates.bins)
    if not 2 * FOLDS <= place.max() < _SHARED * len(place):
        return 0.0
    fold = deal(int(place.max()) + 1, FOLDS, np.random.default_rng(0))[place]
    few = len(np.unique(values, axis=0)) < _FEW_ROWS
    return _without_folds(
        problem, np.where(problem.row >= 0, fold[problem.row], -1), blocks, open_ones if few else [], gates
    )


def _without_folds(
    problem: RestProblem, fold: IntArray, blocks: list[Block], open_ones: list[Candidate], gates: Gates
) -> float:
    """RMS of what is left out with the blocks over that without, fold by fold.

    Few rows choose blocks by chance: with `open_ones` the choice is made again without each fold.
    """
    squares = np.zeros(2)
    for k in range(int(fold.max()) + 1):
        held = fold == k
        if not held.any():
            continue
        own = blocks
        if open_ones:
            kernels = _chosen(problem.without(held), open_ones, replace(gates, blocks=len(blocks)))
            own = [_block(problem, b.candidate, b.kernel, b.low, b.high, b.scale, b.size, b.evidence) for b in kernels]
        C = np.hstack([b.columns for b in own]) if own else np.zeros((len(problem.r), 0))
        squares += held_out_squares(problem.A, C, problem.r, held)
    return float(np.sqrt(squares[1] / squares[0])) if squares[0] > 0 else 1.0


def _chosen(problem: RestProblem, open_ones: list[Candidate], gates: Gates) -> list[Block]:
    """Blocks by evidence, each beside those before it."""
    blocks: list[Block] = []
    problem.find(name for candidate in open_ones for name in candidate.inputs)
    A, r = problem.A, problem.r
    while len(blocks) < gates.blocks:
        beside = Beside(A, r)
        best: Block | None = None
        worth: dict[Candidate, float] = {}
        pad = len(r) - len(problem.r)
        for candidate in open_ones:
            if any(candidate == b.candidate for b in blocks):
                continue
            for share in _WIDTHS[len(candidate.inputs)]:
                block = _candidate_block(problem, candidate, share)
                if block is None:
                    break
                found = beside.weigh(np.vstack([block.columns, np.zeros((pad, block.columns.shape[1]))]))
                worth[candidate] = max(found.evidence, worth.get(candidate, 0.0))
                if found.evidence > (0.0 if best is None else best.evidence):
                    best = Block(**{**vars(block), "size": found.size, "evidence": found.evidence})
        if best is None or best.evidence < (gates.more_evidence if blocks else 1e-9):
            break
        best = Block(**{**vars(best), "columns": best.columns * best.size})
        blocks.append(best)
        open_ones = sorted(worth, key=lambda c: -worth[c])[:_PROMISING]
        # What was chosen is part of the model from here on, its weights ~ N(0, I).
        count = best.columns.shape[1]
        columns = np.vstack([best.columns, np.zeros((pad, count))])
        A = np.block([[A, columns], [np.zeros((count, A.shape[1])), np.eye(count)]])
        r = np.append(r, np.zeros(count))
    return blocks


def _candidate_block(problem: RestProblem, candidate: Candidate, share: float) -> Block | None:
    """The columns of a candidate, mean square 1; None where it moves nothing that was measured."""
    x = problem.inputs(candidate.inputs)
    low, high = x.min(axis=0), x.max(axis=0)
    if not (high > low).all():
        return None
    size = np.sqrt((problem.place[candidate.owner] ** 2).mean(axis=0))
    if not size.any():
        return None
    sign = np.array([name.startswith("approach") for name in candidate.inputs])
    width = np.where(sign, 1.0, share * (high - low))
    most = _NODES[len(candidate.inputs)] if directions(candidate.owner) < 6 else _FEWER
    kernel = problem.features(candidate.inputs, width, most)
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 1e-9 * size.max())
    return _block(problem, candidate, kernel, low, high, scale, 1.0, 0.0)


def _block(
    problem: RestProblem,
    candidate: Candidate,
    kernel: Features,
    low: FloatArray,
    high: FloatArray,
    scale: FloatArray,
    size: float,
    evidence: float,
) -> Block:
    phi = kernel(problem.inputs(candidate.inputs))
    values = np.where((problem.row >= 0)[:, np.newaxis], phi[np.maximum(problem.row, 0)], 0.0)
    motion = problem.place[candidate.owner] * scale
    columns = (values[:, :, np.newaxis] * motion[:, np.newaxis, :]).reshape(len(values), -1)
    return Block(candidate, kernel, low, high, scale, size * columns, size, evidence)


def _entries(problem: RestProblem, blocks: list[Block]) -> tuple[list[Spec], float, FloatArray]:
    """The blocks as effects of a robot file, the share of the error that the first explains, and the unknowns' shift.

    The shift that makes the blocks orthogonal to the geometry has a part in the observations' unknowns (U,), such as
    the place of an anchor: it is no part of the robot, so whoever keeps them must move them.
    """
    sizes = [b.columns.shape[1] for b in blocks]
    C = np.hstack([b.columns for b in blocks])
    beside = Beside(problem.A, problem.r)
    across, left = beside.across(C), beside.across(problem.r)
    precision = across.T @ across + np.eye(C.shape[1])
    root = linalg.cho_factor(precision)
    w = linalg.cho_solve(root, across.T @ left)
    variance = float(np.sum((left - across @ w) ** 2)) / max(len(left) - 2 * problem.A.shape[1], 1)
    covariance = linalg.cho_solve(root, np.eye(len(w))) * variance
    back = linalg.lstsq(problem.A, C, lapack_driver="gelsy", check_finite=False)[0]
    out: list[Spec] = []
    first = np.concatenate([[0], np.cumsum(sizes)])
    for k, block in enumerate(blocks):
        own = slice(first[k], first[k + 1])
        eigenvalues, V = np.linalg.eigh(covariance[own, own])
        kept = slice(max(0, len(eigenvalues) - _COMPONENTS), None)
        components = V[:, kept] * np.sqrt(np.maximum(eigenvalues[kept], 0.0))
        moved = float(np.sum((across[:, own] @ w[own]) ** 2))
        amount_std = float(np.sqrt(variance / moved)) if moved > 0 else 1.0
        entry: Spec = {
            "effect": "surrogate",
            "owner": block.candidate.owner,
            "parameters": {"amount": {"value": 1.0, "std": amount_std}},
            "inputs": " ".join(block.candidate.inputs),
            "low": block.low.tolist(),
            "high": block.high.tolist(),
            "width": block.kernel.width.tolist(),
            "nodes": block.kernel.nodes.ravel().tolist(),
            "weights": _at_nodes(block, w[own]).ravel().tolist(),
            "shift": _shift(problem, -back[:, own] @ w[own]).tolist(),
            "spread": [
                [*_at_nodes(block, c).ravel().tolist(), *_shift(problem, -back[:, own] @ c).tolist()]
                for c in components.T
            ],
        }
        out.append(entry)
    return out, _share(across[:, : sizes[0]], left), -(back @ w)[problem.shifted < 0]


def _share(across: FloatArray, left: FloatArray) -> float:
    """Of the sum of squares that is left, what one block explains by itself."""
    w = np.linalg.solve(across.T @ across + np.eye(across.shape[1]), across.T @ left)
    total = float(left @ left)
    return float(np.clip(1 - np.sum((left - across @ w) ** 2) / total, 0.0, 1.0)) if total > 0 else 0.0


def _at_nodes(block: Block, w: FloatArray) -> FloatArray:
    """(k, directions) weights at the nodes [rad, m]."""
    by_feature = w.reshape(block.kernel.at_nodes.shape[1], len(block.scale))
    return np.asarray(block.size * (block.kernel.at_nodes @ by_feature) * block.scale)


def _shift(problem: RestProblem, values: FloatArray) -> FloatArray:
    """Of all parameters of the robot."""
    out = np.zeros(len(problem.model.core.parameters))
    own = problem.shifted >= 0
    out[problem.shifted[own]] = values[own]
    return out


def _curve(problem: RestProblem, block: Block, entry: Spec) -> FloatArray:
    """(N, directions) the function's values in the rows."""
    phi = block.kernel(problem.inputs(block.candidate.inputs))
    at_nodes = np.array(entry["weights"]).reshape(-1, len(block.scale))
    w = np.linalg.lstsq(block.kernel.at_nodes, at_nodes, rcond=None)[0]
    return np.asarray(phi @ w)


def surrogate_deviation(model: Robot, data: Dataset, threads: int = 1) -> FloatArray:
    """(N, 3) standard deviation [m] of the tool that comes from the model's surrogates; 0 without one."""
    return model.surrogate_deviation(model.samples(data), threads)
