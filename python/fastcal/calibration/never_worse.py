# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibration is never worse on its own rows than the nominal arm with base and tool fitted.

A robust fit can end where it leaves half of the rows out and misses them by more than before, or nowhere at all: where
an effect is missing, rows err by a curve, and a redescending loss follows one end of it. So a fit is set beside base
and tool alone, and beside fits that leave fewer rows out. Rows that a fit lists as outliers and that base and tool
alone miss as well are gross, whatever is fitted, and no argument; nor are rows of a part that moved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from fastcal import _core
from fastcal.arrays import BoolArray, FloatArray, IndexArray
from fastcal.calibration.asked_conditions import share_a_condition
from fastcal.calibration.parameter_limits import PRIOR_SIZES
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residual_checks import Cleared
from fastcal.calibration.shrinkage import start_of
from fastcal.said import Said, said

MANY = 0.1  # of the rows left out: then fits that leave fewer out are looked at
_AS_FAR = 3.0  # times what base and tool alone miss a gross row by: they lie between all rows, up to half of them gross
CLEARLY = 0.8  # of what a converged fit misses rows by on average: another that misses them by less is the better one
_SAME = 1e-6  # relative: rounding


@dataclass(frozen=True, eq=False)
class Chosen:
    """The fit that is reported.

    Attributes:
        problem, found: What was fitted, and how.
        why: A sentence where it is not the fit that was asked for; else empty.
        frames_only: Are base and tool all that could be identified?
        pull: By what the geometry was held, as options of `identify`.
    """

    problem: CalibrationProblem
    found: _core.Identification
    why: str = ""
    frames_only: bool = False
    pull: dict[str, FloatArray] = field(default_factory=dict)


class Errors:
    """How far rows are off, each kind of observation in units of its median with base and tool alone."""

    def __init__(self, problem: CalibrationProblem) -> None:
        self._problem = problem
        raw = self._raw(start_of(problem))
        typical = np.array([np.median(part[~np.isnan(part)]) if (~np.isnan(part)).any() else 1.0 for part in raw.T])
        self._unit = np.where(typical > 0, typical, 1.0)
        self.before = self.of(start_of(problem))

    def _raw(self, theta: FloatArray) -> FloatArray:
        """(N, kinds) lengths of the errors, NaN where not measured."""
        p = self._problem
        r = np.asarray(_core.residuals(p.model, p.samples, p.measured, theta, p.threads))
        parts = [r[:, of.first_number : of.first_number + len(of.components)] for of in p.measured.observations]
        return np.column_stack([np.linalg.norm(part, axis=1) for part in parts])

    def of(self, theta: FloatArray) -> FloatArray:
        """(N,) of rows, NaN where nothing was measured: root mean square over its kinds."""
        square = (self._raw(theta) / self._unit) ** 2
        count = np.sum(~np.isnan(square), axis=1)
        return np.sqrt(np.where(count > 0, np.nansum(square, axis=1) / np.maximum(count, 1), np.nan))


def never_worse(
    whole: CalibrationProblem,
    fit: Cleared,
    refit: Callable[..., _core.Identification],
) -> Chosen:
    """The fit, or another one where it did not converge, is worse than base and tool, or leaves out rows for nothing.

    Args:
        whole: The problem of all rows.
        fit: Its fit, or that of the rows that belong together.
        refit: Identifies a problem with the same options, and more where they are given.
    """
    found = fit.found
    errors = Errors(whole)
    judged = ~np.isnan(errors.before)
    judged[fit.moved] = False
    if found.status == "too_few_equations":
        return _frames_only(whole, found)
    if not judged.any():
        return Chosen(fit.problem, found)
    left_out = np.union1d(_left_out(whole, found), fit.set_aside).astype(np.intp)
    holds = found.status == "converged" and not _is_worse(errors, found, left_out, judged)
    few = np.sum(judged[left_out]) <= MANY * judged.sum()
    if holds and few and not _is_worse(errors, found, left_out[:0], judged):
        return Chosen(fit.problem, found)
    if few and found.status == "converged" and set(fit.problem.asked) <= set(_frames(fit.problem)):
        return Chosen(fit.problem, found)  # what it is set beside is itself, by another loss
    best = Chosen(fit.problem, found) if holds else None
    # Rows of one load or approach are no outliers, however well the others agree: then every row counts in full.
    missed = _mean_square if not few and share_a_condition(whole.data, left_out, judged) else _missed
    # A few rows that the fit gives up, for more than it gains on the others, are an end of a curve, or gross.
    clearly = 1.0 if few or missed is _mean_square else CLEARLY
    least = clearly * missed(errors, found, judged) if holds else np.inf
    reason = _reason(found)
    if holds:
        reason = said("leaves out {count} rows that a fit of all rows reaches", count=len(left_out))
    for other, how, pull in _others(fit.rest):
        if pull and best is not None:
            break
        again = refit(other, **pull)
        # Beside a fit that converged and leaves few rows out, another must hold on all of them.
        out = np.asarray([] if few and found.status == "converged" else again.outliers, dtype=np.intp)
        if again.status != "converged" or _is_worse(errors, again, out, judged):
            continue
        left = missed(errors, again, judged)
        if left < least * (1 - _SAME):
            why = said("the fit with the loss {loss} {why}: the result is {how}", loss=whole.loss, why=reason, how=how)
            best, least = Chosen(other, again, why, pull=pull), left
    return best or _frames_only(fit.rest, found)


