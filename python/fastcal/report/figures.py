# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The common look of figures: palette, axes, lines and points.

A figure is data for plotly.js as plain dictionaries; nothing of Plotly's Python side is needed to build it. Component
colours are of Okabe and Ito (2008), distinguishable without red or green, and differ by dash for grey prints.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.report.language import decimal_sign

Trace = dict[str, Any]

INK, MUTED, GRID, AXIS = "#1d2731", "#5b6770", "#e3e8ec", "#aab4bd"
BEFORE, AFTER, ALERT = "#8d99a5", "#0b5f8a", "#b3261e"
COMPONENT_COLOURS = ("#d55e00", "#009e73", "#0072b2", "#a14a82")
COMPONENT_DASHES = ("solid", "dash", "dot", "dashdot")
# What page.js puts in place of colours where the reader prefers a dark screen; all others are right on both.
DARK = {
    "#fff": "#12181e", "#ffffff": "#1b232b", "rgba(255,255,255": "rgba(18,24,30",
    INK: "#e4e9ed", MUTED: "#a5b1bb", GRID: "#2a343d", AXIS: "#56636e",
    BEFORE: "#98a5b1", AFTER: "#5fb0dc", ALERT: "#f2887e",
    "#d55e00": "#ef8a3c", "#009e73": "#2fc498", "#0072b2": "#4fa8e0", "#a14a82": "#d58aba",
    "#dbe7ee": "#24343f", "#8fb8cf": "#3d6580", "#f2f6f9": "#24343f", "#5f7180": "#90a4b3",
    # Scales of colour: little stays near the background, much away from it.
    "#f2f2f2": "#34404a", "#dfe9ef": "#24343f", "#9cc3d8": "#3d6580", "#0b3f5e": "#d3ecf9", "#a11d1d": "#e0524a",
    "#8464a8": "#b79ad6", "#4f8f5f": "#86c296", "#a07a30": "#cfab66", "#a8566a": "#d68fa1", "#3c8c9c": "#7cc4d3",
}  # fmt: skip
FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"


@dataclass(frozen=True)
class Key:
    """One entry of a figure's key; `mark` is solid, dash, dot or dashdot for a line, point or cross for a symbol."""

    label: str
    colour: str
    mark: str


@dataclass(frozen=True)
class Figure:
    """One drawing.

    Attributes:
        id: Its name in the page.
        title: Its heading.
        alt: What a reader who can't see it should know.
        traces, layout: What plotly.js draws; every axis has a title with its unit.
        note: The text under it.
        badge: A word beside the heading.
        weight: How loud the badge is: 0 quiet, 1 slight, 2 clear, 3 strong.
        columns: How many of the page's six columns it takes.
        height: In CSS pixels.
        paper_height: The same on A4; 0 follows from the width.
        kind: `flat`, or `scene` for what can be turned, which scene.js draws.
        key: What the marks mean.
        controls: Buttons that show some traces in place of others: label, traces, selected.
        narrow: What `Plotly.relayout` changes where the figure is narrower than a hand.
        names: What the numbers on a narrow figure's axes stand for, from 1.
        links: Where a click on the k-th line of a matrix leads: ids of the page.
        pages: Where a click on the k-th point of a series leads: addresses beside the page, empty for none.
        postures: Of a scene with an arm: what its slider shows in each position, see `workspace.scene`.
        rows: Of a panel whose `traces` have a point a row of the training data, its number as customdata: a click
            chooses the row everywhere, and the trace `mark` shows what was chosen elsewhere.
    """

    id: str
    title: str
    alt: str
    traces: list[Trace]
    layout: dict[str, Any]
    note: str = ""
    badge: str = ""
    weight: int = 0
    columns: int = 6
    height: int = 320
    paper_height: int = 0
    kind: str = "flat"
    key: list[Key] = field(default_factory=list)
    controls: list[dict[str, Any]] = field(default_factory=list)
    narrow: dict[str, Any] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    pages: list[str] = field(default_factory=list)
    postures: dict[str, Any] = field(default_factory=dict)
    rows: dict[str, Any] = field(default_factory=dict)


def marked(figure: Figure, badge: str, weight: int) -> Figure:
    """The figure with a short word beside its title, as loud as `weight` says, 0 to 3."""
    return replace(figure, badge=badge, weight=weight, alt=f"{figure.alt} {badge}.")


def layout(x_title: str, y_title: str, **more: Any) -> dict[str, Any]:
    """The common layout of a flat figure; `more` is merged over it, axes and margin key by key."""
    base: dict[str, Any] = {
        "font": {"family": FONT, "size": 12, "color": INK},
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "margin": {"l": 58, "r": 14, "t": 10, "b": 46},
        "showlegend": False,
        "separators": f"{decimal_sign()}\N{NARROW NO-BREAK SPACE}",
        "hovermode": "closest",
        "hoverlabel": {"bgcolor": "#fff", "bordercolor": MUTED, "font": {"color": INK, "family": FONT}},
        "xaxis": axis(x_title),
        "yaxis": axis(y_title),
    }
    for key, value in more.items():
        base[key] = base[key] | value if key in ("xaxis", "yaxis", "margin") else value
    return base


_CLOSE = 4.0  # times: of 1, 2 and 5 two lie between values that are farther apart


def log_ticks(values: Sequence[float]) -> dict[str, Any]:
    """Ticks of a logarithmic axis near the values: 1, 2 and 5 of each power of ten, all digits of close values."""
    known = [value for value in values if value > 0]
    if not known:
        return {}
    powers = range(math.floor(math.log10(min(known))), math.ceil(math.log10(max(known))) + 1)
    steps = (1, 2, 5) if max(known) > _CLOSE * min(known) else range(1, 10)
    ticks = [step * 10.0**power for power in powers for step in steps]
    return {"tickvals": ticks, "ticktext": [f"{tick:.10g}".replace(".", decimal_sign()) for tick in ticks]}


def axis(title: str) -> dict[str, Any]:
    """An axis with its title, which names the unit."""
    return {
        "title": {"text": title, "standoff": 8, "font": {"size": 12, "color": MUTED}},
        "gridcolor": GRID,
        "zerolinecolor": AXIS,
        "linecolor": AXIS,
        "showline": True,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": AXIS,
        "tickangle": 0,
        "nticks": 6,
    }


def line(x: Any, y: Any, colour: str, dash: str = "solid", *, hover: str = "", **more: Any) -> Trace:
    """A line through x, y (K,); `hover` is a hover template, none without it."""
    style = {"color": colour, "width": 2, "dash": dash}
    return {"type": "scatter", "mode": "lines", "x": x, "y": y, "line": style, **_hover(hover), **more}


def points(x: Any, y: Any, colour: str, size: float, opacity: float = 1.0, *, hover: str = "", **marker: Any) -> Trace:
    """Points at x, y (K,); `hover` as for a line, `marker` is merged over their style."""
    style = {"color": colour, "size": size, "opacity": opacity, **marker}
    return {"type": "scatter", "mode": "markers", "x": x, "y": y, "marker": style, **_hover(hover)}


def translucent(colour: str, opacity: float) -> str:
    """The colour #rrggbb with an opacity."""
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def spread_rows(row_count: int, most: int) -> NDArray[np.intp]:
    """At most `most` rows, spread evenly over all of them."""
    return np.unique(np.linspace(0, max(0, row_count - 1), min(row_count, most)).astype(np.intp))


def _hover(template: str) -> dict[str, str]:
    return {"hovertemplate": template + "<extra></extra>"} if template else {"hoverinfo": "skip"}
