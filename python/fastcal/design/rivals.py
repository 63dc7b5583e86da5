# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Effects that a design is to separate, and the poses that do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.design.candidates import Candidates
from fastcal.design.linear import LinearProblem
from fastcal.design.separation import Separation, separating_poses
from fastcal.effects.entries import Spec, parse_effects
from fastcal.errors import InvalidInput
from fastcal.robot.robot import Robot


def rival_entries(separate: Sequence[str], robot: Robot) -> list[list[Spec]]:
    """Entries of each effect that is to be separated from the others."""
    out = []
    for text in separate:
        geometry, entries = parse_effects([text], robot.core)
        if geometry or not entries:
            raise InvalidInput(f"separate takes effects, such as joint_compliance@joint2, got '{text}'")
        out.append(entries)
    if len(out) == 1:
        raise InvalidInput(f"separate takes two effects or more, got '{separate[0]}' alone")
    return out


def separated_rivals(
    problem: LinearProblem,
    pool: Candidates,
    rows: FloatArray,
    members: list[int],
    rivals: list[list[Spec]],
    count: int,
) -> Separation:
    """Up to `count` poses that separate the rivals, besides the `members`; all are indices into the pool.

    Args:
        problem: The design's.
        pool: Its candidates (N).
        rows: (N k, p) of theirs.
        members: Poses that are in the design already.
        rivals: Entries of each effect.
        count: How many.
    """
    places = problem.places_of(rivals)
    common = [i for i in range(len(problem.free)) if problem.free[i] not in {c for own in places for c in own}]
    left = np.setdiff1d(np.arange(len(pool)), members)
    k = problem.row_count
    causes = [problem.rows(pool, own).reshape(len(pool), k, -1) for own in places]
    blocks = [rows.reshape(len(pool), k, -1)[:, :, common], *causes]
    done = np.concatenate([block[members].reshape(len(members) * k, -1) for block in blocks], axis=1)
    found = separating_poses(
        blocks[0][left],
        [cause[left] for cause in causes],
        [np.eye(cause.shape[2]) for cause in causes],  # columns are scaled by plausible sizes
        count,
        prior=done.T @ done,
        threads=problem.threads,
    )
    return found.of(left)
