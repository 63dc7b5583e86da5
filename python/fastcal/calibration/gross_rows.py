# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Gross errors that a robust fit cannot reject: a fit to the consistent rows, or a refusal if there is no majority."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import BoolArray, IntArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.asked_conditions import explains_gross
from fastcal.calibration.consensus import GROSS, Rows, agreeing_rows, leave_freedom
from fastcal.calibration.lack_of_fit import points_depend
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residuals import Residuals, near_fit
from fastcal.measurements.kinds import POINTS, kind_named
from fastcal.measurements.observations import without_measured
from fastcal.measurements.row_words import rows_in_files
from fastcal.said import failure, first_few, said
from fastcal.units import from_si

Refit = Callable[[CalibrationProblem], _core.Identification]

_LOOSE_FRAMES = 10.0  # plausible sizes by which gross rows may have moved base and tool off their rigid fit
_SMOOTH = 1e-6  # chance of rows that seem to depend on the posture
_LARGEST_EFFECT = 0.01  # of the reach: farther off, rows are gross even where they depend on the posture
_LIMIT = 0.01  # share of data sets in which a sound row is left out
_ROUNDS = 5
_MOST_BESIDE = 0.5  # of the rows that agree may agree with one another on another fit
_LOOSE = 1e-6  # holds what the rows do not show
_SHARPER = 1 / 3  # of the noise of the rows that agree: fewer others that are so much sharper count as well


@dataclass(frozen=True, eq=False)
class Majority:
    """What was made of the rows.

    Attributes:
        found, problem: The fit, and the problem without the rows that were set aside.
        set_aside: These rows.
        refusal: Why there is no answer; None where there is one.
        notes: Of rows that agree on another fit.
    """

    found: _core.Identification
    problem: CalibrationProblem
    set_aside: list[int] = field(default_factory=list)
    refusal: str | None = None
    notes: list[str] = field(default_factory=list)


def majority(problem: CalibrationProblem, found: _core.Identification, refit: Refit) -> Majority:
    """The fit of the rows that agree.

    Refused where fewer than half of the points agree with it, since others might agree on anything, and where enough
    of the others agree with one another on another fit as well.
    """
    near = near_fit(problem, found)
    if found.loss == "none" or near is None:
        return Majority(found, problem)
    rows, places = _points(near)
    if not leave_freedom(len(places), len(found.free)):
        return Majority(found, problem)
    agree = agreeing_rows(_nominal(problem, near, rows, found), ~np.isin(places, found.outliers), near.scale)
    out = Majority(found, problem)
    if agree is not None and not _smooth(problem, near, rows, places, agree):
        out = _refitted(problem, found, refit, places, agree)
    gross = np.isin(places, [*out.set_aside, *out.found.outliers])
    refusal, notes = _judged(problem, out.found, places, gross)
    if not refusal and not notes:
        return out
    near = near_fit(problem, out.found) or near
    explained = explains_gross(problem, near, np.isin(near.row, places[gross]))
    if explained is None:
        return replace(out, refusal=refusal, notes=notes)
    note = said(
        "{count} rows lie elsewhere ({rows}), as they depend on {condition}, and nothing moved: ask for it with "
        "--effects {effects}; all rows are used",
        count=int(gross.sum()),
        rows=first_few(places[gross].tolist()),
        condition=explained.said,
        effects=explained.asked,
    )
    return Majority(found, problem, notes=[note])


def _points(near: Residuals) -> tuple[IntArray, IntArray]:
    """(n, 3) which numbers are the whole points, and (n,) their rows."""
    numbers = np.flatnonzero(near.of(kind_named(POINTS)))
    row = near.row[numbers]
    places = np.flatnonzero(np.bincount(row) == 3)
    return numbers[np.isin(row, places)].reshape(-1, 3), places


def _nominal(problem: CalibrationProblem, near: Residuals, rows: IntArray, found: _core.Identification) -> Rows:
    """The points, linearized about the fit, with the arm's parameters nominal: there small sets of rows hold them."""
    parameters = problem.model.parameters
    frames = np.array([p.owner in ("base", "tool") for p in parameters])
    size = np.array([p.sigma for p in parameters]) * np.where(frames, _LOOSE_FRAMES, 1.0)
    size = np.concatenate([size, np.ones(problem.unknown_count)])
    back = np.zeros(len(size))
    back[: len(parameters)] = np.where(frames, 0.0, problem.model.start - np.asarray(found.theta)[: len(parameters)])
    J = near.J[rows.ravel()]
    residual = near.residual[rows.ravel()] + J @ back
    columns = (J * size)[:, found.asked].reshape(len(rows), 3, -1)
    return Rows(columns, residual.reshape(-1, 3), len(found.free))


