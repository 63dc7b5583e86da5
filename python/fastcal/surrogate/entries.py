# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The blocks of a surrogate as effects of a robot file, fitted beside the geometry and orthogonal to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import linalg

from fastcal.arrays import FloatArray
from fastcal.robot.robot import Spec
from fastcal.surrogate.blocks import Block
from fastcal.surrogate.evidence import Beside
from fastcal.surrogate.problem import ResidualProblem

_COMPONENTS = 8  # of the function's uncertainty that a model keeps


def effect_entries(problem: ResidualProblem, blocks: Sequence[Block]) -> tuple[list[Spec], float, FloatArray]:
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


def _shift(problem: ResidualProblem, values: FloatArray) -> FloatArray:
    """Of all parameters of the robot."""
    out = np.zeros(len(problem.model.core.parameters))
    own = problem.shifted >= 0
    out[problem.shifted[own]] = values[own]
    return out


def curve(problem: ResidualProblem, block: Block, entry: Spec) -> FloatArray:
    """(N, directions) the function's values in the rows."""
    phi = block.kernel(problem.inputs(block.candidate.inputs))
    at_nodes = np.array(entry["weights"]).reshape(-1, len(block.scale))
    w = np.linalg.lstsq(block.kernel.at_nodes, at_nodes, rcond=None)[0]
    return np.asarray(phi @ w)
