# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The flat figures: share of poses within an error, histogram, residual against a variable, normal plot."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from fastcal.report import figures
from fastcal.report.figures import Figure, Key, Trace
from fastcal.report.formatting import plural, significant
from fastcal.report.language import _, decimal_sign
from fastcal.report.trends import binned_medians, judged_rows

Array = NDArray[np.float64]

_HISTOGRAM_DASHES = ("solid", "dash")
_NORMAL_PLOT_SIGMAS = 15
_DENSE = 20  # points of a panel above which they fade


def cumulative(curves: list[tuple[str, Array, str, str]], unit: str) -> Figure:
    """Share of poses with an error up to x, on a logarithmic axis; curves are (name, errors (N,), colour, dash)."""
    traces, low, high = [], np.inf, 0.0
    for name, errors, colour, dash in curves:
        errors = np.sort(errors[np.isfinite(errors) & (errors > 0.0)])
        if len(errors) == 0:
            continue
        shown = figures.spread_rows(len(errors), 400)
        low, high = min(low, float(errors[shown[len(shown) // 50]])), max(high, float(errors[-1]))
        hover = _("{name}: %{{y:.1f}} % of poses within %{{x:.3g}} {unit}", name=name, unit=unit)
        traces.append(figures.line(errors[shown], 100.0 * (shown + 1.0) / len(errors), colour, dash, hover=hover))
    span = [math.log10(low / 1.5), math.log10(high * 1.3)] if traces else [-2.0, 1.0]
    ticks = [step * 10.0**power for power in range(math.floor(span[0]), math.ceil(span[1])) for step in (1, 2, 5)]
    ticks = ticks if span[1] - span[0] < 2.6 else ticks[::3]
    drawn = figures.layout(
        _("error ({unit}), logarithmic", unit=unit),
        _("poses within (%)"),
        xaxis={
            "type": "log",
            "range": span,
            "tickvals": ticks,
            "ticktext": [f"{tick:.10g}".replace(".", decimal_sign()) for tick in ticks],
        },
        yaxis={"range": [0, 101]},
    )
    alt = _("Cumulative share of poses against their error, before and after calibration: further left is better.")
    key = [Key(name, colour, dash) for name, _, colour, dash in curves]
    return Figure("cumulative", _("Share of poses within an error"), alt, traces, drawn, columns=3, key=key)


def histogram(samples: list[tuple[str, Array, str]], unit: str) -> Figure:
    """Share of poses by error; samples are (name, errors (N,), colour), the first filled. The last bin is open."""
    known = [(name, errors[np.isfinite(errors)], colour) for name, errors, colour in samples]
    pooled = np.concatenate([errors for _, errors, _ in known])
    top = min(float(pooled.max()) * 1.02, 3.0 * float(np.quantile(pooled, 0.75))) if len(pooled) else 1.0
    bin_count = int(np.clip(3.0 * np.cbrt(min(len(errors) for _, errors, _ in known)), 8, 40))
    edges = np.linspace(0.0, top or 1.0, bin_count + 1)
    traces: list[Trace] = []
    for (name, errors, colour), dash in zip(known, _HISTOGRAM_DASHES, strict=False):
        share = 100.0 * np.histogram(np.minimum(errors, edges[-1]), edges)[0] / max(1, len(errors))
        fill = {"fill": "tozeroy", "fillcolor": figures.translucent(colour, 0.12)} if not traces else {}
        hover = _("{name}: %{{y:.1f}} % of poses near %{{x:.3g}} {unit}", name=name, unit=unit)
        steps = np.repeat(edges, 2), np.pad(np.repeat(share, 2), 1)
        traces.append(figures.line(*steps, colour, dash, hover=hover, **fill))
    beyond = int(np.count_nonzero(pooled > edges[-1]))
    drawn = figures.layout(
        _("error after calibration ({unit})", unit=unit), _("poses (%)"), yaxis={"rangemode": "tozero"}
    )
    drawn["xaxis"]["range"] = [0.0, float(edges[-1])]
    alt = _("Histogram of the error after calibration, in percent of the poses.")
    note = _("Errors beyond the axis ({count}) are counted in the last bin.", count=beyond) if beyond else ""
    key = [Key(name, colour, dash) for (name, _, colour), dash in zip(samples, _HISTOGRAM_DASHES, strict=False)]
    return Figure("histogram", _("Error after calibration"), alt, traces, drawn, note, columns=3, key=key)


def component_key(components: tuple[str, ...]) -> list[Key]:
    """The key of trend panels: one line a residual component."""
    styles = zip(components, figures.COMPONENT_COLOURS, figures.COMPONENT_DASHES, strict=False)
    return [Key(name, colour, dash) for name, colour, dash in styles]


def trend_panel(
    id_: str,
    titles: tuple[str, str],
    x: Array,
    residual: Array,
    key: list[Key],
    y_range: float,
    shown: NDArray[np.intp],
    unit: str = "mm",
) -> Figure:
    """Residual (N, m) in a unit against x (N,): the `shown` rows as points; medians of all rows, with their 95 % bands.

    Of very many rows the medians are those of some, of `judged_rows`.
    `titles` are those of the panel and of its x axis; `key` gives each of the m columns its name and look.
    """
    opacity = float(np.clip(_DENSE / max(len(shown), 1), 0.22, 0.7))
    traces = [
        figures.points(x[shown], y[shown], entry.colour, 3, opacity) for entry, y in zip(key, residual.T, strict=True)
    ]
    judged = judged_rows(len(x))
    for entry, bins in zip(key, binned_medians(x[judged], residual[judged]), strict=True):
        if len(bins.x) == 0:
            continue
        around = np.concatenate([bins.x, bins.x[::-1]]), np.concatenate([bins.low, bins.high[::-1]])
        fill = {"fill": "toself", "fillcolor": figures.translucent(entry.colour, 0.18), "line": {"width": 0}}
        hover = _("{component}: median %{{y:.3g}} {unit} at %{{x:.4g}}", component=entry.label, unit=unit)
        traces.append(figures.line(*around, entry.colour) | fill)
        traces.append(figures.line(bins.x, bins.median, entry.colour, entry.mark, hover=hover))
    title, x_title = titles
    y_title = _("residual ({unit})", unit=unit)
    drawn = figures.layout(x_title, y_title, yaxis={"range": [-y_range, y_range]}, xaxis={"nticks": 5})
    drawn["margin"] |= {"l": 64, "t": 6, "b": 42}
    alt = _("Residual against {variable}, with the running median of each component.", variable=x_title)
    return Figure(f"trend-{id_}", title, alt, traces, drawn, columns=2, height=230)


def normal_plot(
    residual: Array, sigma: float, is_outlier: NDArray[np.bool_], most: int = 1500, unit: str = "mm"
) -> Figure:
    """Sorted residual components (M,) in a unit against normal quantiles, with the line of noise sigma in it.

    Quantile of rank k: (k - 3/8) / (M + 1/4) (Blom 1958). Of many points the middle is thinned, the tails are not.
    """
    known = np.flatnonzero(np.isfinite(residual))
    order = known[np.argsort(residual[known])]
    shown = np.arange(len(order))[_thin_middle(len(order), most)]
    quantile = NormalDist().inv_cdf
    x = np.array([quantile((k + 0.625) / (len(order) + 0.25)) for k in shown.tolist()])
    y, outlying = residual[order][shown], is_outlier[order][shown]
    hover = _("residual %{{y:.3g}} {unit} at normal quantile %{{x:.2f}}", unit=unit)
    traces = [figures.points(x[~outlying], y[~outlying], figures.AFTER, 5, 0.75, hover=hover)]
    key = [Key(_("residual component"), figures.AFTER, "point")]
    if outlying.any():
        traces.append(figures.points(x[outlying], y[outlying], figures.ALERT, 6, 0.75, hover=hover, symbol="x"))
        key.append(Key(_("of an outlying row"), figures.ALERT, "cross"))
    reach = float(np.abs(x).max(initial=1.0))
    traces.append(figures.line([-reach, reach], [-reach * sigma, reach * sigma], figures.INK, "dash"))
    key.append(Key(_("normal noise of {sigma} {unit}", sigma=significant(sigma, 2), unit=unit), figures.INK, "dash"))
    largest = max(float(np.abs(y).max(initial=0.0)), reach * sigma) or 1.0
    top = min(1.08 * largest, _NORMAL_PLOT_SIGMAS * sigma or math.inf)
    drawn = figures.layout(_("normal quantile (standard deviations)"), _("residual component ({unit})", unit=unit))
    drawn["yaxis"]["range"] = [-top, top]
    beyond = int(np.count_nonzero(np.abs(residual[known]) > top))
    note = ""
    if beyond:
        note = _(
            "{components} beyond {limit} standard deviations not drawn.",
            components=plural(beyond, "component"),
            limit=_NORMAL_PLOT_SIGMAS,
        )
    alt = _("Normal plot: sorted residual components against normal quantiles; normal noise lies on the dashed line.")
    return Figure("normal", _("Normal plot of the residual"), alt, traces, drawn, note, columns=4, height=340, key=key)


def _thin_middle(total: int, most: int) -> NDArray[np.intp]:
    if total <= most:
        return np.arange(total)
    tail = most // 4
    middle = np.linspace(tail, total - 1 - tail, most - 2 * tail).astype(np.intp)
    return np.unique(np.concatenate([np.arange(tail), middle, np.arange(total - tail, total)]))
