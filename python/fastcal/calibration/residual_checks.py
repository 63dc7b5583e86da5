# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks of the residuals: correlated noise, a move between rows, a missing effect."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import IndexArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.asked_conditions import Explained, Word, condition_that_explains, reading
from fastcal.calibration.gross_rows import Refit, majority
from fastcal.calibration.joint_noise import joint_repeatability
from fastcal.calibration.lack_of_fit import Whitening, points_depend, posture_features, readings_depend
from fastcal.calibration.lens_columns import lens_columns
from fastcal.calibration.levers import whitened_levers
from fastcal.calibration.postures import stays
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.repeatability import pose_groups
from fastcal.calibration.residuals import Residuals, near_fit
from fastcal.calibration.serial_correlation import SerialCorrelation, neighbour_correlation, serial_correlation
from fastcal.calibration.shifted_rows import Shift, find_shift
from fastcal.calibration.stay_correlation import of_stays, stay_correlation, whitened
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, Kind, in_order
from fastcal.measurements.observations import without_measured
from fastcal.said import said
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

MOST_ROWS = 5000  # beyond, the dense Jacobian of the checks costs more than the fit: every k-th row stands for all
_SAME_ROWS = 0.8  # of the rows have the same numbers: else their order is not that of one instrument's noise
RIGID = 3.0  # times the error of the others is what a move leaves of the rows that it moved
BENT = 0.1  # of a move at least that must be left of it, as a large one is not quite linear
CHANCE = 1e-3  # of a sentence about data in which nothing is missing


@dataclass(frozen=True, eq=False)
class Checks:
    """What residuals say.

    Attributes:
        serial: Noise with memory; its covariance is that of the parameters, SI.
        notes: Sentences for a reader.
        set_aside: Rows of a part that moved, and gross rows beside those that the fit found.
        caveats: Those of the notes by which the stated deviations do not hold.
        bent: That of the caveats which is about a fit that is not straight (`curvature`); empty where there is none.
        choices: Those of the notes that say which rows are used and which fit stands.
    """

    serial: SerialCorrelation | None = None
    notes: list[str] = field(default_factory=list)
    set_aside: list[int] = field(default_factory=list)
    caveats: list[str] = field(default_factory=list)
    bent: str = ""
    choices: list[str] = field(default_factory=list)


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
    found_shift = moved_part(near, problem)
    if found_shift is not None:
        shift, kind = found_shift
        word, effect = reading(problem, near.only(kind), shift)
        if not shift.stands_out and word != "effect":
            word, effect = "moved", None
        is_move = shift.stands_out and word in ("moved", "both")
        out = _without_part(problem, found, refit, shift, kind) if is_move else out
        if effect is not None and (word != "both" or out.notes):
            out.notes.append(condition_note(shift, kind, word, effect))
    agreed = majority(out.problem, out.found, refit)
    notes = [*out.notes, *agreed.notes]
    return Cleared(agreed.problem, agreed.found, out.problem, out.moved, agreed.set_aside, notes, agreed.refusal)


def _without_part(
    problem: CalibrationProblem, found: _core.Identification, refit: Refit, shift: Shift, kind: Kind
) -> Cleared:
    """The fit of the longest part of the rows, if the others are as rigid: moved, they fit as well; else all rows."""
    count = len(problem.data)
    rows = np.setdiff1d(np.arange(count), shift.kept(count))
    rest = without_measured(problem.data, rows)
    all_rows = Cleared(problem, found, problem, notes=[shift_note(shift, count, kind, is_used=True)])
    measured = measurements(rest, problem.robot)
    if problem.loss == "none" or len(measured.parameters) < problem.unknown_count:  # a socket of these rows alone
        return all_rows
    part = problem.with_(data=rest, measured=measured)
    again = refit(part)
    left = near_fit(problem, again)
    if again.status != "converged" or left is None or len(again.free) < len(found.free):
        return all_rows
    late = np.isin(left.row, rows)
    own = len(problem.model.robot.parameters)
    frames = np.hstack([left.J[:, :6], left.J[:, own - 6 : own]])
    others = [part for part in shift.parts(count) if np.isin(part, rows).all()]
    moved = sum(_bent(frames, left.residual, np.isin(left.row, part)) for part in others)
    kept = ~late & left.kept
    freedom = max(1, late.sum() - 12 * len(others)), max(1, kept.sum() - len(left.free))
    loose = moved / freedom[0] > RIGID**2 * np.sum(left.residual[kept] ** 2) / freedom[1]
    if loose and moved > (BENT * np.linalg.norm(left.residual[late])) ** 2:
        return Cleared(problem, found, problem)  # no move of a body: an effect that the model lacks
    size = left.scale_of(kind) * float(np.sqrt(np.sum(left.residual[late & left.of(kind)] ** 2) / len(rows)))
    size /= np.sqrt(_readings_a_row(left, kind))
    note = shift_note(replace(shift, size=size), count, kind, is_used=False)
    return Cleared(part, again, part, rows.tolist(), notes=[note])


