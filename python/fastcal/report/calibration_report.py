# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The report of a calibration: the parts of the page, gathered from the result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.acceptance_limit import SHARE
from fastcal.measurements.kinds import POINTS
from fastcal.measurements.observations import plurals
from fastcal.report import calibration_tables, charts, figures, page, residual_figures, workspace
from fastcal.report.cell_scene import arm_and_rig, pictures_scene
from fastcal.report.document import document_facts
from fastcal.report.figures import Figure
from fastcal.report.formatting import alike, count, percent, plural, significant
from fastcal.report.gap import waterfall
from fastcal.report.kind_words import noise_text, noise_title
from fastcal.report.language import _, decimal_sign, in_language, mid_sentence, retold
from fastcal.report.next_step import step
from fastcal.report.parameter_sizes import moved_at_tool, sizes_figure
from fastcal.report.pictures import picture_part
from fastcal.report.sections import who_measured
from fastcal.report.tables import capitalised, in_words
from fastcal.report.view import Rows, rows_of
from fastcal.report.words import Verdict, caveat_text, ending, listed, trusted, verdict
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.calibration.acceptance_limit import LimitJudged
    from fastcal.calibration.calibrate import CalibrationResult
    from fastcal.calibration.evaluation import Evaluation

Array = NDArray[np.float64]


def _methods() -> dict[str, str]:
    return {
        "nls": _("nonlinear least squares (Newton steps, Ceres' trust region where a step is rejected)"),
        "ceres": _("nonlinear least squares (Ceres' trust region only)"),
        "bfgs": _("BFGS with line search on the root of the mean squared distance"),
        "bfgs_mean_distance": _("BFGS with line search on the mean distance"),
    }


def calibration_page(
    result: CalibrationResult,
    *,
    simulated: bool = False,
    limit: LimitJudged | None = None,
    language: str = "en",
    pictures: Mapping[tuple[int, str], Path] | None = None,
) -> str:
    """The HTML text of the report, in a language, with what became of an acceptance limit.

    `pictures`: files of cameras' pictures, by row and camera.
    """
    with in_language(language):
        return _page(result, simulated, limit, pictures or {})


def _page(
    result: CalibrationResult,
    simulated: bool,
    limit: LimitJudged | None,
    files: Mapping[tuple[int, str], Path],
) -> str:
    train = rows_of(_("Training"), result.train, result.model.joint_types, of_poses=result.model.of_poses)
    test = rows_of(_("Test"), result.test, result.model.joint_types, of_poses=result.model.of_poses)
    sets = [rows for rows in (train, test) if rows is not None]
    trends = train.trends if train else {}
    base = np.asarray(result.model.description.base.xyz_mm, float)
    arrows = residual_figures.arrows(sets)
    outliers = result.train.places(result.outliers)
    arm = arm_and_rig(result.model, result.nominal, [(train, result.train), (test, result.test)])
    return page.render(
        "calibration.html",
        title=_("Calibration of {robot}", robot=result.model.name),
        robot_name=result.model.name,
        simulated=simulated,
        sources=_sources(result),
        who=who_measured(result.model.made_by),
        verdict=_judged(verdict(result, train, test, trends), limit),
        steps=[capitalised(step(result, is_why_told=True))],
        gap=gap_figures(result),
        tiles=_tiles(result, sets),
        accuracy_table=calibration_tables.accuracy_table(sets, len(outliers)) if sets else None,
        accuracy_figures=accuracy_figures(sets) if sets else [],
        accuracy_facts=_accuracy_facts(result),
        of_points=train is None or train.kind.name == POINTS,
        kind_table=calibration_tables.kind_table(
            [(_("training poses"), result.train), *([] if result.test is None else [(_("test poses"), result.test)])]
        ),
        scene=pictures_scene(result.model, result.nominal, result.train)
        if arrows is None
        else workspace.scene(
            *arrows, base, _("the measuring frame"), arm, residual_figures.places_of_arrows(train, outliers)
        ),
        flat_views=[] if arrows is None else workspace.flat_views(*arrows),
        component_key=charts.component_key(train.components) if train else [],
        trend_panels=residual_figures.trend_panels(train, trends) if train else [],
        trend_note=residual_figures.drawn_note(train.row_count, result.train.row_count) if train else "",
        parameter_table=calibration_tables.parameter_table(result.parameters, holds=not result.caveats),
        parameter_sizes=sizes_figure(moved_at_tool(result)),
        caveat=caveat_text(result) if result.caveats else "",
        unidentifiable=[
            (capitalised(in_words(item.direction)), in_words(item.parameters[0]) if item.parameters else "")
            for item in result.unidentifiable
        ],
        correlated_table=calibration_tables.correlated_table(result.correlated),
        told_count=len(result.parameters),
        asked_count=result.asked_count,
        normal_plot=residual_figures.normal_plot(train, result.noise[train.kind.name], outliers)
        if train and train.kind.name in result.noise
        else None,
        noise=[(noise_title(of.kind), noise_text(of), _(of.note)) for of in result.noise.values()],
        outlier_table=calibration_tables.outlier_table(train, outliers, result.weights) if train else None,
        outlier_count=len(result.outliers),
        method=_method(result),
        notes=[retold(note) for note in (*result.notes, result.held) if note and note not in result.doubts],
        limit=None if limit is None else limit_sentence(limit),
        pictures=picture_part(result.model, result.train, files),
        document=document_facts(result.model.made_by),
    )


