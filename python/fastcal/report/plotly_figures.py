# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The report's figures as Plotly figures with a legend, for a notebook; all that needs Plotly's Python side."""

from __future__ import annotations

import zlib
from typing import Any

from plotly import graph_objects
from plotly.subplots import make_subplots

from fastcal.report import figures
from fastcal.report.figures import Figure
from fastcal.report.still import still
from fastcal.report.tables import capitalised

_LEGEND = 46  # CSS pixels below a figure for the legend, which may take two lines


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
        figure.add_trace(_legend_entry(entry))
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


def _legend_entry(entry: figures.Key) -> graph_objects.Scatter:
    is_line = entry.mark not in ("point", "cross")
    return graph_objects.Scatter(
        x=[None],
        y=[None],
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
