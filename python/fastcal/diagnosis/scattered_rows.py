# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Few rows of which more are grossly wrong than outliers may be: noise with heavy tails.

The search leaves out MAX_OUTLIER_SHARE of the rows at most, since a missing effect puts many rows off as well. Of forty
rows with five gross ones it keeps three, and these hide all else. A robust fit of the geometry alone suspects them, and
a second search without them tells noise from an effect: of rows that an effect puts off, what is found explains the
others as before; without rows that were wrong it leaves far less of them.
"""

from __future__ import annotations

import numpy as np

from fastcal.calibration.asked_conditions import share_a_condition
from fastcal.calibration.problem import prepare
from fastcal.diagnosis import rules
from fastcal.diagnosis.fits import Fit, fit
from fastcal.diagnosis.found import Found
from fastcal.diagnosis.noise import isolated_rows
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

# Share of few rows that may be wrong where they scatter: more are no exceptions.
MAX_SCATTERED_SHARE = 0.2
# What is left without them, of what was left with them, at most: the largest fifth of normal noise takes a fifth of it.
SCATTERED_NOISE = 0.5
# The same of what passes for noise beside the rich model.
CALMER = 0.9
# The same of what was found with them, for a second search to be worth its time.
MAY_HIDE = 0.75


def scattered_rows(robot: Robot, data: Dataset) -> list[int]:
    """Rows that a robust fit of the geometry leaves out, scattered over postures and times.

    None of many rows, and none where the search leaves out as many by itself.
    """
    count = int(data.measured.sum())
    if count > rules.CHOSEN_AGAIN_ROWS:
        return []
    robust = prepare(robot, data, effects="geometry").identify()
    if robust.status != "converged":
        return []
    wrong = isolated_rows(np.asarray(robust.outliers, dtype=np.intp), data)
    if share_a_condition(data, wrong, data.measured):
        return []
    least, most = rules.MAX_OUTLIER_SHARE * count, MAX_SCATTERED_SHARE * count
    return [int(i) for i in wrong] if least < len(wrong) <= most else []


def may_hide(found: Found, rows: list[int]) -> bool:
    """Does what was found leave clearly less of the others, fitted without these rows? A second search is dear."""
    at = found.model.fit
    used = at.problem.used.copy()
    used[rows] = False
    if used.sum() == at.problem.used.sum():
        return False
    return _left(fit(at.problem.with_rows(used), at.added, at)) < MAY_HIDE * _left(at)


def _left(at: Fit) -> float:
    """Standard deviation of what a fit leaves of its rows."""
    _, r, row = at.whitened
    r = r[row >= 0]
    return float(np.sqrt(r @ r / max(len(r) - len(at.free), 1)))


def are_noise(found: Found, without: Found) -> bool:
    """Was what is missing hidden by the rows that a second search, `without` them, left out?

    Far less must be left of the others, and less of them pass for noise whatever is missing (the rich model): where the
    rows are part of an effect that has no name, that stays.
    """
    if without.few or without.level.sigma > CALMER * found.level.sigma:
        return False
    return _left(without.model.fit) * without.level.sigma < SCATTERED_NOISE * _left(found.model.fit) * found.level.sigma
