# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The verdict on a calibration in sentences: what was reached, on which poses, and what to be careful about."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from fastcal.report.formatting import alike, count, percent, plural, significant
from fastcal.report.language import _, retold
from fastcal.report.tables import capitalised, unit_text
from fastcal.report.trends import Trend
from fastcal.report.view import Rows, Statistics
from fastcal.said import Said, parts_of_failure
from fastcal.units import from_si

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fastcal.calibration.calibrate import CalibrationResult
    from fastcal.calibration.camera_places import CameraPlace

_WORSE_ON_TEST = 1.3
_NO_GAIN = 0.97
_MANY_OUTLIERS = 0.05


@dataclass(frozen=True)
class Remark:
    """A sentence under the verdict; `is_caution` where a reader should doubt, `link` the section that shows it."""

    text: str
    is_caution: bool
    link: str


@dataclass(frozen=True)
class Verdict:
    """The page's first sentence, its word (`tone`: good, caution or bad), what is to be added, and what to do now."""

    tone: str
    word: str
    headline: str
    remarks: list[Remark] = field(default_factory=list)
    acts: list[str] = field(default_factory=list)


def verdict(result: CalibrationResult, train: Rows | None, test: Rows | None, trends: dict[str, Trend]) -> Verdict:
    """The verdict; `trends` are those of the training residual after calibration, by the name of the variable."""
    remarks = [_unidentifiable(result)]
    if result.status != "converged":
        remarks = []  # nothing that holds for a model of this arm
    elif train is not None:
        remarks = [_on_test(train, test), _what_remains(train, trends), *remarks, *_outlying(result, train)]
    remarks = [
        *_misfits(result),
        *_doubts(result),
        *_caveats(result),
        *_shape(result),
        *camera_remarks(result.cameras),
        *remarks,
    ]
    if result.status != "converged":
        headline = _(
            "The calibration failed: {reason}. The figures show where it stopped.",
            reason=ending(parts_of_failure(result.message)[0]),
        )
        failures = {"not_converged": _("Not converged"), "too_few_equations": _("Too few measurements")}
        return Verdict("bad", failures.get(result.status, _("Failed")), headline, remarks)
    rows = test or train
    if rows is None:
        headline = _("The calibration converged, but no measurements remain to judge its accuracy.")
        return Verdict("caution", _("Not judged"), headline, remarks)
    before, after = trusted(result, rows, is_test=test is not None)
    left_out = rows.after.count - after.count
    if test:
        where = _("{poses} not used in the fit", poses=plural(rows.judged_count, "test pose"))
    elif left_out:
        where = _(
            "{kept} of the {poses} of the fit, the others being outliers",
            kept=count(after.count),
            poses=plural(rows.judged_count, "pose"),
        )
    else:
        where = _("the {poses} of the fit", poses=plural(rows.judged_count, "pose"))
    numbers = {
        "before": _size(before.mean, after.mean, rows.unit),
        "after": _size(after.mean, after.mean, rows.unit),
        "where": where,
    }
    is_careful = any(remark.is_caution for remark in remarks)
    word = _("With remarks") if is_careful else _("Good")
    tone = "caution" if is_careful else "good"
    if result.model.of_poses:
        headline = _("The cameras and boards were located; the readings are off by {after} on {where}.", **numbers)
        return Verdict(tone, word, headline, remarks)
    if after.rms > _NO_GAIN * before.rms:
        headline = _(
            "Calibration did not make the robot noticeably more accurate: the mean error went from {before} to {after} "
            "on {where}.",
            **numbers,
        )
        return Verdict("caution", _("Little gained"), headline, remarks)
    ratio = before.mean / after.mean if after.mean > 0 else np.inf
    headline = _("Calibration reduced the mean error from {before} to {after} on {where}.", **numbers)
    if np.isfinite(ratio) and ratio >= 1.5:
        headline = _(
            "Calibration reduced the mean error from {before} to {after} on {where}, {ratio} times less.",
            ratio=significant(ratio, 2),
            **numbers,
        )
    return Verdict(tone, word, headline, remarks)


