# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How much effects improve the prediction of held-out rows, also for closed loops, which are nonlinear."""

from __future__ import annotations

from fastcal.calibration.repeatability import posture_groups
from fastcal.diagnosis.held_out import gain, squares
from fastcal.diagnosis.search import Search, SearchNode


def gains(search: Search, state: SearchNode) -> list[tuple[float, float]]:
    """By how much each name helps to predict held-out rows, and its standard error.

    `SearchNode.gains` takes what the rows would be without a name from the linearized rows. Closed loops bend between
    the two: of these the fit without it counts as well, if it leaves more of the rows that it was fitted to.
    """
    if not search.problem.start.robot.passive:
        return state.gains
    bent = [beyond(state, search.without(state, name)) for name in state.names]
    return [max(pair, key=_deviations) for pair in zip(state.gains, bent, strict=True)]


def beyond(state: SearchNode, simpler: SearchNode) -> tuple[float, float]:
    """By how much a set predicts held-out rows better than a simpler one, with closed loops than that one fits them."""
    if not state.fit.problem.start.robot.passive:
        return gain(state.predicted, simpler.predicted)
    return gain(state.predicted, squares(simpler.fit), posture_groups(state.fit.problem.data))


def _deviations(helps: tuple[float, float]) -> float:
    return helps[0] / max(helps[1], 1e-300)
