# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Signs in the residuals that the fit is wrong: noise with memory, a part that moved, a missing effect."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.alignment import measurements
from fastcal.calibration.asked_conditions import Explained, Word, condition_that_explains, reading
from fastcal.calibration.gross_rows import Refit, majority
from fastcal.calibration.lack_of_fit import posture_dependence
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals, near_fit, without_rows
from fastcal.calibration.serial_correlation import SerialCorrelation, serial_correlation
from fastcal.calibration.shifted_rows import Shift, find_shift
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kinds_of
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

MOST_ROWS = 5000  # beyond, the dense Jacobian of the checks costs more than the fit: every k-th row stands for all
RIGID = 3.0  # times the error of the others is what a move leaves of the rows that it moved
CHANCE = 1e-3  # of a sentence about data in which nothing is missing


@dataclass(frozen=True, eq=False)
class Checks:
    """What residuals say.

    Attributes:
        serial: Noise with memory; its covariance is that of the parameters, SI.
        notes: Sentences for a reader.
        set_aside: Rows of a part that moved, and gross rows beside those that the fit found.
    """

    serial: SerialCorrelation | None = None
    notes: list[str] = field(default_factory=list)
    set_aside: list[int] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class Cleared:
    """A fit of the rows that belong together.

    Attributes:
        problem, found: The problem without the rows that were set aside, and its fit.
        rest: The problem without the rows of a part that moved.
        moved: Rows of a part that moved.
        set_aside: Gross rows beside those that the fit found.
        notes: Sentences for a reader.
        refusal: Why the fit is no answer; None where it is one.
    """

    problem: CalibrationProblem
    found: _core.Identification
    rest: CalibrationProblem
    moved: list[int] = field(default_factory=list)
    set_aside: list[int] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    refusal: str | None = None


def cleared(problem: CalibrationProblem, found: _core.Identification, refit: Refit) -> Cleared:
    """The fit, or a better one without a part of the data that moved or gross rows.

    Args:
        problem: Its rows are in the order of measuring; with the loss "none" no row is set aside.
        found: The fit.
        refit: Identifies from other rows.
    """
    near = near_fit(problem, found)
    if near is None:
        return Cleared(problem, found, problem)
    out = Cleared(problem, found, problem)
    shift = moved_part(near, problem.model, problem.data)
    if shift is not None:
        word, effect = reading(problem, near, shift)
        out = _without_part(problem, found, refit, shift) if word in ("moved", "both") else out
        if effect is not None and (word != "both" or out.notes):
            out.notes.append(condition_note(shift, word, effect))
    agreed = majority(out.problem, out.found, refit)
    notes = [*out.notes, *agreed.notes]
    return Cleared(agreed.problem, agreed.found, out.problem, out.moved, agreed.set_aside, notes, agreed.refusal)


def _without_part(problem: CalibrationProblem, found: _core.Identification, refit: Refit, shift: Shift) -> Cleared:
    """The fit of the larger part of the rows, if the other is as rigid: moved, it fits as well; else all rows."""
    rows = shift.smaller_part(len(problem.data))
    rest = without_rows(problem.data, rows)
    if problem.loss == "none":
        return Cleared(problem, found, problem, notes=[shift_note(shift, len(rest), is_used=True)])
    part = problem.with_(data=rest, measured=measurements(rest, problem.robot))
    again = refit(part)
    left = near_fit(problem, again)
    if again.status != "converged" or left is None or len(again.free) < len(found.free):
        return Cleared(problem, found, problem, notes=[shift_note(shift, len(rest), is_used=True)])
    late = np.isin(left.row, rows)
    own = len(problem.model.robot.parameters)
    frames = np.hstack([left.J[:, :6], left.J[:, own - 6 : own]])[late]
    moved = left.residual[late] - frames @ np.linalg.lstsq(frames, left.residual[late], rcond=1e-10)[0]
    kept = ~late & left.kept
    freedom = max(1, late.sum() - 12), max(1, kept.sum() - len(left.free))
    if np.sum(moved**2) / freedom[0] > RIGID**2 * np.sum(left.residual[kept] ** 2) / freedom[1]:
        return Cleared(problem, found, problem)  # no move of a body: an effect that the model lacks
    size = left.scale * float(np.sqrt(np.sum(left.residual[late] ** 2) / len(rows)))
    note = shift_note(replace(shift, size=size), len(rest), is_used=False)
    return Cleared(part, again, part, rows.tolist(), notes=[note])


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


def condition_note(shift: Shift, word: Word, effect: Explained) -> str:
    """The sentence where a condition explains rows that lie elsewhere, alone, too, or as well as a move would."""
    ask = f"ask for it with --effects {effect.asked}"
    if word == "both":
        return f"besides, the errors depend on {effect.said}: {ask}"
    where = f"from row {shift.first} on the points lie elsewhere, by {from_si(shift.size, 'mm'):.3g} mm"
    if word == "effect":
        return f"{where}, as they depend on {effect.said}, and nothing moved: {ask}; all rows are used"
    return (
        f"{where}: either they depend on {effect.said} ({ask}), or the tracker, the base or the target moved (then "
        f"give the two parts different `station` or `mount` labels); these rows cannot tell, and all are used"
    )


def noise_and_posture(problem: CalibrationProblem, near: Residuals) -> tuple[SerialCorrelation | None, list[str]]:
    """Does the noise have a memory, do the residuals depend on the posture; in sentences too."""
    robot, data = problem.robot, problem.data
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
            effect = condition_that_explains(problem, near)
            more = "`fastcal diagnose` looks for it"
            if effect is not None:
                more = f"they depend on {effect.said}: ask for it with --effects {effect.asked}"
            notes.append(
                f"the residuals depend on the posture (p = {p:.1g}): an effect is missing from the model, and the "
                f"stated deviations and intervals do not hold; {more}"
            )
    return serial, notes
