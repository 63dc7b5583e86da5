# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A camera or board that was knocked between two rows: which one, and when, over all rows of the data.

The columns of a step before row k are those of a shift in all rows, 0 from k on. All k are weighed at the k of the
joints that the fit without a step has and at a tenth of it, as a step passes for noise of the joints; the likeliest are
fitted.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.diagnosis import rules
from fastcal.diagnosis.rig_library import RigCause, placement_step
from fastcal.diagnosis.rig_likelihood import Best, Block, Corners, Likelihood
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

_FITTED = 3  # likeliest rows of each camera or board
_ALL = 10**9  # a row behind all


def placement_steps(
    corners: Corners, robot: Robot, data: Dataset, likelihood: Likelihood, without: Best, threads: int
) -> dict[RigCause, Block]:
    """For each camera and board that is not fixed the likeliest step, and its columns."""
    out: dict[RigCause, Block] = {}
    if data.row is None or (data.row < 0).any():
        return out
    moments = np.sort(np.unique(data.row))[rules.MIN_ROWS_BESIDE_STEP : -rules.MIN_ROWS_BESIDE_STEP + 1]
    if len(moments) == 0:
        return out
    rig = robot.description
    for kind, standing in (("cameras", rig.cameras), ("boards", rig.boards)):
        for name, of in standing.items():
            if of.get("fixed") or "knocked" in of:
                continue
            whole = corners.block(robot, data, placement_step(name, kind, _ALL, len(moments)), threads)
            blocks = [replace(whole, columns=whole.columns * _before(corners, data, at)) for at in moments.tolist()]
            best = _likeliest(corners, blocks, likelihood, without)
            out[placement_step(name, kind, int(moments[best]), len(moments))] = blocks[best]
    return out


def joint_steps(corners: Corners, data: Dataset, cause: RigCause) -> list[Block]:
    """The zero of each joint moved at the row of a placement step instead."""
    before = _before(corners, data, int(dict(cause.at)["at_row"]))
    return [Block(column[:, np.newaxis] * before, np.array([np.inf]), np.zeros(1)) for column in corners.G.T]


def _before(corners: Corners, data: Dataset, at: int) -> FloatArray:
    """(m, 1) 1 for the corners of rows before one, else 0."""
    order = np.arange(len(data)) if data.row is None else data.row
    return (order[corners.row] < at).astype(np.float64)[:, np.newaxis]


def _likeliest(corners: Corners, blocks: list[Block], likelihood: Likelihood, without: Best) -> int:
    all_of_them = Likelihood(corners, blocks, sigma=likelihood.sigma)
    scores = np.array([[all_of_them.cost([i], k) for i in range(len(blocks))] for k in (without.k, without.k / 10)])
    tried = sorted({int(i) for row in scores for i in np.argsort(row)[:_FITTED]})
    costs = [Likelihood(corners, [blocks[i]], sigma=likelihood.sigma).best([0]).cost for i in tried]
    return tried[int(np.argmin(costs))]