def trusted(result: CalibrationResult, rows: Rows, *, is_test: bool) -> tuple[Statistics, Statistics]:
    """The errors before and after; of the rows of a robust fit without its outliers, unless it failed."""
    if is_test or result.loss == "none" or not result.outliers or result.status != "converged":
        return rows.before, rows.after
    return rows.spread_without(result.train.places(result.outliers)) or (rows.before, rows.after)


def listed(names: list[str]) -> str:
    """'a', 'a and b', 'a, b and c'."""
    return f" {_('and')} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _size(value: float, like: float, unit: str) -> str:
    return f"{alike(value, like)}\N{NO-BREAK SPACE}{unit}"


def _misfits(result: CalibrationResult) -> list[Remark]:
    """Kinds of reading that do not belong to the others."""
    out = []
    for misfit in result.misfits:
        kind = misfit.kind
        median = float(np.nanmedian(result.train.kinds[kind.name].after))
        text = _(
            "The {kind} do not fit: after the fit half of them miss by more than {size} {unit}.",
            kind=_(kind.plural),
            size=significant(kind.shown(median)),
            unit=unit_text(kind.unit),
        )
        out.append(Remark(text, True, "accuracy"))
    return out


def _doubts(result: CalibrationResult) -> list[Remark]:
    """What the reader must know first; a question keeps its mark."""
    ended = (note if note.endswith(("?", ".")) else f"{note}." for note in map(retold, result.doubts))
    return [Remark(f"{note[:1].upper()}{note[1:]}", True, "method") for note in ended]


def ending(message: str) -> str:
    """How a fit ended, as the core or a room says it in English, in the language of the page."""
    if isinstance(message, Said):
        return _(message)
    head, alone, rest = message.rstrip(".").partition("; base and tool alone are fitted")
    found = re.fullmatch(r"\D*?([\d.]+)\D*?(?:([\d.]+)\D*)?", head)
    numbers = [float(number) for number in found.groups() if number] if found else []
    if head.startswith("converged: the next step"):
        text = _("converged: the next step is below {size:g} standard deviations", size=numbers[0])
    elif head.startswith("the measurements determine none"):
        text = _("the measurements determine none of the {count:.0f} requested parameters", count=numbers[0])
    elif head.startswith("there are"):
        text = _(
            "there are {numbers:.0f} independent measured numbers for {count:.0f} parameters: any robot fits them "
            "exactly, and nothing is left to estimate the noise from",
            numbers=numbers[0],
            count=numbers[1],
        )
    else:
        text = _("nothing was measured in any row") if head == "nothing was measured in any row" else head
    return f"{text}; {_('base and tool alone are fitted')}{rest}" if alone else text


def _caveats(result: CalibrationResult) -> list[Remark]:
    return [Remark(caveat_text(result), True, "parameters")] if result.caveats else []


def _shape(result: CalibrationResult) -> list[Remark]:
    """How surely lengths, planes, tilts and turns know points, and distances between them."""
    shape = result.shape
    if shape is None:
        return []
    told = _(
        "The measurements do not determine where the arm stands: a coordinate of a point has a standard deviation "
        "of {point} mm, a distance between two points of the tool one of {distance} mm.",
        point=significant(from_si(shape.point, "mm"), 2),
        distance=significant(from_si(shape.distance, "mm"), 2),
    )
    if shape.scale_is_open:
        told += " " + _(
            "Nor do they determine a common scale of all lengths; apart from that scale, a distance has a standard "
            "deviation of {distance} mm.",
            distance=significant(from_si(shape.scaled, "mm"), 2),
        )
    return [Remark(told, False, "parameters")]


