# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The report's tables and charts in a notebook: HTML of a result, and its figures as Plotly figures with a legend."""

from __future__ import annotations

import os
import webbrowser
import zlib
from dataclasses import replace
from functools import singledispatch
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
import pandas as pd
from plotly import graph_objects
from plotly.subplots import make_subplots

from fastcal.acceptance.acceptance import Acceptance
from fastcal.calibration.result import CalibrationResult
from fastcal.cells.calibrate import CellResult
from fastcal.cells.diagnosis import CellDiagnosis
from fastcal.diagnosis import partial_residuals
from fastcal.diagnosis.result import Diagnosis
from fastcal.effects.rig_traits import RIG_TRAITS
from fastcal.errors import InvalidInput
from fastcal.io.atomic import write_text
from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.result import CheckResult
from fastcal.report import (
    acceptance_figures,
    calibration_report,
    cell_diagnosis_report,
    cell_report,
    charts,
    check_report,
    comparison_report,
    diagnosis_report,
    effect_figures,
    figures,
    path_report,
    residual_figures,
    workspace,
)
from fastcal.report.arm import Arm
from fastcal.report.cell_scene import arm_and_rig, cell_scene
from fastcal.report.figures import Figure
from fastcal.report.frames import frame
from fastcal.report.parameter_sizes import differences_at_tool, moved_at_tool, sizes_figure
from fastcal.report.sections import present
from fastcal.report.still import still
from fastcal.report.summaries import summary
from fastcal.report.tables import capitalised
from fastcal.report.view import Rows, rows_of

if TYPE_CHECKING:
    from fastcal.compensation import PathAccuracy

_LEGEND = 46  # CSS pixels below a figure for the legend, which may take two lines
_HEAD = 8  # rows of a table that a notebook shows


class Drawn(graph_objects.Figure):  # type: ignore[misc]
    """A Plotly figure that a notebook shows as a still picture where it is read without JavaScript.

    The picture is of the chart as it was made: of what a user changes it knows nothing.
    """

    _still = ""

    def _repr_mimebundle_(self, *arguments: Any, **options: Any) -> dict[str, Any]:
        """What Plotly gives, the picture, and with Plotly's page the picture until a script takes it away."""
        bundle: dict[str, Any] = super()._repr_mimebundle_(*arguments, **options)
        name = f"fastcal-{zlib.crc32(self._still.encode()):08x}"
        if "text/html" in bundle:
            there = f"document.querySelectorAll('.{name}').forEach((each) => each.remove())"
            bundle["text/html"] = (
                f'<div class="{name}">{self._still}</div>{bundle["text/html"]}<script>{there}</script>'
            )
        return bundle | {"image/svg+xml": self._still}

    def to_html(self, *arguments: Any, **options: Any) -> str:
        """What Plotly gives, and the picture for who reads it without JavaScript."""
        page = str(super().to_html(*arguments, **options))
        before, body, after = page.partition("<body>")
        picture = f"<noscript>{self._still}</noscript>"
        return before + body + picture + after if body else picture + page

    def write_html(self, file: str | os.PathLike[str] | TextIO, *arguments: Any, **options: Any) -> None:
        """As `to_html`, into a file; `auto_open=True` opens it in a browser."""
        opened = options.pop("auto_open", False)
        text = self.to_html(*arguments, **options)
        if not isinstance(file, (str, os.PathLike)):
            file.write(text)
            return
        write_text(Path(file), text)
        if opened:
            webbrowser.open(Path(file).resolve().as_uri())


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
    """A chart of the report by its kind; InvalidInput where the result has none of that kind."""
    found = _CHARTS[kind](shown) if which is None else _CHARTS[kind](shown, which)
    if not found:
        raise InvalidInput(f"{type(shown).__name__} has nothing to draw for '{kind}': no row of it has what that needs")
    return plotly_figure(found)