def _judged(found: Verdict, limit: LimitJudged | None) -> Verdict:
    """The verdict where an acceptance limit was set: nothing is good that misses it, or may miss it."""
    if limit is None or limit.verdict == "pass" or found.tone == "bad":
        return found
    if limit.verdict == "fail":
        return replace(found, tone="bad", word=_("Limit not met"))
    return replace(found, tone="caution", word=_("With remarks") if found.tone == "good" else found.word)


def gap_figures(result: CalibrationResult) -> list[Figure]:
    """The error with base and tool alone, what was identified takes of it, what remains, and the noise.

    Of test poses where there are any, else of those of the fit that the verdict speaks of. None where nothing was
    identified, or the noise is not known.
    """
    judged = result.test or result.train
    of = judged.main
    if of is None or result.status != "converged" or of.kind.name not in result.noise:
        return []
    outliers = result.train.places([] if result.test or result.loss == "none" else result.outliers)
    kept = of.without(outliers) if len(outliers) else (None, None)
    before, after = of.statistics if None in kept else kept
    if before is None or after is None:
        return []
    name = _("the geometry and effects") if result.model.entries else _("the geometry")
    steps = [(first := _("base and tool alone"), of.kind.shown(before.rms)), (name, of.kind.shown(after.rms))]
    floor = of.kind.shown(result.noise[of.kind.name].value) * of.width**0.5
    on = _("fitted poses") if None in kept else _("fitted poses without outliers")
    return [waterfall(steps, floor, _("test poses") if result.test else on, of.kind.unit, first=first)]


def limit_sentence(limit: LimitJudged) -> str:
    """What became of the acceptance limit, and how sure that is."""
    numbers = {
        "limit": f"{from_si(limit.limit, 'mm'):g}".replace(".", decimal_sign()),
        "within": count(limit.poses - limit.beyond),
        "poses": count(limit.poses),
        "confidence": percent(limit.confidence),
        "share": percent(SHARE),
    }
    if limit.verdict == "pass":
        return _(
            "Acceptance limit {limit} mm: pass. {within} of {poses} test poses lie within it; at least {share} of such "
            "poses do, with a confidence of {confidence}.",
            **numbers,
        )
    if limit.verdict == "fail":
        return _(
            "Acceptance limit {limit} mm: fail. Only {within} of {poses} poses lie within it, too few for {share} of "
            "such poses.",
            **numbers,
        )
    if not limit.on_test:
        return _(
            "Acceptance limit {limit} mm: cannot tell. {within} of {poses} poses of the fit lie within it; only test "
            "poses can show more.",
            **numbers,
        )
    return _(
        "Acceptance limit {limit} mm: cannot tell. {within} of {poses} test poses lie within it, too few to decide "
        "whether {share} of such poses do.",
        **numbers,
    )


def _sources(result: CalibrationResult) -> list[tuple[str, str, int]]:
    """Name, file and row count of the sets; the file without its folder, which is private."""
    sets = ((_("Training"), result.train), (_("Test"), result.test))
    return [(name, PurePath(part.data.source).name, part.row_count) for name, part in sets if part is not None]