def _smooth(problem: CalibrationProblem, near: Residuals, rows: IntArray, places: IntArray, agree: BoolArray) -> bool:
    """Are the other rows off by a smooth function of the posture or the load, as of an effect that the model lacks?"""
    J = near.J[:, near.free]
    inside, others = rows[agree].ravel(), rows[~agree].ravel()
    residual = near.residual - J @ np.linalg.lstsq(J[inside], near.residual[inside], rcond=None)[0]
    off = near.scale * np.sqrt(np.mean(residual[others] ** 2))
    if off > _LARGEST_EFFECT * problem.robot.reach:
        return False
    return points_depend(J[others], residual[others], places[~agree], problem.robot, problem.data).alike < _SMOOTH


def _refitted(
    problem: CalibrationProblem, found: _core.Identification, refit: Refit, places: IntArray, agree: BoolArray
) -> Majority:
    """Fits the rows that agree, takes in what their noise explains, and again until these are the same."""
    from scipy import special  # see find_shift

    limit = special.chdtri(3, _LIMIT / len(places))
    for _ in range(_ROUNDS):
        aside = places[~agree]
        cleared = without_measured(problem.data, aside)
        part = problem.with_(data=cleared, measured=measurements(cleared, problem.robot))
        again = refit(part)
        near = near_fit(problem, again)
        if again.status != "converged" or near is None or len(again.free) < len(found.free):
            return Majority(found, problem)
        rows, _ = _points(near)
        before, agree = agree, np.sum(near.residual[rows] ** 2, axis=1) <= limit
        if (agree == before).all():
            break
    return Majority(again, part, aside.tolist())


def _judged(
    problem: CalibrationProblem, found: _core.Identification, places: IntArray, gross: BoolArray
) -> tuple[str | None, list[str]]:
    """Why the fit of the rows that are not gross is no answer; else notes on those that are.

    Where labels show which rows belong to one set-up, no other set-up is looked for.
    """
    near = near_fit(problem, found)
    if near is None or not gross.any():
        return None, []
    noise = float(from_si(near.scale, "mm"))
    agreeing = int(np.sum(~gross))
    if 2 * agreeing < len(places):
        why = said(
            "only {agreeing} of {rows} rows agree with one another, to {noise:.2g} mm ({which}); where fewer than half "
            "do, others may be right",
            agreeing=agreeing,
            rows=len(places),
            noise=noise,
            which=rows_in_files(problem.data, places[~gross]),
        )
        return failure(why, said("measure again, or leave the bad rows out")), []
    rows, _ = _points(near)
    far = gross & (np.mean(near.residual[rows] ** 2, axis=1) > GROSS**2)
    labelled = problem.data.station is not None or problem.data.mount is not None
    if labelled or 3 * np.sum(far) - len(found.free) < np.sum(far):  # too few to agree on anything
        return None, []
    others = _nominal(problem, near, rows[far], found)
    better = agreeing_rows(others, np.ones(others.count, dtype=bool), near.scale)
    agree = np.ones(others.count, dtype=bool) if better is None else better
    own = others.noise(agree, _LOOSE)
    if own > 1 / _SHARPER:
        return None, []
    why = said(
        "{agreeing} rows agree with one another to {noise:.2g} mm, and {others} others to {own:.2g} mm on another fit "
        "({rows}): the tracker, the base or the target moved between them",
        agreeing=agreeing,
        noise=noise,
        others=int(agree.sum()),
        own=own * noise,
        rows=rows_in_files(problem.data, places[far][agree]),
    )
    text = failure(why, said("give the two parts different `station` or `mount` labels"))
    refused = own < _SHARPER or agree.sum() >= _MOST_BESIDE * agreeing
    if refused:
        return text, []
    return None, [said("{text}; only the {agreeing} are used", text=text, agreeing=agreeing)]
