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
from fastcal.calibration.lack_of_fit import points_depend, readings_depend
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals, near_fit
from fastcal.calibration.serial_correlation import SerialCorrelation, serial_correlation
from fastcal.calibration.shifted_rows import Shift, find_shift
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, Kind, in_order
from fastcal.measurements.observations import without_measured

FloatArray = NDArray[np.float64]

MOST_ROWS = 5000  # beyond, the dense Jacobian of the checks costs more than the fit: every k-th row stands for all
_SAME_ROWS = 0.8  # of the rows have the same numbers: else their order is not that of one instrument's noise
CHANCE = 1e-3  # of a sentence about data in which nothing is missing


@dataclass(frozen=True, eq=False)
class Checks:
    """What was found.

    Attributes:
        serial: Noise with memory; its covariance is that of the parameters, SI.
        notes: Sentences for a reader.
        set_aside: Rows of a part that moved, and gross rows beside those that the fit found.
        refusal: Why the fit is no answer; None where it is one.
        caveats: Those of the notes by which the stated deviations do not hold.
    """

    serial: SerialCorrelation | None = None
    notes: list[str] = field(default_factory=list)
    set_aside: list[int] = field(default_factory=list)
    refusal: str | None = None
    caveats: list[str] = field(default_factory=list)


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
    found_shift = moved_part(near, problem.model, problem.data)
    if found_shift is not None:
        shift, kind = found_shift
        rows = shift.smaller_part(len(problem.data))
        cleared = without_measured(problem.data, rows)
        part = problem.with_(data=cleared, measured=measurements(cleared, problem.robot))
        again = refit(part) if problem.loss != "none" else found
        left = near_fit(problem, again)
        better = again is not found and again.status == "converged" and len(again.free) >= len(found.free)
        if better and left is not None:
            late = np.isin(left.row, rows) & left.of(kind)
            size = left.scale_of(kind) * float(np.sqrt(np.sum(left.residual[late] ** 2) / len(rows)))
            notes.append(shift_note(replace(shift, size=size), len(cleared), kind, is_used=False))
            found, problem, set_aside = again, part, rows.tolist()
        else:
            notes.append(shift_note(shift, len(cleared), kind, is_used=True))
    agreed = majority(problem, found, refit)
    found, problem = agreed.found, agreed.problem
    notes += agreed.notes
    near = near_fit(problem, found) or near
    serial, more, caveats = noise_and_posture(near, problem, found)
    return found, Checks(serial, notes + more, [*set_aside, *agreed.set_aside], agreed.refusal, caveats)


def moved_part(near: Residuals, model: _core.ErrorModel, data: Dataset) -> tuple[Shift, Kind] | None:
    """Where the tracker, the base or the target moved, and the kind that shows it; None where labels say it."""
    if data.station is not None or data.mount is not None:
        return None
    own = len(model.robot.parameters)
    turned = data.rotation is not None
    motions = [near.J[:, :6], near.J[:, own - 6 : own if turned else own - 3]]
    for kind in in_order(set(near.kind_of_number)):  # one that stands still would hide what another shows
        of_kind = near.of(kind)
        J = near.J[of_kind]
        seen = J[:, near.free].any(axis=0)
        columns = [motion[of_kind] for motion in motions if motion[of_kind].any()]
        if not columns:
            continue
        residual, row = near.residual[of_kind], near.row[of_kind]
        shift = find_shift(J[:, near.free][:, seen], columns, residual, row, near.scale_of(kind))
        if shift is not None:
            return shift, kind
    return None


def shift_note(shift: Shift, count: int, kind: Kind, *, is_used: bool) -> str:
    """The sentence for a part that moved, its size that of a kind; `is_used`: all rows were used nevertheless."""
    what = "points lie elsewhere" if kind.name == POINTS else f"{kind.plural} are others"
    moved = f"from row {shift.first} on the {what}, by {kind.shown(shift.size):.3g} {kind.unit}"
    cause = "the tracker, the base or the target moved"
    labels = "give the two parts different `station` or `mount` labels"
    if is_used:
        return f"{moved}: {cause}; {labels}"
    used = (
        f"rows 0 to {shift.first - 1}" if count - shift.first <= shift.first else f"rows {shift.first} to {count - 1}"
    )
    return f"{moved}: {cause}. Only {used} are used; {labels} to use both"


def noise_and_posture(
    near: Residuals, problem: CalibrationProblem, found: _core.Identification
) -> tuple[SerialCorrelation | None, list[str], list[str]]:
    """Does the noise have a memory, do the residuals depend on the posture; in sentences too, and the caveats."""
    J, residual, row = near.J[near.kept][:, near.free], near.residual[near.kept], near.row[near.kept]
    scale = np.linalg.norm(J, axis=0)
    if len(residual) <= J.shape[1] or not scale.all() or np.linalg.matrix_rank(J / scale) < J.shape[1]:
        return None, [], []
    notes: list[str] = []
    caveats: list[str] = []
    data = problem.data
    serial = serial_correlation(J / scale, residual, row, len(data)) if _alike(row, len(data)) else None
    if serial is not None:
        notes.append(
            f"errors of successive rows are correlated ({serial.rho:.2f}): the noise drifts, and the stated deviations "
            f"allow for it"
        )
        serial = replace(serial, covariance=serial.covariance / np.outer(scale, scale))
    whole = np.bincount(row, minlength=len(data)) == 3
    if near.kind_of_number == [near.kind] * 3 and np.sum(whole) * 3 == len(residual) and data.position is not None:
        p = points_depend(J, residual, np.flatnonzero(whole), problem.robot, data)
    else:
        p = readings_depend(problem, found, J, residual, row, near.number[near.kept])
    if p < CHANCE:
        caveats.append(
            f"the residuals depend on the posture (p = {p:.1g}): an effect is missing from the model, and the "
            f"stated deviations and intervals do not hold; `fastcal diagnose` looks for it"
        )
    return serial, [*notes, *caveats], caveats


def _alike(row: NDArray[np.int64], count: int) -> bool:
    """Do nearly all rows with a number have as many? Only then has a row the same numbers as the one before."""
    numbers = np.bincount(row, minlength=count)
    numbers = numbers[numbers > 0]
    return bool(np.mean(numbers == np.bincount(numbers).argmax()) > _SAME_ROWS)
