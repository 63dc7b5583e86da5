# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The report's tables and charts in a notebook: HTML of a result, and which of its figures show what."""

from __future__ import annotations

from dataclasses import replace
from functools import singledispatch
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from fastcal.calibration.result import CalibrationResult
from fastcal.diagnosis import partial_residuals
from fastcal.diagnosis.result import Diagnosis
from fastcal.effects.rig_traits import RIG_TRAITS
from fastcal.errors import InvalidInput
from fastcal.report import (
    calibration_report,
    charts,
    diagnosis_report,
    effect_figures,
    path_report,
    residual_figures,
    workspace,
)
from fastcal.report.arm import Arm, arm_of
from fastcal.report.frames import frame
from fastcal.report.parameter_sizes import moved_at_tool, sizes_figure
from fastcal.report.summaries import summary
from fastcal.report.view import Rows, rows_of

if TYPE_CHECKING:
    from plotly import graph_objects

    from fastcal.compensation import PathAccuracy
    from fastcal.report.figures import Figure

_HEAD = 8  # rows of a table that a notebook shows


def html(shown: Any) -> str:
    """The lines of `summary()` and the head of `to_frame()`."""
    first, *others = summary(shown)
    lines = "".join(f"<div style='white-space:pre-wrap'>{escape(line)}</div>" for line in others)
    table = frame(shown)
    count = len(table)
    with pd.option_context("display.precision", 4):
        rows = table.head(_HEAD).to_html(border=0, na_rep="", index=table.index.name is not None) if count else ""
    more = f"<div>... {count - _HEAD} more rows in .to_frame()</div>" if count > _HEAD else ""
    return f"<div><strong>{escape(first)}</strong>{lines}{rows}{more}</div>"


def chart(shown: Any, kind: str, which: str | None = None) -> graph_objects.Figure:
    """A chart of the report by its kind; InvalidInput where the result has none of that kind or Plotly is not there."""
    try:
        from fastcal.report.plotly_figures import plotly_figure
    except ImportError:
        raise InvalidInput("a chart in Python needs the package plotly: pip install 'fastcal[notebook]'") from None
    found = _CHARTS[kind](shown) if which is None else _CHARTS[kind](shown, which)
    if not found:
        raise InvalidInput(f"{type(shown).__name__} has nothing to draw for '{kind}': no row of it has what that needs")
    return plotly_figure(found)


@singledispatch
def _sets(shown: Any) -> list[Rows]:
    """Training rows and, where there are any, test rows."""
    raise TypeError(f"{type(shown).__name__} has no residuals")


@_sets.register
def _(result: CalibrationResult) -> list[Rows]:
    kinds, of_poses = result.model.joint_types, result.model.of_poses
    sets = (rows_of(name, getattr(result, part), kinds, of_poses=of_poses) for name, part in _PARTS)
    return [rows for rows in sets if rows is not None]


@_sets.register
def _(found: Diagnosis) -> list[Rows]:
    sets = (diagnosis_report.compared_rows(found, name, part)[0] for name, part in _PARTS)
    return [rows for rows in sets if rows is not None]


_PARTS = (("Training", "train"), ("Test", "test"))


def _errors(shown: Any) -> list[Figure]:
    sets = _sets(shown)
    return calibration_report.accuracy_figures(sets)[:1] if sets else []


def _histogram(shown: Any) -> list[Figure]:
    sets = _sets(shown)
    return calibration_report.accuracy_figures(sets)[1:] if sets else []


def _residuals(shown: Any, over: str | None = None) -> list[Figure]:
    sets = _sets(shown)
    if not sets:
        return []
    rows = sets[0]
    names = [variable.name for variable in rows.variables]
    if over is not None and over not in names:
        raise InvalidInput(f"the residuals can be drawn over {', '.join(names)}, got '{over}'")
    panels = residual_figures.trend_panels(rows, rows.trends)
    panel = next(panel for panel in panels if over is None or panel.id == f"trend-{over}")
    return [replace(panel, key=charts.component_key(rows.components))]


def _workspace(shown: Any, arm: Arm | None = None) -> list[Figure]:
    arrows = residual_figures.arrows(_sets(shown))
    base = np.asarray(shown.model.description.base.xyz_mm, float)
    return [] if arrows is None else [workspace.scene(*arrows, base, "the measuring frame", arm)]


def _arm(shown: Any) -> list[Figure]:
    kinds = shown.model.joint_types
    before = shown.nominal if isinstance(shown, CalibrationResult) else shown.steps[0].model
    sets = [(rows_of(name, getattr(shown, part), kinds), getattr(shown, part)) for name, part in _PARTS]
    return _workspace(shown, arm_of(shown.model, before, sets))


def _parameters(result: CalibrationResult) -> list[Figure]:
    drawn = sizes_figure(moved_at_tool(result))
    return [] if drawn is None else [drawn]


def _noise(shown: Any) -> list[Figure]:
    sets = _sets(shown)
    outliers = shown.train.places(shown.outliers)
    return [residual_figures.normal_plot(sets[0], shown.noise[sets[0].kind.name], outliers)] if sets else []


def _gap(found: Diagnosis) -> list[Figure]:
    return [diagnosis_report.gap_figure(found)]


def _effect(found: Diagnosis, name: str | None = None) -> list[Figure]:
    named = {f.label: f for f in found.effects}
    if name is None and named:
        name = next(iter(named))
    if name not in named:
        given = f"found were {', '.join(named)}" if named else "no effect was found"
        raise InvalidInput(f"there is no finding {name}; {given}" if name else given)
    if named[name].effect in RIG_TRAITS:
        raise InvalidInput(f"{name} is no effect of the arm: nothing of it can be drawn")
    seen = partial_residuals.of_finding(found.fitted_with(named[name]), named[name])
    first, *others = effect_figures.effect_figures(seen, named[name].owner, "effect")
    return [replace(first, key=effect_figures.effect_key()), *others]


def _likeness(found: Diagnosis) -> list[Figure]:
    drawn = diagnosis_report.confusion_figure(found)
    return [] if drawn is None else [drawn]


def _path(found: PathAccuracy) -> list[Figure]:
    return [path_report.path_figure(found)]


_CHARTS: dict[str, Any] = {
    "errors": _errors,
    "histogram": _histogram,
    "residuals": _residuals,
    "workspace": _workspace,
    "arm": _arm,
    "parameters": _parameters,
    "noise": _noise,
    "gap": _gap,
    "effect": _effect,
    "likeness": _likeness,
    "path": _path,
}
