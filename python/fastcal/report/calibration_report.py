# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The report of a calibration: the parts of the page, gathered from the result."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fastcal.measurements.observations import plurals
from fastcal.report import calibration_tables, charts, figures, page, residual_figures, workspace
from fastcal.report.formatting import alike, count, plural, significant
from fastcal.report.tables import capitalised, spaced
from fastcal.report.trends import trend
from fastcal.report.view import Rows, rows_of
from fastcal.report.words import listed, verdict
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.calibration.calibrate import CalibrationResult
    from fastcal.calibration.evaluation import Evaluation

Array = NDArray[np.float64]

_METHODS = {
    "nls": "nonlinear least squares (Levenberg-Marquardt)",
    "bfgs": "BFGS with line search on the root of the mean squared distance",
    "bfgs_mean_distance": "BFGS with line search on the mean distance",
}
_MEASURING_FRAME = "the measuring frame"


def calibration_page(result: CalibrationResult, *, simulated: bool = False) -> str:
    """The HTML text of the report."""
    train = rows_of("Training", result.train, result.model.joint_types)
    test = rows_of("Test", result.test, result.model.joint_types)
    sets = [rows for rows in (train, test) if rows is not None]
    trends = {v.name: trend(v.values, train.residual) for v in train.variables} if train else {}
    base = np.asarray(result.model.spec["base"]["xyz_mm"], float)
    arrows = residual_figures.arrows(sets)
    return page.render(
        "calibration.html",
        title=f"Calibration of {result.model.name}",
        robot_name=result.model.name,
        simulated=simulated,
        sources=_sources(result),
        verdict=verdict(result, train, test, trends),
        tiles=_tiles(result, sets),
        accuracy_table=calibration_tables.accuracy_table(sets) if sets else None,
        accuracy_figures=accuracy_figures(sets) if sets else [],
        accuracy_facts=_accuracy_facts(result),
        scene=None if arrows is None else workspace.scene(*arrows, base, _MEASURING_FRAME),
        flat_views=[] if arrows is None else workspace.flat_views(*arrows),
        component_key=charts.component_key(train.components) if train else [],
        trend_panels=residual_figures.trend_panels(train, trends) if train else [],
        trend_note=residual_figures.drawn_note(train.row_count) if train else "",
        parameter_table=calibration_tables.parameter_table(result.parameters),
        unidentifiable=[
            (capitalised(spaced(item.direction)), spaced(item.parameters[0]) if item.parameters else "")
            for item in result.unidentifiable
        ],
        correlated_table=calibration_tables.correlated_table(result.correlated),
        told_count=len(result.parameters),
        asked_count=result.asked_count,
        normal_plot=residual_figures.normal_plot(train, result.sigma_mm, result.outliers) if train else None,
        sigma=significant(result.sigma_mm, 2),
        sigma_note=result.sigma_note,
        outlier_table=calibration_tables.outlier_table(train, result.outliers, result.weights) if train else None,
        outlier_count=len(result.outliers),
        method=_method(result),
        notes=result.notes,
    )


def _sources(result: CalibrationResult) -> list[tuple[str, str, int]]:
    """Name, file and row count of the sets; the file without its folder, which is nobody's business."""
    sets = (("Training", result.train), ("Test", result.test))
    return [(name, PurePath(part.data.source).name, len(part.data)) for name, part in sets if part is not None]


def _tiles(result: CalibrationResult, sets: list[Rows]) -> list[tuple[str, str, str]]:
    shares = f"{len(result.parameters)} of {result.asked_count}"
    told = ("Identified", shares, f"parameters; rank {result.rank}")
    noise = ("Noise of a coordinate", f"{significant(result.sigma_mm, 2)} mm", "standard deviation")
    if not sets:
        return [noise, told]
    before, after = sets[-1].before, sets[-1].after
    on = f"{sets[-1].name.lower()} poses"
    return [
        (f"Mean error, {on}", f"{alike(after.mean, after.mean)} mm", f"was {alike(before.mean, after.mean)} mm"),
        (f"Largest error, {on}", f"{alike(after.max, after.mean)} mm", f"was {alike(before.max, after.mean)} mm"),
        noise,
        told,
    ]


def _accuracy_facts(result: CalibrationResult) -> list[tuple[str, str]]:
    """Orientation and ISO 9283, where they were measured."""
    facts = []
    for name, part in (("training", result.train), ("test", result.test)):
        if part is not None:
            facts += [(f"{title}, {name} poses", text) for title, text in _facts_of(part)]
    return facts


def _facts_of(part: Evaluation) -> list[tuple[str, str]]:
    facts = []
    turn = part.turn_after[np.isfinite(part.turn_after)] if part.turn_after is not None else np.zeros(0)
    if len(turn):
        rms, largest = (significant(from_si(float(x), "deg")) for x in (np.sqrt(np.mean(turn**2)), turn.max()))
        facts.append(("Orientation after", f"RMS {rms}°, largest {largest}°"))
    if part.repeatability is not None:
        found = part.repeatability
        figures_of = {"AP": found.accuracy, "RP": found.repeatability, "vAP": found.direction_variation}
        means = [
            f"mean {name} {significant(from_si(float(np.mean(x)), 'mm'))} mm"
            for name, x in figures_of.items()
            if len(x)
        ]
        visits = f"{plural(found.poses, 'pose')} visited {count(found.visits)} times in all"
        lacking = f" ({found.note})" if found.note is not None else ""
        title = "ISO 9283 after" if found.is_iso_9283 else "Repeated poses after"
        facts.append((title, f"{', '.join(means)} over {visits}{lacking}"))
    return facts


def accuracy_figures(sets: list[Rows]) -> list[figures.Figure]:
    """Share of poses within an error, and the histogram of what is left; the last set is the one that is judged."""
    curves: list[tuple[str, Array, str, str]] = []
    samples: list[tuple[str, Array, str]] = []
    for rows in sets:
        name, is_judged = rows.name.lower(), rows is sets[-1]
        dash = "solid" if is_judged else "dot"
        curves.append((f"{name} before", rows.error_before, figures.BEFORE, dash))
        curves.append((f"{name} after", rows.error_after, figures.AFTER, dash))
        samples.insert(0, (name, rows.error_after, figures.AFTER if is_judged else figures.INK))
    return [charts.cumulative(curves, "mm"), charts.histogram(samples, "mm")]


def _method(result: CalibrationResult) -> list[tuple[str, str]]:
    data = result.train.data
    robust = f"{result.loss}, robust: rows that fit badly weigh less"
    return [
        ("Robot", f"{result.model.name} ({result.model.kinematics}, {plural(result.model.joint_count, 'joint')})"),
        ("Measured", f"{listed(plurals(data))}, {plural(len(data), 'row')}"),
        ("Method", _METHODS.get(result.method, result.method)),
        ("Loss", "none: every row weighs by its standard deviation alone" if result.loss == "none" else robust),
        (
            "Outcome",
            f"{result.status.replace('_', ' ')} after {plural(result.iterations, 'iteration')}: {result.message}",
        ),
        ("Parameters", f"{result.asked_count} asked for, {len(result.parameters)} identifiable from the data"),
        ("Degrees of freedom", f"{count(result.degrees_of_freedom)} (measured numbers less identified parameters)"),
    ]