def _bent(frames: FloatArray, residual: FloatArray, late: NDArray[np.bool_]) -> float:
    """The squares that a motion of base and target leaves of some rows' residuals."""
    r, J = residual[late], frames[late]
    return float(np.sum((r - J @ np.linalg.lstsq(J, r, rcond=1e-10)[0]) ** 2))


def moved_part(near: Residuals, problem: CalibrationProblem) -> tuple[Shift, Kind] | None:
    """Where the tracker, the base or the target moved, and the kind that shows it; None where labels say it."""
    data = problem.data
    if data.station is not None or data.mount is not None:
        return None
    own = len(problem.model.robot.parameters)
    lens = lens_columns(problem, near)  # one that is not as the file says looks like a move of what it sees
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
        fitted = J[:, near.free][:, seen]
        if lens is not None:
            fitted = np.hstack([fitted, lens.columns[of_kind]])
        shift = find_shift(fitted, columns, residual, row, near.scale_of(kind))
        if shift is not None:
            return replace(shift, size=shift.size / np.sqrt(_readings_a_row(near, kind))), kind
    return None


def _readings_a_row(near: Residuals, kind: Kind) -> float:
    """Of corners a row has many, and a size is told of one."""
    of_kind = near.of(kind)
    return float(of_kind.sum() / 2 / len(np.unique(near.row[of_kind]))) if kind.name == CORNERS else 1.0


def shift_note(shift: Shift, count: int, kind: Kind, *, is_used: bool) -> str:
    """The sentence for parts of `count` rows that moved, by a size of that kind; `is_used`: all rows are used."""
    moved = _elsewhere(shift, kind)
    several = len(shift.firsts) > 1
    if is_used:
        labels = (
            said("give the parts different `station` or `mount` labels")
            if several
            else said("give the two parts different `station` or `mount` labels")
        )
        if kind.name == CORNERS:
            return said("{moved}: the camera, the base or the board moved; {labels}", moved=moved, labels=labels)
        return said("{moved}: the tracker, the base or the target moved; {labels}", moved=moved, labels=labels)
    labels = (
        said("give the parts different `station` or `mount` labels to use all")
        if several
        else said("give the two parts different `station` or `mount` labels to use both")
    )
    kept = shift.kept(count)
    numbers: dict[str, Any] = {"moved": moved, "first": int(kept[0]), "last": int(kept[-1]), "labels": labels}
    if kind.name == CORNERS:
        return said(
            "{moved}: the camera, the base or the board moved. Only rows {first} to {last} are used; {labels}",
            **numbers,
        )
    return said(
        "{moved}: the tracker, the base or the target moved. Only rows {first} to {last} are used; {labels}", **numbers
    )


def _elsewhere(shift: Shift, kind: Kind) -> str:
    what = (
        said("the points lie elsewhere")
        if kind.name == POINTS
        else said("the {kind} are others", kind=said(kind.plural))
    )
    *most, last = shift.firsts
    where = (
        said("from rows {most} and {last} on, each time again,", most=", ".join(map(str, most)), last=last)
        if most
        else said("from row {last} on", last=last)
    )
    by = float(kind.shown(shift.size))
    return said("{where} {what}, by {by:.3g} {unit}", where=where, what=what, by=by, unit=kind.unit)


def condition_note(shift: Shift, kind: Kind, word: Word, effect: Explained) -> str:
    """The sentence where a condition explains rows that lie elsewhere, alone, too, or as well as a move would."""
    ask = said("ask for it with --effects {effects}", effects=effect.asked)
    if word == "both":
        return said("besides, the errors depend on {condition}: {ask}", condition=effect.said, ask=ask)
    where = _elsewhere(shift, kind)
    if word == "effect":
        return said(
            "{where}, as they depend on {condition}, and nothing moved: {ask}; all rows are used",
            where=where,
            condition=effect.said,
            ask=ask,
        )
    return said(
        "{where}: either they depend on {condition} ({ask}), or the tracker, the base or the target moved (then "
        "give the two parts different `station` or `mount` labels); these rows cannot tell, and all are used",
        where=where,
        condition=effect.said,
        ask=ask,
    )


