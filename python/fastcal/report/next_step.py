# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""After a calibration: is what remains more than noise, and what to do about it, in one line."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fastcal.measurements.kinds import KindMisfit
from fastcal.measurements.observations import sigma_field
from fastcal.report.formatting import percent, significant
from fastcal.report.language import _, decimal_sign
from fastcal.report.trends import Trend
from fastcal.report.view import Rows, rows_of
from fastcal.report.words import listed
from fastcal.said import parts_of_failure
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.calibration.result import CalibrationResult

MORE_THAN_NOISE = 1.3  # times the RMS error that the known noise would make
_MOST = 2  # variables that are named


def next_step(result: CalibrationResult, arguments: Sequence[str] = ()) -> str:
    """One line; with the `arguments` of a diagnosis it ends with the command to run next."""
    return _("next: {step}", step=step(result, arguments))


def step(result: CalibrationResult, arguments: Sequence[str] = (), *, is_why_told: bool = False) -> str:
    """What to do after a calibration, as part of a sentence; `is_why_told`: the verdict says already what remains."""
    if result.status != "converged":
        return _after_failure(result)
    if result.misfits:
        look = look_at(result.misfits[0])
        return look if decimal_sign() == "," else f"{look[0].lower()}{look[1:]}"
    if result.model.of_poses:
        if result.test is None:
            return _("check it on pictures that were not fitted (--test and --test-corners)")
        return _("write where the camera is for other programs (--hand-eye)")
    rows = rows_of("Training", result.train, result.model.joint_types)
    if rows is None:
        return _("no measurement shows how large the remaining error is")
    more = what_remains(result, rows, rows.trends)
    command = shlex.join(["fastcal", "diagnose", *arguments])
    if more is None:
        if known_floor(result) is None:
            return _(
                "no trend shows in what remains, but neither repeated poses nor a sigma column say how much of "
                "it is noise; look closer with: {command}",
                command=command,
            )
        if result.test is None:
            return _("what remains looks like noise; check the model on other poses (--test, or fastcal evaluate)")
        return _("what remains looks like noise; the model is ready for fastcal compensate")
    is_why_told = is_why_told and bool(result.caveats or _flagged(rows.trends))
    return _find("" if is_why_told else more, command)


def _after_failure(result: CalibrationResult) -> str:
    """What the failure itself asks for, where it knows."""
    if result.doubts:
        return _("resolve the warnings, then calibrate again")
    _why, act = parts_of_failure(result.message)
    return _(act) if act else _("measure more poses, or more varied ones; `fastcal design` chooses them")


def look_at(misfit: KindMisfit) -> str:
    """What to look at where a kind of reading does not belong to the arm or to the others."""
    return _(
        "Check the {kind}: the unit and the frame of their columns, and whether each was read in the posture of its "
        "row",
        kind=_(misfit.kind.plural),
    )


def what_remains(result: CalibrationResult, rows: Rows, trends: dict[str, Trend]) -> str | None:
    """Why what remains is more than noise; None where nothing indicates that.

    It is more where the residuals follow the posture or a recorded variable, or where those that are no outliers
    exceed a noise that is known without the model: from repeated poses, else from the data's sigma column.
    """
    titles = {variable.name: variable.title for variable in rows.variables}
    flagged = _flagged(trends)
    if flagged:
        named = listed([f"{titles[name]} ({percent(trends[name].share, ' ')})" for name in flagged[:_MOST]])
        return _("the remaining error is not all noise: it depends on {named}", named=named)
    if result.lacks_effect:
        return _("the residuals depend on the posture: an effect is missing from the model")
    floor, unit = known_floor(result), rows.unit
    rms = float(np.sqrt(np.nanmean(np.delete(rows.error_after, result.train.places(result.outliers)) ** 2)))
    if floor is not None and rms > MORE_THAN_NOISE * floor:
        return _(
            "RMS {size} {unit} remains, where the known noise accounts for {noise} {unit}",
            size=significant(rms),
            noise=significant(floor),
            unit=unit,
        )
    return None


def _find(why: str, command: str) -> str:
    if not why:
        return _("find the cause with: {command}", command=command)
    return _("{why}; find the cause with: {command}", why=why, command=command)


def _flagged(trends: dict[str, Trend]) -> list[str]:
    """Variables that what remains follows, the strongest first."""
    return sorted((n for n, t in trends.items() if t.is_flagged(len(trends))), key=lambda n: -trends[n].share)


def known_floor(result: CalibrationResult) -> float | None:
    """RMS error of a reading that noise would make, in its unit, where the noise is known without the model."""
    main = result.train.main
    if main is None:
        return None
    if main.kind.name in result.train.repeats:
        return float(main.kind.shown(result.train.repeats[main.kind.name].sigma) * np.sqrt(main.width))
    claims = result.train.data.table(sigma_field(main.kind.name))
    if claims is None:
        return None
    return float(from_si(np.sqrt(np.nanmean(claims**2)), main.kind.unit) * np.sqrt(main.width))
