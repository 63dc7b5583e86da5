# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Intrinsics that the file calls known and the pictures contradict, identified after all.

A lens is let free where it explains much of what the fit leaves, and where pictures of postures that were held out are
predicted better with it: with e_i and f_i the RMS of a held-out posture's corners with the lens as stated and freed,

    d_i = log(f_i / e_i),   mean(d) < log(_BETTER),   mean(d) < -_SURE std(d) / sqrt(n).

Logarithms, so that no picture that is far off decides; postures, since the corners of one err together. All cameras are
judged together, since one wrong lens hides what another does; then each that need not be free is held again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.best_fit import LEAST_SQUARES, BestFit, Way, best_fit
from fastcal.calibration.lens_columns import explained_by_lens, known_lenses, lens_note, with_lenses
from fastcal.calibration.pose_folds import pose_folds
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residual_checks import MOST_ROWS
from fastcal.calibration.residuals import near_fit
from fastcal.calibration.unknowns import CORNERS
from fastcal.measurements.observations import without_measured
from fastcal.said import Said, joined, said

_TRIED = 0.2  # of the squares that a lens must explain to be tried
_BETTER, _SURE = 0.9, 4.5  # the factor of held-out errors, and its standard errors: at 3, one set of thirty was wrong
_EACH = 2.0  # standard errors by which each camera of several must do so
_FOLDS, _FEWEST = 5, 10  # postures


@dataclass(frozen=True, eq=False)
class FreedLenses:
    """A problem with lenses that are no longer held.

    Attributes:
        problem: With them.
        cameras: Whose.
        before, after: The median RMS of the corners of a held-out posture [px].
    """

    problem: CalibrationProblem
    cameras: tuple[str, ...]
    before: float
    after: float

    def note(self, *, is_used: bool) -> Said:
        """A sentence for a reader; `is_used`: these lenses are identified."""
        values: dict[str, Any] = {
            "names": joined(" and ", [f"camera {name}" for name in self.cameras]),
            "before": self.before,
            "after": self.after,
        }
        if is_used:
            return said(
                "the pictures contradict the lens stated for {names}: it is identified, and held-out pictures are "
                "predicted to {after:.2g} px (median) instead of {before:.2g} px; --as-read keeps the stated lens",
                **values,
            )
        return said(
            "the pictures contradict the lens stated for {names}: with it identified, held-out pictures would be "
            "predicted to {after:.2g} px (median) instead of {before:.2g} px; --mend identifies it",
            **values,
        )


def with_freed_lenses(fit: BestFit, way: Way, row_count: int, *, mend: bool) -> tuple[BestFit, list[str]]:
    """The fit, with `mend` that with the lenses free that its pictures contradict, and what is said of lenses.

    `way` and `row_count` as of `best_fit`.
    """
    if way.method not in LEAST_SQUARES or row_count > MOST_ROWS or fit.problem.long is not None:
        return fit, []
    found = freed_lenses(fit)
    if found is None:
        near = near_fit(fit.problem, fit.found) if fit.status == "converged" else None
        note = None if near is None else lens_note(fit.problem, near)
        return fit, [] if note is None else [note]
    again = best_fit(found.problem, way, row_count) if mend else fit
    is_used = mend and again.status == "converged"
    return again if is_used else fit, [found.note(is_used=is_used)]


def freed_lenses(fit: BestFit) -> FreedLenses | None:
    """The problem of a fit with the lenses free that its pictures contradict; None where they contradict none."""
    problem, near = fit.problem, near_fit(fit.problem, fit.found) if fit.status == "converged" else None
    known = known_lenses(problem)
    if near is None or not known:
        return None
    if not explained_by_lens(problem, near) > _TRIED:
        return None
    shares = {name: explained_by_lens(problem, near, [name]) for name in known}
    freed = [name for name in known if shares[name] > 0]
    seen = np.isfinite(problem.data.observed[CORNERS]).any(axis=1)
    if not freed or seen.sum() < _FEWEST:
        return None
    fold = pose_folds(problem.data, _FOLDS, np.random.default_rng(0))
    folds = [np.flatnonzero(fold == k) for k in range(_FOLDS)]
    before, after = held_out(problem, folds), held_out(with_lenses(problem, freed), folds)
    if before is None or after is None or not predicts_better(before, after):
        return None
    for name in sorted(freed, key=lambda name: shares[name]):
        others = [other for other in freed if other != name]
        held = held_out(with_lenses(problem, others), folds) if others else None
        if held is not None and not predicts_better(held, after, 1.0, _EACH):
            freed, after = others, held
    errors = [float(np.nanmedian(of)) for of in (before, after)]
    return FreedLenses(with_lenses(problem, freed), tuple(freed), *errors)


def held_out(problem: CalibrationProblem, folds: Sequence[IndexArray]) -> FloatArray | None:
    """(N,) RMS of the corners of each row [px], predicted by the rows of other folds; None where a fit fails."""
    out = np.full(len(problem.data), np.nan)
    of = next(of for of in problem.measured.observations if of.field == CORNERS)
    own = slice(of.first_number, of.first_number + len(of.components))
    for held in folds:
        data = without_measured(problem.data, held)
        found = problem.with_(data=data, measured=measurements(data, problem.robot)).identify()
        if found.status != "converged":
            return None
        r = np.asarray(
            _core.residuals(problem.model, problem.samples, problem.measured, np.asarray(found.theta), problem.threads)
        )[held, own]
        corners = np.sum(np.isfinite(r), axis=1) / 2
        some = corners > 0
        out[held[some]] = np.sqrt(np.nansum(r[some] ** 2, axis=1) / corners[some])
    return out


def predicts_better(before: FloatArray, after: FloatArray, factor: float = _BETTER, sure: float = _SURE) -> bool:
    """Are held-out errors (N,) smaller than those before, by a factor and by so many standard errors?"""
    both = (before > 0) & (after > 0)
    if both.sum() < _FEWEST:
        return False
    d = np.log(after[both] / before[both])
    error = float(d.std(ddof=1)) / np.sqrt(len(d))
    return bool(d.mean() < np.log(factor) and d.mean() < -sure * error)
