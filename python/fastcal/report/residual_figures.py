# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What residuals look like, drawn from the rows of a measured set: arrows, panels against variables, normal plot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fastcal.arrays import FloatArray
from fastcal.measurements.kinds import KindNoise
from fastcal.report import charts, figures
from fastcal.report.formatting import count, percent
from fastcal.report.language import _
from fastcal.report.trends import Trend, judged_rows
from fastcal.report.view import Rows, Variable

POINT_LIMIT = 250
LOUDER = (0.1, 0.3)  # shares of the variance from which a trend is clear, and strong


def arrows(sets: list[Rows]) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Positions and residuals before and after (N, 3) in mm of all rows that are complete; None where none is."""
    whole = [(rows, rows.with_arrows) for rows in sets if rows.with_arrows.any()]
    if not whole:
        return None
    return (
        np.vstack([rows.position[kept] for rows, kept in whole]),
        np.vstack([rows.point_before[kept] for rows, kept in whole]),
        np.vstack([rows.point_after[kept] for rows, kept in whole]),
    )


def places_of_arrows(rows: Rows | None, chosen: Sequence[int] | NDArray[np.intp]) -> list[int]:
    """Where chosen rows of the first set are among the arrows, as far as they are."""
    return [] if rows is None else np.flatnonzero(np.isin(np.flatnonzero(rows.with_arrows), chosen)).tolist()


def trend_panels(rows: Rows, trends: dict[str, Trend]) -> list[figures.Figure]:
    """A panel for each variable, those with a trend first, the strongest of them at the head."""
    y_range = reach(rows)
    order = sorted(rows.variables, key=lambda variable: -_strength(trends, variable))
    return [_panel(rows, variable, trends, y_range) for variable in order]


def trend_pairs(states: dict[str, tuple[Rows, dict[str, Trend]]]) -> list[list[figures.Figure]]:
    """For each variable a panel of each state on one scale, those variables with the strongest trend in any first."""
    (first, _), *_ = states.values()
    y_range = reach(first)
    order = sorted(
        first.variables, key=lambda variable: -max(_strength(trends, variable) for _, trends in states.values())
    )
    pairs: list[list[figures.Figure]] = []
    for variable in order:
        pair = []
        for name, (rows, trends) in states.items():
            panel = _panel(rows, variable, trends, y_range)
            title = f"{panel.title}, {name}"
            columns = 3 if len(states) > 1 or pairs else 6  # the first stands alone, the others are folded
            pair.append(replace(panel, id=f"{panel.id}-{name}", title=title, columns=columns, height=210))
        pairs.append(pair)
    return pairs


def reach(rows: Rows) -> float:
    """Half the height of the panels of a residual, in its unit."""
    known = np.abs(rows.residual[np.isfinite(rows.residual)])
    return (min(float(known.max()) * 1.1, 6.5 * float(np.median(known))) if len(known) else 0.0) or 1.0


def _strength(trends: dict[str, Trend], variable: Variable) -> float:
    found = trends[variable.name]
    return found.share if found.is_flagged(len(trends)) else 0.0


def _panel(rows: Rows, variable: Variable, trends: dict[str, Trend], y_range: float) -> figures.Figure:
    found = trends[variable.name]
    weight = 0
    if found.is_flagged(len(trends)):
        weight = 1 + sum(found.share >= share for share in LOUDER)
    strengths = (_("no trend"), _("slight trend"), _("clear trend"), _("strong trend"))
    badge = strengths[weight]
    if weight:
        badge = _("{strength}, {share} of the variance", strength=badge, share=percent(found.share))
    titles = variable.title, variable.label
    key = charts.component_key(rows.components)
    shown = figures.spread_rows(rows.row_count, POINT_LIMIT)
    panel = charts.trend_panel(variable.name, titles, variable.values, rows.residual, key, y_range, shown, rows.unit)
    return figures.marked(_linked(panel, rows, shown), badge, weight)


def _linked(panel: figures.Figure, rows: Rows, shown: NDArray[np.intp]) -> figures.Figure:
    """The panel whose points, the first traces, choose their rows, and with a mark for the row that is chosen."""
    own = list(range(rows.residual.shape[1]))
    hover = {"hovertemplate": _("row %{{customdata}}: %{{y:.3g}} {unit}", unit=rows.unit) + "<extra></extra>"}
    traces = [
        {key: value for key, value in trace.items() if key != "hoverinfo"} | hover | {"customdata": rows.numbers[shown]}
        if place in own
        else trace
        for place, trace in enumerate(panel.traces)
    ]
    mark = figures.points([], [], figures.INK, 10, symbol="circle-open", line={"width": 2})
    return replace(panel, traces=[*traces, mark], rows={"traces": own, "mark": len(traces)})


def drawn_note(shown_count: int, row_count: int = 0) -> str:
    """How many of the rows are drawn, and how; `shown_count` of all, where there are more."""
    row_count = max(row_count, shown_count)
    drawn, judged = min(shown_count, POINT_LIMIT), len(judged_rows(shown_count))
    if drawn == row_count:
        return _("Medians and bands use all rows. Points beyond the axis are not drawn.")
    if judged < row_count:
        return _(
            "Medians and bands use {judged} of {all} rows; {some} of all rows are drawn as points. Points beyond "
            "the axis are not drawn.",
            judged=count(judged),
            some=count(drawn),
            all=count(row_count),
        )
    return _(
        "Medians and bands use all rows. {some} of {all} rows are drawn as points. Points beyond the axis are not "
        "drawn.",
        some=count(drawn),
        all=count(row_count),
    )


def normal_plot(rows: Rows, noise: KindNoise, outliers: Sequence[int] | NDArray[np.intp]) -> figures.Figure:
    """The normal plot of all residual components, those of outlying rows marked."""
    is_outlier = np.zeros(rows.residual.shape, bool)
    is_outlier[np.asarray(outliers, int)] = True
    sigma = noise.kind.shown(noise.value)
    return charts.normal_plot(rows.residual.ravel(), sigma, is_outlier.ravel(), unit=rows.unit)
