# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a calibrated model still hold? A few poses, the instrument set up again."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fastcal.calibration.parallel import one_blas_thread
from fastcal.errors import InvalidInput
from fastcal.monitoring import words
from fastcal.monitoring.causes import LEVEL, explained
from fastcal.monitoring.result import FEWEST_DEGREES, Cause, CheckResult
from fastcal.monitoring.setting import given, prepared
from fastcal.monitoring.setups import distances
from fastcal.monitoring.single_changes import single_changes
from fastcal.monitoring.what_next import what_next
from fastcal.robot.given import DataLike, RobotLike
from fastcal.robot.made_by import made_by

GUARD = 2.0  # standard deviations of a coordinate beside the tolerance within which nothing is decided


@one_blas_thread()
def check(
    model: RobotLike,
    *data: DataLike,
    tolerance: float | None = None,
    as_read: bool = False,
    who: Mapping[str, str | None] | None = None,
    threads: int = 1,
) -> CheckResult:
    """Holds a calibrated model against a few new poses; the base of each set-up of the instrument is refitted.

    Args:
        model: A calibrated robot, which keeps its covariance: model.yaml.
        data: Measured poses, five to ten; several files are several set-ups.
        tolerance: Largest distance [m] of a point from the model that is accepted.
        as_read: Take the columns as they are, though another reading fits far better.
        who: What check.json shall keep: serial, instrument, operator, date (YYYY-MM-DD).
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: The model keeps no covariance, or the data are of another robot.
        Undetermined: Too few points to fix a base.
    """
    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0):
        raise InvalidInput(f"tolerance must be above 0, got {tolerance}")
    robot, measured = given(model, data)
    setting, places, notes = prepared(robot, measured, as_read=as_read, threads=threads)
    error = distances(places)
    rms, largest = float(np.sqrt(np.nanmean(error**2))), float(np.nanmax(error))
    rows, evidence = setting.rows, setting.evidence
    p_value = min(1.0, 2 * min(evidence.p_value, evidence.smallest_p))
    sigma = float(np.sqrt(np.mean(rows.sigma[rows.is_point] ** 2)))
    causes, rivals = ([], []) if p_value >= LEVEL else explained(setting)
    enough = evidence.degrees >= FEWEST_DEGREES
    verdict = _verdict(p_value, causes, enough)
    within = None
    if tolerance is not None:
        within = _within(largest, tolerance, sigma)
        if verdict == "holds" and within is None:
            verdict = "cannot_tell"
    then = what_next(setting, measured, verdict, causes, rivals, sigma, enough)
    return CheckResult(
        verdict=verdict,
        sentence=words.sentence(verdict, causes, within, tolerance, largest, enough),
        reasons=words.reasons(rms, rows.expected_rms, p_value, evidence.degrees, places, causes),
        model=robot,
        data=measured,
        places=places,
        rms=rms,
        expected_rms=rows.expected_rms,
        largest=largest,
        p_value=p_value,
        misfit_p_value=evidence.p_value,
        tolerance=tolerance,
        within_tolerance=within,
        degrees_of_freedom=evidence.degrees,
        sigma=sigma,
        causes=causes,
        tests=single_changes(setting),
        blind=[h.label for h, t in zip(setting.possible, evidence.tests, strict=True) if t.rank == 0 and h.odds >= 1],
        next_poses=then,
        next_act=words.next_act(verdict, causes, within, bool(then)),
        notes=notes,
        made_by=made_by(robot, measured, who),
    )


def _verdict(p_value: float, causes: list[Cause], enough: bool) -> str:
    if not enough:
        return "cannot_tell"
    if p_value >= LEVEL:
        return "holds"
    if all(cause.kind == "row" for cause in causes):
        return "cannot_tell"
    return "changed"


def _within(largest: float, tolerance: float, sigma: float) -> bool | None:
    """Is the largest distance below the tolerance, beyond doubt of its own noise (guard bands as in ISO 14253-1)?"""
    if largest <= tolerance - GUARD * sigma:
        return True
    return False if largest > tolerance + GUARD * sigma else None