def is_worse(whole: CalibrationProblem, found: _core.Identification, moved: list[int]) -> bool:
    """Is a fit worse than base and tool alone, but for its gross rows and those `moved`?"""
    errors = Errors(whole)
    judged = ~np.isnan(errors.before)
    judged[moved] = False
    return bool(judged.any()) and _is_worse(errors, found, _left_out(whole, found), judged)


def _left_out(whole: CalibrationProblem, found: _core.Identification) -> IndexArray:
    """Rows that the fit makes little of: by least squares its outliers count as all others do."""
    return np.asarray([] if whole.loss == "none" else found.outliers, dtype=np.intp)


def _others(problem: CalibrationProblem) -> Iterator[tuple[CalibrationProblem, Said, dict[str, FloatArray]]]:
    """Fits that leave fewer rows out, in words, and last one that is held near nominal."""
    yield problem.with_(loss="none"), said("that of least squares"), {}
    if problem.loss not in ("huber", "none"):
        yield problem.with_(loss="huber"), said("that with the loss huber, which leaves fewer rows out"), {}
    held = np.full(len(problem.parameters) + problem.unknown_count, np.inf)
    for i, parameter in enumerate(problem.parameters[: len(problem.model.robot.nominal)]):
        if parameter.owner not in ("base", "tool"):
            held[i] = PRIOR_SIZES * parameter.sigma
    yield (
        problem.with_(loss="none"),
        said("that of least squares with the geometry held near nominal"),
        {"pull_mean": start_of(problem), "pull_sigma": held},
    )


def _frames(problem: CalibrationProblem) -> list[int]:
    """Which of the asked parameters are the numbers of base, tool and set-ups."""
    own = len(problem.model.robot.nominal)
    return [
        i
        for i in problem.asked
        if problem.parameters[i].owner in ("base", "tool") and (i < own or problem.parameters[i].unit in ("m", "rad"))
    ]


def _frames_only(problem: CalibrationProblem, found: _core.Identification) -> Chosen:
    """Base, tool and set-ups alone."""
    alone = problem.with_(asked=_frames(problem), loss="none")
    again = alone.identify()
    if again.status != "converged":
        return Chosen(problem, found)
    if found.status == "too_few_equations":
        return Chosen(alone, again, f"{found.message}; base and tool alone are fitted", frames_only=True)
    why = said(
        "the requested parameters could not be identified: the fit {why}; base and tool alone are fitted",
        why=_reason(found),
    )
    return Chosen(alone, again, why, frames_only=True)


def _reason(found: _core.Identification) -> Said:
    return said("did not converge") if found.status != "converged" else said("has larger errors than the nominal arm")


def _is_worse(errors: Errors, found: _core.Identification, left_out: IndexArray, judged: BoolArray) -> bool:
    """Is it worse than base and tool alone, over the rows (N,) `judged`, gross ones but those?"""
    after = errors.of(np.asarray(found.theta))
    used = judged.copy()
    used[left_out[after[left_out] <= _AS_FAR * errors.before[left_out]]] = False
    if not used.any():
        return False
    return not np.mean(after[used] ** 2) <= np.mean(errors.before[used] ** 2) * (1 + _SAME)


def _mean_square(errors: Errors, found: _core.Identification, judged: BoolArray) -> float:
    """Mean square error of all rows."""
    return float(np.mean(errors.of(np.asarray(found.theta))[judged] ** 2))


def _missed(errors: Errors, found: _core.Identification, judged: BoolArray) -> float:
    """Mean error of all rows: a tenth of gross ones decides nothing, and no row is left out."""
    return float(np.mean(errors.of(np.asarray(found.theta))[judged]))
