# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What can be measured of all candidates: those that the surroundings allow, and touches of the planes at hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.arrays import FloatArray
from fastcal.design.candidates import MOST, Candidates, postures, with_conditions
from fastcal.design.instruments import Instruments, touches
from fastcal.design.planned import approached
from fastcal.design.surroundings import UNSEEN, Surroundings
from fastcal.robot.robot import Robot

_LEAST_CLEAR = 0.3  # of a grid: of two or three steps a joint most lie at the limits, below an arm
_DRAWN = 8  # times as many, of which an eighth is clear for the arms that bend lowest
FEWEST_TOUCHES = 4  # of a plane: with fewer an identification has no start


def candidates_and_obstacles(
    model: Robot,
    how: str | ArrayLike,
    count: int,
    surroundings: Surroundings | None,
    payloads: Sequence[float],
    seed: int,
    threads: int,
    instruments: Instruments,
) -> tuple[Candidates, NDArray[np.int64]]:
    """All candidates, and for each (N,) 0 or why it cannot be measured (`REASONS`).

    Without surroundings, postures that are not given stay clear of the arm's own mounting.
    """
    is_free = surroundings is None and isinstance(how, str)
    if surroundings is None:
        surroundings = Surroundings(mounting=is_free)
    if instruments.planes and isinstance(how, str):
        count = max(count // (1 + len(instruments.planes)), 2)
    q = postures(model, how, count, seed)
    if is_free and how == "grid":
        q = _dense_enough(model, q, surroundings, count, seed, threads)
    out = with_conditions(q, payloads, approached(model), count, seed)
    if not instruments.planes:
        obstacle = surroundings.obstacles(model, q, threads=threads)
        return out, np.repeat(obstacle, len(out) // len(q))
    out = touches(model, out, instruments, threads)
    obstacle = surroundings.obstacles(model, out.q, threads=threads)
    obstacle[out.touching & np.isin(obstacle, UNSEEN)] = 0  # a touch needs no tracker
    return out, obstacle


def _dense_enough(
    model: Robot, q: FloatArray, surroundings: Surroundings, count: int, seed: int, threads: int
) -> FloatArray:
    """The grid q (N, n); or, where little of a coarse one is clear of the arm's mounting, a draw that has as much."""
    if np.mean(surroundings.obstacles(model, q, threads=threads) == 0) >= _LEAST_CLEAR:
        return q
    drawn = postures(model, "random", min(count * _DRAWN, MOST), seed)
    clear = drawn[surroundings.obstacles(model, drawn, threads=threads) == 0]
    return clear[:count] if len(clear) else q


def too_few_touches(poses: Candidates) -> list[str]:
    """A sentence for each plane whose touches are too few to find where it lies."""
    if poses.plane is None:
        return []
    labels, counts = np.unique(poses.plane[poses.touching].astype(str), return_counts=True)
    return [
        f"plane {label} is touched {count} times; a calibration needs at least {FEWEST_TOUCHES} touches of a plane"
        for label, count in zip(labels, counts, strict=True)
        if count < FEWEST_TOUCHES
    ]
