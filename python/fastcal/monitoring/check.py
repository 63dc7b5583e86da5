# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a calibrated model still hold? A few poses, the instrument set up again."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fastcal.calibration.kind_noise import noise_source
from fastcal.calibration.parallel import one_blas_thread
from fastcal.design.poses import SIGMA
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, Kind, KindNoise
from fastcal.monitoring import words
from fastcal.monitoring.causes import LEVEL, explained
from fastcal.monitoring.linear import record_of
from fastcal.monitoring.result import FEWEST_DEGREES, Cause, CheckResult, KindFit
from fastcal.monitoring.setting import Setting, given, prepared
from fastcal.monitoring.setups import kind_errors
from fastcal.monitoring.single_changes import single_changes
from fastcal.monitoring.what_next import what_next
from fastcal.robot.calibration_record import LACKS_EFFECT
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
    rows, evidence = setting.rows, setting.evidence
    kinds = kind_errors(places)
    main = next(iter(kinds.values()))
    if tolerance is not None and main.kind.name != POINTS:
        raise InvalidInput(f"{measured.source}: a tolerance is of points, and none was measured")
    after = main.statistics[1]
    largest = 0.0 if after is None else after.max
    p_value = min(1.0, 2 * min(evidence.p_value, evidence.smallest_p))
    sigma = rows.noise(main.kind)
    point_sigma = sigma if main.kind.name == POINTS else record_of(robot).length_sigma or SIGMA  # of poses to come
    fits = [KindFit(of, rows.expected_rms[of.kind], _noise(setting, measured, of.kind)) for of in kinds.values()]
    causes, rivals = ([], []) if p_value >= LEVEL else explained(setting)
    enough = evidence.degrees >= FEWEST_DEGREES
    lacks = bool(robot.description.calibration.get(LACKS_EFFECT))
    verdict = _verdict(p_value, causes, enough, lacks)
    within = None
    if tolerance is not None:
        within = within_tolerance(largest, tolerance, sigma)
        if verdict == "holds" and within is None:
            verdict = "cannot_tell"
    then = what_next(setting, measured, verdict, causes, rivals, point_sigma, enough)
    return CheckResult(
        verdict=verdict,
        sentence=words.sentence(verdict, causes, within, tolerance, largest, enough),
        reasons=words.reasons(fits, p_value, evidence.degrees, places, causes),
        model=robot,
        data=measured,
        places=places,
        fits=fits,
        p_value=p_value,
        misfit_p_value=evidence.p_value,
        tolerance=tolerance,
        within_tolerance=within,
        degrees_of_freedom=evidence.degrees,
        causes=causes,
        tests=single_changes(setting),
        blind=[h.label for h, t in zip(setting.possible, evidence.tests, strict=True) if t.rank == 0 and h.odds >= 1],
        next_poses=then,
        next_act=words.next_act(verdict, causes, within, bool(then)),
        notes=notes,
        made_by=made_by(robot, measured, who),
    )


def _noise(setting: Setting, data: Dataset, kind: Kind) -> KindNoise:
    """That the rows were held against."""
    return KindNoise(kind, setting.rows.noise(kind), noise_source(data, kind))


def _verdict(p_value: float, causes: list[Cause], enough: bool, lacks: bool) -> str:
    """An effect that a model `lacks` may be new, or have been missing all along."""
    if not enough:
        return "cannot_tell"
    if p_value >= LEVEL:
        return "holds"
    if all(cause.kind == "row" or (lacks and cause.kind == "new effect") for cause in causes):
        return "cannot_tell"
    return "changed"


def within_tolerance(largest: float, tolerance: float, sigma: float) -> bool | None:
    """Is the largest distance below the tolerance, beyond doubt of its own noise (guard bands as in ISO 14253-1)?"""
    if largest <= tolerance - GUARD * sigma:
        return True
    return False if largest > tolerance + GUARD * sigma else None