def _tiles(result: CalibrationResult, sets: list[Rows]) -> list[tuple[str, str, str]]:
    shares = _("{some} of {all}", some=len(result.parameters), all=result.asked_count)
    of_what = _("parameters; rank {rank}", rank=result.rank) if result.parameters else _("parameters")
    identified = (_("Identified"), shares, of_what)
    noise = [(noise_title(of.kind), noise_text(of), _("standard deviation")) for of in result.noise.values()]
    noise = noise if result.status == "converged" else []
    if not sets:
        return [*noise, identified]
    before, after = trusted(result, sets[-1], is_test=sets[-1] is not sets[0] or result.train.main is None)
    on = _poses_of(result, sets[-1] is not sets[0])
    unit = sets[-1].unit
    was = [_("was {value} {unit}", value=alike(value, after.mean), unit=unit) for value in (before.mean, before.max)]
    return [
        (_("Mean error, {on}", on=on), f"{alike(after.mean, after.mean)} {unit}", was[0]),
        (_("Largest error, {on}", on=on), f"{alike(after.max, after.mean)} {unit}", was[1]),
        *noise,
        identified,
    ]


def _poses_of(result: CalibrationResult, of_test: bool) -> str:
    is_test = of_test or result.train.main is None
    return _("test poses") if is_test else _("training poses")


def _accuracy_facts(result: CalibrationResult) -> list[tuple[str, str]]:
    """Orientation and ISO 9283, where they were measured."""
    facts = []
    for name, part in ((_("training poses"), result.train), (_("test poses"), result.test)):
        if part is not None:
            facts += [(f"{title}, {name}", text) for title, text in _facts_of(part)]
    return facts


def _facts_of(part: Evaluation) -> list[tuple[str, str]]:
    facts = []
    turn = part.turn_after[np.isfinite(part.turn_after)] if part.turn_after is not None else np.zeros(0)
    if len(turn):
        rms, largest = (significant(from_si(float(x), "deg")) for x in (np.sqrt(np.mean(turn**2)), turn.max()))
        facts.append((_("Orientation after"), _("RMS {rms}°, largest {largest}°", rms=rms, largest=largest)))
    if part.repeatability is not None:
        found = part.repeatability
        figures_of = {"AP": found.accuracy, "RP": found.repeatability, "vAP": found.direction_variation}
        means = [
            _("mean {symbol} {value} mm", symbol=name, value=significant(from_si(float(np.mean(x)), "mm")))
            for name, x in figures_of.items()
            if len(x)
        ]
        visits = _("{poses} visited {count} times in all", poses=plural(found.poses, "pose"), count=count(found.visits))
        lacking = f" ({found.note})" if found.note is not None else ""
        title = _("ISO 9283 after") if found.is_iso_9283 else _("Repeated poses after")
        facts.append((title, _("{figures} over {visits}", figures=", ".join(means), visits=visits) + lacking))
    return facts


def accuracy_figures(sets: list[Rows]) -> list[figures.Figure]:
    """Share of poses within an error, and the histogram of what is left; the last set is the one that is judged."""
    curves: list[tuple[str, Array, str, str]] = []
    samples: list[tuple[str, Array, str]] = []
    for rows in sets:
        name, is_judged = mid_sentence(rows.name), rows is sets[-1]
        dash = "solid" if is_judged else "dot"
        curves.append((_("{set} before", set=name), rows.error_before, figures.BEFORE, dash))
        curves.append((_("{set} after", set=name), rows.error_after, figures.AFTER, dash))
        samples.insert(0, (name, rows.error_after, figures.AFTER if is_judged else figures.INK))
    return [charts.cumulative(curves, sets[0].unit), charts.histogram(samples, sets[0].unit)]


def _method(result: CalibrationResult) -> list[tuple[str, str]]:
    data = result.train.data
    robust = _("{loss}, robust: rows that fit badly get less weight", loss=result.loss)
    plain = _("none: each row is weighted by its standard deviation only")
    outcome = _(
        "{message}; {iterations} in all rounds of weights, noise and loads together",
        iterations=plural(result.iterations, "iteration"),
        message=ending(result.message),
    )
    return [
        (_("Robot"), f"{result.model.name} ({result.model.kinematics}, {plural(result.model.joint_count, 'joint')})"),
        (_("Measured"), f"{listed([_(kind) for kind in plurals(data)])}, {plural(result.train.row_count, 'row')}"),
        (_("Method"), _methods().get(result.method, result.method)),
        (_("Loss"), plain if result.loss == "none" else robust),
        (_("Outcome"), outcome),
        (
            _("Parameters"),
            _(
                "{asked} requested, {found} identifiable from the data",
                asked=result.asked_count,
                found=len(result.parameters),
            ),
        ),
        (
            _("Degrees of freedom"),
            _("{count} (measured numbers less identified parameters)", count=count(result.degrees_of_freedom)),
        ),
    ]