def camera_remarks(cameras: Sequence[CameraPlace]) -> list[Remark]:
    """How surely each camera's place is known."""
    out = []
    for of in cameras:
        if of.undetermined:
            text = _(
                "Camera {camera} on {frame}: {axes} undetermined by these pictures; {advice}.",
                camera=of.camera,
                frame=of.frame,
                axes=", ".join(of.undetermined),
                advice=_(of.motion),
            )
            out.append(Remark(text, True, "parameters"))
            continue
        text = _(
            "Camera {camera} on {frame}: its pose is known to {shift} mm and {turn} deg, and a point at a distance "
            "of {distance} mm to {point} mm (95 % confidence).",
            camera=of.camera,
            frame=of.frame,
            shift=significant(from_si(of.within, "mm"), 2),
            turn=significant(from_si(of.within_turn, "deg"), 2),
            distance=significant(from_si(of.distance, "mm"), 2),
            point=significant(from_si(of.point_within, "mm"), 2),
        )
        if of.with_arm:
            text += " " + _("This applies with the identified arm, not with the nominal one.")
        out.append(Remark(text, False, "parameters"))
    return out


def caveat_text(result: CalibrationResult) -> str:
    """Why no stated deviation holds, of a result with caveats: an effect is missing, else the fit is not straight."""
    if not result.lacks_effect:
        return capitalised(retold(result.bent)) + "."
    return _(
        "The stated standard deviations and intervals do not hold: the residuals depend on the posture, so an effect "
        "is missing from the model; fastcal diagnose looks for it."
    )


def _on_test(train: Rows, test: Rows | None) -> Remark:
    if test is None:
        text = _(
            "No test poses were given, so this page cannot show how well the model predicts poses outside the fit."
        )
        return Remark(text, True, "accuracy")
    ratio = test.after.rms / max(train.after.rms, np.finfo(float).tiny)
    if ratio > _WORSE_ON_TEST:
        text = _(
            "On the test poses the RMS error is {ratio} times that of the fit: the test poses differ in kind from "
            "those of the fit, or the fit had too few.",
            ratio=significant(ratio, 2),
        )
        return Remark(text, True, "accuracy")
    return Remark(_("The model predicts unseen poses as well as those of the fit."), False, "accuracy")


def _what_remains(train: Rows, trends: dict[str, Trend]) -> Remark:
    titles = {variable.name: variable.title for variable in train.variables}
    flagged = [name for name, trend in trends.items() if trend.is_flagged(len(trends))]
    if not flagged:
        return Remark(_("The remaining error shows no trend over any recorded variable."), False, "remaining")
    flagged.sort(key=lambda name: -trends[name].share)
    named = [f"{titles[name]} ({percent(trends[name].share)})" for name in flagged[:3]]
    if len(flagged) > 3:
        named.append(plural(len(flagged) - 3, "more variable"))
    text = _(
        "The remaining error is not all noise: it depends on {causes}; fastcal diagnose looks for the cause.",
        causes=listed(named),
    )
    return Remark(text, True, "remaining")


def _unidentifiable(result: CalibrationResult) -> Remark:
    held = len(result.unidentifiable)
    if held == 0:
        return Remark(_("Every requested parameter is identifiable from these data."), False, "unidentifiable")
    if held == 1:
        text = _("1 combination of parameters is not identifiable from these data and is held at nominal.")
    else:
        text = _(
            "{count} combinations of parameters are not identifiable from these data and are held at nominal.",
            count=count(held),
        )
    return Remark(text, False, "unidentifiable")


def _outlying(result: CalibrationResult, train: Rows) -> list[Remark]:
    if not result.outliers:
        return []
    share = len(result.outliers) / max(1, result.train.row_count)
    numbers = {
        "rows": plural(len(result.outliers), "row"),
        "all": count(result.train.row_count),
        "share": percent(share),
    }
    if result.loss == "none":
        text = _("{rows} of {all} ({share}): poor fit.", **numbers)
    else:
        text = _("{rows} of {all} ({share}): poor fit, less weight.", **numbers)
    return [Remark(text, share > _MANY_OUTLIERS, "noise")]
