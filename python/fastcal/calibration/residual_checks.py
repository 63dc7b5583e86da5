# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signs in the residuals that the fit is wrong: noise with memory, a part that moved, a missing effect."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.gross_rows import Refit, majority
from fastcal.calibration.lack_of_fit import posture_dependence
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals, near_fit, without_rows
from fastcal.calibration.serial_correlation import SerialCorrelation, serial_correlation
from fastcal.calibration.shifted_rows import Shift, find_shift
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kinds_of
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

MOST_ROWS = 5000  # beyond, the dense Jacobian of the checks costs more than the fit: every k-th row stands for all
CHANCE = 1e-3  # of a sentence about data in which nothing is missing


@dataclass(frozen=True, eq=False)
class Checks:
    """What was found.

    Attributes:
        serial: Noise with memory; its covariance is that of the parameters, SI.
        notes: Sentences for a reader.
        set_aside: Rows of a part that moved, and gross rows beside those that the fit found.
        refusal: Why the fit is no answer; None where it is one.
        problem: Of the rows that were used; None where they are all.
    """

    serial: SerialCorrelation | None = None
    notes: list[str] = field(default_factory=list)
    set_aside: list[int] = field(default_factory=list)
    refusal: str | None = None
    problem: CalibrationProblem | None = None


def checked(
    problem: CalibrationProblem, found: _core.Identification, refit: Refit
) -> tuple[_core.Identification, Checks]:
    """The fit, or a better one without a part of the data that moved or gross rows, and what its residuals show.

    Args:
        problem: Its rows are in the order of measuring; with the loss "none" no row is set aside.
        found: The fit.
        refit: Identifies from other rows.
    """
    near = near_fit(problem, found)
    if near is None:
        return found, Checks()
    notes: list[str] = []
    set_aside: list[int] = []
    shift = moved_part(near, problem.model, problem.data)
    if shift is not None:
        rows = shift.smaller_part(len(problem.data))
        cleared = without_rows(problem.data, rows)
        part = problem.with_(data=cleared, measured=measurements(cleared, problem.robot))
        again = refit(part) if problem.loss != "none" else found
        left = near_fit(problem, again)
        better = again is not found and again.status == "converged" and len(again.free) >= len(found.free)
        if better and left is not None:
            late = np.isin(left.row, rows)
            size = left.scale * float(np.sqrt(np.sum(left.residual[late] ** 2) / len(rows)))
            notes.append(shift_note(replace(shift, size=size), len(cleared), is_used=False))
            found, problem, set_aside = again, part, rows.tolist()
        else:
            notes.append(shift_note(shift, len(cleared), is_used=True))
    agreed = majority(problem, found, refit)
    found, problem = agreed.found, agreed.problem
    notes += agreed.notes
    near = near_fit(problem, found) or near
    serial, more = noise_and_posture(near, problem.robot, problem.data)
    return found, Checks(serial, notes + more, [*set_aside, *agreed.set_aside], agreed.refusal, problem)


def moved_part(near: Residuals, model: _core.ErrorModel, data: Dataset) -> Shift | None:
    """Where the tracker, the base or the target moved; None where labels give the set-ups."""
    if data.station is not None or data.mount is not None:
        return None
    own = len(model.robot.parameters)
    turned = data.rotation is not None
    motions = [near.J[:, :6], near.J[:, own - 6 : own if turned else own - 3]]
    return find_shift(near.J[:, near.free], motions, near.residual, near.row, near.scale)


def shift_note(shift: Shift, count: int, *, is_used: bool) -> str:
    """The sentence for a part that moved; `is_used`: all rows were used nevertheless."""
    moved = f"from row {shift.first} on the points lie elsewhere, by {from_si(shift.size, 'mm'):.3g} mm"
    cause = "the tracker, the base or the target moved"
    labels = "give the two parts different `station` or `mount` labels"
    if is_used:
        return f"{moved}: {cause}; {labels}"
    used = (
        f"rows 0 to {shift.first - 1}" if count - shift.first <= shift.first else f"rows {shift.first} to {count - 1}"
    )
    return f"{moved}: {cause}. Only {used} are used; {labels} to use both"


def noise_and_posture(near: Residuals, robot: Robot, data: Dataset) -> tuple[SerialCorrelation | None, list[str]]:
    """Does the noise have a memory, do the residuals depend on the posture; in sentences too."""
    J, residual, row = near.J[near.kept][:, near.free], near.residual[near.kept], near.row[near.kept]
    scale = np.linalg.norm(J, axis=0)
    if len(residual) <= J.shape[1] or not scale.all() or np.linalg.matrix_rank(J / scale) < J.shape[1]:
        return None, []
    notes = []
    serial = serial_correlation(J / scale, residual, row, len(data))
    if serial is not None:
        notes.append(
            f"errors of successive rows are correlated ({serial.rho:.2f}): the noise drifts, and the stated deviations "
            f"allow for it"
        )
        serial = replace(serial, covariance=serial.covariance / np.outer(scale, scale))
    whole = np.bincount(row, minlength=len(data)) == 3
    if len(kinds_of(data)) == 1 and np.sum(whole) * 3 == len(residual):
        p = posture_dependence(J, residual, np.flatnonzero(whole), robot, data)
        if p < CHANCE:
            notes.append(
                f"the residuals depend on the posture (p = {p:.1g}): an effect is missing from the model, and the "
                f"stated deviations and intervals do not hold; `fastcal diagnose` looks for it"
            )
    return serial, notes