def plotly_figure(drawn: list[Figure]) -> graph_objects.Figure:
    """Figures of the report beside each other as one of Plotly's, their key as its legend."""
    first = drawn[0]
    if len(drawn) == 1:
        figure = graph_objects.Figure({"data": first.traces, "layout": first.layout})
    else:
        figure = make_subplots(1, len(drawn), subplot_titles=[capitalised(part.title) for part in drawn])
        for column, part in enumerate(drawn, start=1):
            figure.add_traces(graph_objects.Figure({"data": part.traces}).data, rows=1, cols=column)
            figure.update_xaxes(part.layout["xaxis"], row=1, col=column)
            figure.update_yaxes(part.layout["yaxis"], row=1, col=column)
        figure.update_layout({key: value for key, value in first.layout.items() if key not in ("xaxis", "yaxis")})
    figure.update_traces(showlegend=False)
    for entry in first.key:
        figure.add_trace(_legend_entry(entry, in_scene=first.kind == "scene"))
    title = capitalised(first.title) if len(drawn) == 1 else ""
    figure.update_layout(
        title={"text": title, "font": {"size": 15}, "x": 0, "xref": "paper"},
        height=max(first.height, 320) + 60 + _LEGEND * bool(first.key),
        margin={"t": 60 if not first.controls else 90, "b": 50 + _LEGEND * bool(first.key)},
        showlegend=bool(first.key),
        legend={"orientation": "h", "x": 0, "y": 0, "yref": "container", "yanchor": "bottom"},
        meta={"alt": " ".join(part.alt for part in drawn)},
    )
    if first.controls:
        figure.update_layout(updatemenus=[_buttons(first)])
    shown = Drawn(figure)
    shown._still = still(drawn)
    return shown


def _legend_entry(entry: figures.Key, *, in_scene: bool) -> Any:
    is_line = entry.mark not in ("point", "cross")
    kind = graph_objects.Scatter3d if in_scene else graph_objects.Scatter
    return kind(
        x=[None],
        y=[None],
        **({"z": [None]} if in_scene else {}),
        name=entry.label,
        mode="lines" if is_line else "markers",
        line={"color": entry.colour, "dash": entry.mark} if is_line else None,
        marker={"color": entry.colour, "symbol": "x" if entry.mark == "cross" else "circle"},
        hoverinfo="skip",
    )


def _buttons(drawn: Figure) -> dict[str, Any]:
    """The buttons that show some traces in place of others."""
    switched = sorted({trace for control in drawn.controls for trace in control["traces"]})
    buttons = [
        {
            "label": control["label"],
            "method": "restyle",
            "args": [{"visible": [trace in control["traces"] for trace in switched]}, switched],
        }
        for control in drawn.controls
    ]
    return {"type": "buttons", "direction": "right", "x": 0, "y": 1.02, "yanchor": "bottom", "buttons": buttons}


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


@singledispatch
def _arm(shown: Any) -> list[Figure]:
    kinds = shown.model.joint_types
    before = shown.nominal if isinstance(shown, CalibrationResult) else shown.steps[0].model
    sets = [(rows_of(name, getattr(shown, part), kinds), getattr(shown, part)) for name, part in _PARTS]
    return _workspace(shown, arm_and_rig(shown.model, before, sets))


@_arm.register
def _(found: CheckResult) -> list[Figure]:
    return present(check_report.errors_in_space(found))


@_arm.register
def _(found: Comparison) -> list[Figure]:
    return [comparison_report.differences_in_space(found, differences_at_tool(found))]


@_arm.register
def _(found: Acceptance) -> list[Figure]:
    return [acceptance_figures.arm_in_space(found)]


@_arm.register
def _(found: CellResult) -> list[Figure]:
    return present(cell_scene(found.cell, found.readings, found.nominal))


@_arm.register
def _(found: CellDiagnosis) -> list[Figure]:
    before = found.gap[0].cell if found.gap else None
    return [] if found.readings is None else present(cell_scene(found.cell, found.readings, before))


def _parameters(result: CalibrationResult) -> list[Figure]:
    drawn = sizes_figure(moved_at_tool(result))
    return [] if drawn is None else [drawn]


def _noise(shown: Any) -> list[Figure]:
    sets = _sets(shown)
    outliers = shown.train.places(shown.outliers)
    return [residual_figures.normal_plot(sets[0], shown.noise[sets[0].kind.name], outliers)] if sets else []


@singledispatch
def _gap(found: Any) -> list[Figure]:
    return [diagnosis_report.gap_figure(found)]


@_gap.register
def _(found: CalibrationResult) -> list[Figure]:
    return calibration_report.gap_figures(found)


@_gap.register
def _(found: CellResult) -> list[Figure]:
    return cell_report.gap_figures(found)


@_gap.register
def _(found: CellDiagnosis) -> list[Figure]:
    return cell_diagnosis_report.gap_figures(found)


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
