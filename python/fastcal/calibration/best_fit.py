# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The fit that a calibration reports (free, or held near nominal if poses are few) and the checks of its residuals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.curvature import bend, bend_caveat, is_bent
from fastcal.calibration.geometry_anchoring import pulls
from fastcal.calibration.kind_noise import noise_by_kind, scaled
from fastcal.calibration.never_worse import is_worse, never_worse
from fastcal.calibration.problem import CalibrationProblem
from fastcal.calibration.residual_checks import MOST_ROWS, Checks, Cleared, cleared, noise_and_posture
from fastcal.calibration.residuals import Residuals, near_fit
from fastcal.calibration.shrinkage import Shrinkage, shrinkage
from fastcal.calibration.variance_components import noise_of_own_freedom
from fastcal.measurements.kinds import KindNoise
from fastcal.robot.calibration_record import lower_root

FloatArray = NDArray[np.float64]

LEAST_SQUARES = ("nls", "ceres")
_EASED = 10  # times that a hold is tried, each half as firm, where its fit is worse than base and tool on its own rows


@dataclass(frozen=True, eq=False)
class Way:
    """How to fit.

    Attributes:
        method, max_iterations: Of the solver: nls, ceres (trust region alone), bfgs or bfgs_mean_distance.
        priors: Hold all parameters near nominal.
        by_evidence: Hold the geometry where poses are few for their noise.
        checks: Look at the residuals.
    """

    method: str = "nls"
    max_iterations: int = 100
    priors: bool = False
    by_evidence: bool = True
    checks: bool = True


@dataclass(frozen=True, eq=False)
class BestFit:
    """A fit and what is known of it.

    Attributes:
        problem: What was fitted, all its rows among it.
        found: The fit.
        checks: What its residuals say.
        held: How the geometry was held near nominal; None where it was free.
        limits: Bounds, priors and pulls by which the solver was held.
        status, message: Of the calibration: those of the fit that was asked for, where base and tool alone are left.
        reaches: (p, 2) of a free fit that bends, how far intervals reach down and up (`bent_intervals`).
    """

    problem: CalibrationProblem
    found: _core.Identification
    checks: Checks = field(default_factory=Checks)
    held: Shrinkage | None = None
    limits: dict[str, FloatArray] = field(default_factory=dict)
    status: str = ""
    message: str = ""
    reaches: FloatArray | None = None

    def uncertainty(self) -> tuple[FloatArray, FloatArray, dict[str, KindNoise], int]:
        """Covariance (p, p) of the free parameters, its lower root, the noise by kind, and its degrees of freedom."""
        found, serial = self.found, self.checks.serial
        covariance, root = np.asarray(found.covariance), np.asarray(found.covariance_root)
        noise, freedom = noise_by_kind(self.problem.measured, found), float(found.degrees_of_freedom)
        if serial is not None and "prior_sigma" not in self.limits:
            covariance, noise, freedom = serial.covariance, scaled(noise, serial.noise), serial.freedom
            root = lower_root(covariance)
        if self.held is not None:
            covariance, factor, freedom = self.held.posterior(covariance, list(found.free), freedom)
            root, noise = lower_root(covariance), scaled(noise, factor)
        return covariance, root, noise, round(freedom)


def best_fit(problem: CalibrationProblem, way: Way, row_count: int) -> BestFit:
    """Fits a problem whose options are set, of `row_count` rows in all, as far as its rows bear it."""
    options: dict[str, Any] = {"method": way.method}
    pulled = pulls(problem)
    # Curves creep along what they share with geometry.
    options["max_iterations"] = way.max_iterations * (5 if pulled else 1)
    limits = {**problem.limits(priors=way.priors), **pulled}

    def identify(problem: CalibrationProblem, **more: FloatArray) -> _core.Identification:
        found = problem.identify(**options, **limits | more)
        own = None if way.priors or pulled or more else noise_of_own_freedom(problem, found)
        return found if own is None else problem.identify(**options, **limits, noise=own)

    found = identify(problem)
    status, message = found.status, found.message
    if way.method not in LEAST_SQUARES or row_count > MOST_ROWS:
        return BestFit(problem, found, limits=limits, status=status, message=message)
    if not way.checks or found.status != "converged":
        fit = Cleared(problem, found, problem)
    else:
        fit = cleared(problem, found, identify)
    chosen = never_worse(problem, fit, identify)
    part, found, notes = chosen.problem, chosen.found, [*fit.notes, *([chosen.why] if chosen.why else [])]
    if chosen.frames_only:
        status, message, notes = status if status != "converged" else "not_converged", chosen.why, fit.notes
    elif chosen.why:
        status, message = found.status, found.message
    if fit.refusal is not None:
        status, message = "not_converged", fit.refusal
    limits |= chosen.pull
    held = None
    if way.by_evidence and not way.priors and not pulled and not chosen.pull and status == "converged":
        found, held = _held(problem, part, found, fit.moved, identify)
        limits |= {} if held is None else held.pull
    near = near_fit(part, found) if way.checks and found.status == "converged" else None
    serial, more, caveats = (None, [], []) if near is None else noise_and_posture(near, part, found)
    is_free = not limits and held is None and serial is None
    follows, bent = (None, "") if near is None else _bent(near, part, limits, is_free=is_free)
    also = [bent] if bent else []
    aside = [*fit.moved, *([] if chosen.why else fit.set_aside)]
    checks = Checks(serial, [*notes, *more, *also], aside, [*caveats, *also], bent, notes)
    return BestFit(problem, found, checks, held, limits, status, message, follows)


def _bent(
    near: Residuals, problem: CalibrationProblem, limits: dict[str, FloatArray], *, is_free: bool
) -> tuple[FloatArray | None, str]:
    """How far the intervals of a fit that bends in them reach, if nothing but the rows holds it, and the caveat."""
    size = bend(near, problem, limits)
    if not is_bent(size):
        return None, ""
    from fastcal.calibration.bent_intervals import reaches  # SciPy takes longer to import than a fit

    return (reaches(near, problem) if is_free else None), bend_caveat(size, follows=is_free)


def _held(
    whole: CalibrationProblem,
    part: CalibrationProblem,
    found: _core.Identification,
    moved: list[int],
    refit: Callable[..., _core.Identification],
) -> tuple[_core.Identification, Shrinkage | None]:
    """The fit with its geometry held near nominal, and how; the free one and None where that does as well."""
    held = shrinkage(part, found)
    if held is None:
        return found, None
    for _ in range(_EASED):
        again = refit(part, **held.pull)
        if again.status == "converged" and not is_worse(whole, again, moved):
            return again, held
        held = held.eased()
    return found, None