def noise_and_posture(
    near: Residuals, problem: CalibrationProblem, found: _core.Identification
) -> tuple[SerialCorrelation | None, list[str], list[str]]:
    """What numbers share beyond white noise, do they depend on the posture; in sentences too, and the caveats."""
    J, residual, row = near.J[near.kept][:, near.free], near.residual[near.kept], near.row[near.kept]
    scale = np.linalg.norm(J, axis=0)
    if len(residual) <= J.shape[1] or not scale.all() or np.linalg.matrix_rank(J / scale) < J.shape[1]:
        return None, [], []
    notes: list[str] = []
    caveats: list[str] = []
    data = problem.data
    alike, white = _alike(row, len(data)), None
    serial, note = _memory(J / scale, residual, row, data) if alike else (None, "")
    of_joints = serial is None
    if of_joints:
        serial, note, white = _joints(J / scale, residual, row, near.number[near.kept], problem, found)
        of_joints = serial is not None
    if alike and serial is None:
        serial, note, white = _shared(J / scale, residual, row, data)
    if serial is not None:
        notes.append(note)
        serial = replace(serial, covariance=serial.covariance / np.outer(scale, scale))
    whole = np.bincount(row, minlength=len(data)) == 3
    if near.kind_of_number == [near.kind] * 3 and np.sum(whole) * 3 == len(residual) and data.position is not None:
        chance = points_depend(J, residual, np.flatnonzero(whole), problem.robot, data, white, stays(data))
    else:
        chance = readings_depend(problem, found, J, residual, row, near.number[near.kept], white, stays(data))
    # Larger noise in some rows may look like an effect, but no condition explains the half of it.
    effect = condition_that_explains(problem, near) if chance.alike < CHANCE else None
    p = chance.any_size if effect is None else chance.alike
    if p < CHANCE:
        more = said("`fastcal diagnose` looks for it")
        if problem.robot.of_poses:
            more = said("the controller's poses, the lens or the board's size may be off")
        if effect is not None:
            ask = said("ask for it with --effects {effects}", effects=effect.asked)
            more = said("they depend on {condition}: {ask}", condition=effect.said, ask=ask)
        caveats.append(
            said(
                "the residuals depend on the posture (p = {p:.1g}): an effect is missing from the model, and the "
                "stated deviations and intervals do not hold; {more}",
                p=float(p),
                more=more,
            )
        )
        notes = notes[1:] if of_joints else notes  # joints that repeat badly, or what is missing: not to be told apart
    return serial, [*notes, *caveats], caveats


def _memory(
    J: FloatArray, residual: FloatArray, row: NDArray[np.int64], data: Dataset
) -> tuple[SerialCorrelation | None, str]:
    """The memory of the noise from one stay in a posture to the next, and the sentence about it.

    The first three as of `serial_correlation`.
    """
    stay = stays(data)
    if _repeats(row, stay):
        of_means = of_stays(J, residual, row, stay)
        if neighbour_correlation(*of_means, int(stay.max()) + 1) is None:
            return None, ""
    serial = serial_correlation(J, residual, row, len(data))
    return serial, "" if serial is None else said(
        "errors of successive rows are correlated ({rho:.2f}): the noise drifts, and the stated deviations allow for "
        "it",
        rho=float(serial.rho),
    )


def _joints(
    J: FloatArray,
    residual: FloatArray,
    row: NDArray[np.int64],
    number: NDArray[np.int64],
    problem: CalibrationProblem,
    found: _core.Identification,
) -> tuple[SerialCorrelation | None, str, Whitening | None]:
    """What joints that repeat badly make of the fit, the sentence about it, and what whitens numbers for them."""
    data = problem.data
    if CORNERS in data.kinds or problem.robot.passive:
        return None, "", None
    lever = whitened_levers(problem, found, row, number)
    curves = posture_features(data, problem.robot.joint_types)[row]
    repeats = joint_repeatability(J, residual, lever, curves, row, stays(data), pose_groups(data))
    if repeats is None:
        return None, "", None
    size = float(from_si(repeats.k, "mrad"))
    note = (
        said(
            "the joints repeat to about {size:.2g} mrad: errors grow with reach, rows measured in one posture share "
            "them, and the stated deviations allow for it",
            size=size,
        )
        if repeats.by_stay
        else said(
            "the joints repeat to about {size:.2g} mrad: errors grow with reach, and the stated deviations allow for "
            "it",
            size=size,
        )
    )
    return repeats.fit, note, repeats.whitened


def _shared(
    J: FloatArray, residual: FloatArray, row: NDArray[np.int64], data: Dataset
) -> tuple[SerialCorrelation | None, str, Whitening | None]:
    """What rows of one stay share, the sentence about it, and what takes it out of numbers; arguments of `_memory`."""
    stay = stays(data)
    shared = stay_correlation(J, residual, row, stay) if _repeats(row, stay) else None
    if shared is None:
        return None, "", None
    note = said(
        "errors of rows that were measured in one posture, one after the other, are alike ({rho:.2f}): the arm's "
        "error there counts once, and the stated deviations allow for it",
        rho=float(shared.rho),
    )
    return shared, note, lambda values: whitened(values, row, stay, shared.rho)


def _repeats(row: NDArray[np.int64], stay: IndexArray) -> bool:
    """Are there rows of one stay?"""
    return len(np.unique(stay[row])) < len(np.unique(row))


def _alike(row: NDArray[np.int64], count: int) -> bool:
    """Do nearly all rows with a number have as many? Only then has a row the same numbers as the one before."""
    numbers = np.bincount(row, minlength=count)
    numbers = numbers[numbers > 0]
    return bool(np.mean(numbers == np.bincount(numbers).argmax()) > _SAME_ROWS)
