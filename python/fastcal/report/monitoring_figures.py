# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Drawings of the months after: errors of a check, what moved in standard deviations, a heat map, control charts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.events import misfit_of
from fastcal.monitoring.history import ArmHistory
from fastcal.monitoring.result import CheckResult, Test
from fastcal.report import figures
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import plural
from fastcal.report.language import _
from fastcal.report.tables import in_words, unit_text
from fastcal.units import from_si

_MOST_TESTS = 14
_CELLS = 14
_ENDS_AT = 3.0  # the colours of RMS found over expected
_RATIOS = [[0.0, "#dfe9ef"], [0.34, "#9cc3d8"], [0.5, "#f4b860"], [1.0, "#a11d1d"]]
_NARROW_MONTHS = 3  # that are named below a matrix on a narrow screen
_TOGETHER = 3  # arms that share a line of text beside rows of few pixels
ALL_NAMED = 40  # arms: of more each has a line of few pixels
_HEAT = [[0.0, "#f2f6f9"], [0.5, "#6ba3c2"], [1.0, "#0b3f5e"]]
_MOST_CHARTS = 4
DATES = {"type": "date", "tickformat": "%Y-%m-%d", "nticks": 4}  # months have names of a language


def errors(found: CheckResult) -> Figure:
    """The distance of each pose from the model, with what is expected of noise and the model."""
    kind = found.main.kind
    error, unit = from_si(found.errors(), kind.unit), unit_text(kind.unit)
    row = np.arange(len(error))
    expected = kind.shown(found.expected_rms)
    hover = _("row %{{x}}: %{{y:.3f}} {unit}", unit=unit)
    traces = [
        figures.points(row, error, figures.AFTER, 9, hover=hover),
        figures.line([-0.5, len(error) - 0.5], [expected, expected], figures.INK, "dash"),
    ]
    key = [Key(_("measured pose"), figures.AFTER, "point"), Key(_("expected, RMS"), figures.INK, "dash")]
    if found.tolerance is not None:
        limit = from_si(found.tolerance, "mm")
        traces.append(figures.line([-0.5, len(error) - 0.5], [limit, limit], figures.ALERT))
        key.append(Key(_("tolerance"), figures.ALERT, "solid"))
    drawn = figures.layout(
        _("data row"), _("distance from the model ({unit})", unit=unit), yaxis={"rangemode": "tozero"}
    )
    alt = _("Distance of each measured pose from the model after fitting the base, with the expected RMS.")
    return Figure("errors", _("Errors of the poses"), alt, traces, drawn, columns=3, key=key, paper_height=190)


def moved(found: CheckResult, name: str = "moved") -> Figure | None:
    """Estimates of all changes, each alone, in their standard deviations; the largest first."""
    shown = sorted((t for t in found.tests if t.std > 0), key=lambda t: -abs(t.value / t.std))[:_MOST_TESTS]
    if not shown:
        return None
    names = [_named(t) for t in shown][::-1]
    score = np.array([t.value / t.std for t in shown])[::-1]
    texts = [f"{t.value:.3g} ± {t.std:.2g} {t.unit}" for t in shown][::-1]
    trace = figures.points(score, names, figures.AFTER, 9, hover="%{y}: %{text}") | {"text": texts}
    limit = 3.0
    ends = [names[0], names[-1]]
    traces = [trace, *(figures.line([x, x], ends, figures.ALERT, "dot") for x in (-limit, limit))]
    drawn = figures.layout(
        _("change / its standard deviation"), "",
        yaxis={"type": "category", "automargin": True, "nticks": 0, "dtick": 1}, margin={"l": 120},
    )  # fmt: skip
    alt = _(
        "Every change that was tested, each on its own, in standard deviations; the largest is {name}.", name=names[-1]
    )
    note = _("A single change of the arm affects many of them; the verdict states the most likely one.")
    key = [Key(_("3 standard deviations"), figures.ALERT, "dot")]
    return Figure(
        name, _("What may have moved"), alt, traces, drawn, note, columns=3, key=key,
        height=60 + 24 * len(shown), paper_height=60 + 15 * len(shown),
    )  # fmt: skip


def _named(test: Test) -> str:
    return in_words(f"{test.owner} {test.name.removesuffix(f'_{test.unit}')}")


def heat_map(found: Comparison) -> Figure:
    """Mean distance between two models over the workspace: radius from joint 1's axis, height over the base."""
    radius = from_si(np.hypot(found.points[:, 0], found.points[:, 1]), "mm")
    height, distance = from_si(found.points[:, 2], "mm"), from_si(found.distance, "mm")
    x, y = (np.linspace(v.min(), v.max(), _CELLS + 1) for v in (radius, height))
    sums = np.histogram2d(height, radius, [y, x], weights=distance)[0]
    counts = np.histogram2d(height, radius, [y, x])[0]
    with np.errstate(invalid="ignore"):
        mean = np.where(counts > 0, sums / counts, np.nan)
    z = [[None if np.isnan(v) else float(v) for v in line] for line in mean]
    trace = {
        "type": "heatmap", "z": z, "x": (0.5 * (x[1:] + x[:-1])).tolist(), "y": (0.5 * (y[1:] + y[:-1])).tolist(),
        "zmin": 0, "colorscale": _HEAT, "xgap": 1, "ygap": 1, "hoverongaps": False,
        "colorbar": {"title": {"text": "mm", "side": "top"}, "thickness": 12, "outlinewidth": 0},
        "hovertemplate": _("radius %{{x:.0f}} mm, height %{{y:.0f}} mm: %{{z:.3f}} mm") + "<extra></extra>",
    }  # fmt: skip
    drawn = figures.layout(_("distance from the first axis (mm)"), _("height over the base (mm)"))
    worst = np.unravel_index(int(np.nanargmax(mean)), mean.shape)
    alt = _(
        "Heat map of the mean distance between the models; the largest, {size} mm, at {radius} mm from the first axis "
        "and {height} mm above the base.",
        size=f"{mean[worst]:.3f}", radius=f"{x[worst[1]]:.0f}", height=f"{y[worst[0]]:.0f}",
    )  # fmt: skip
    note = _("Mean over the postures that reach a cell; bases and tools are aligned.")
    return Figure(
        "heat", _("Where the models differ"), alt, [trace], drawn, note, columns=3, height=360, paper_height=210
    )


def control_charts(arm: ArmHistory, prefix: str) -> list[Figure]:
    """The misfit's EWMA and the CUSUM of the numbers nearest to their limit."""
    out = []
    for k, chart in enumerate(arm.charts[: 1 + _MOST_CHARTS]):
        when = [event.date for event in arm.checks]
        hover = "%{x}: %{y:.2f}"
        traces = [figures.line(when, chart.value, figures.AFTER, hover=hover, mode="lines+markers")]
        traces.append(figures.line(when, chart.limit, figures.ALERT, "dash"))
        key = [Key(_("limit"), figures.ALERT, "dash")]
        if chart.low is not None:
            traces.append(figures.line(when, chart.low, figures.BEFORE, hover=hover, mode="lines+markers"))
            traces.append(figures.line(when, -chart.limit, figures.ALERT, "dash"))
            key = [Key(_("upwards"), figures.AFTER, "solid"), Key(_("downwards"), figures.BEFORE, "solid"), *key]
        is_misfit = chart.low is None
        name = _("Misfit") if is_misfit else in_words(chart.name)
        title = _("{name}, EWMA", name=name) if is_misfit else _("{name}, CUSUM", name=name)
        drawn = figures.layout(_("date"), "\N{GREEK SMALL LETTER SIGMA}", xaxis=DATES)
        state = plural(len(chart.alarms), "alarm") if chart.alarms else _("no alarm")
        alt = _("Control chart of {name} over {checks} checks: {state}.", name=name, checks=len(when), state=state)
        drawing = Figure(f"{prefix}-{k}", title, alt, traces, drawn, columns=3, height=260, key=key)
        out.append(figures.marked(drawing, state, 3) if chart.alarms else drawing)
    return out


def months(arms: Sequence[ArmHistory]) -> Figure | None:
    """Arms by months: RMS found over expected of the last check of a month, alarms marked; None for one arm.

    A click on an arm leads to its part of the page, `arm-K` in the order of `arms`.
    """
    if len(arms) < 2:
        return None
    found: dict[tuple[int, str], float] = {}
    for k, arm in enumerate(arms):
        for e in arm.events:
            size = misfit_of(e.content) if e.kind == "check" else None
            if size is not None and size[1] > 0:
                found[k, e.date[:7]] = size[0] / size[1]
    if not found:
        return None
    columns = sorted({month for _k, month in found})
    ratio = [[found.get((k, month)) for month in columns] for k in range(len(arms))]
    alarmed = sorted({(k, a.date[:7]) for k, arm in enumerate(arms) for a in arm.alarms} & set(found))
    heat = {
        "type": "heatmap", "z": ratio, "x": columns, "y": list(range(len(arms))), "zmin": 0, "zmax": _ENDS_AT,
        "colorscale": _RATIOS, "xgap": 1, "ygap": 1, "hoverongaps": False,
        "text": [[arm.name] * len(columns) for arm in arms],
        "hovertemplate": "%{text}, %{x}: %{z:.2f}<extra></extra>",
        "colorbar": {"title": {"text": _("found / expected"), "side": "right"}, "thickness": 12, "outlinewidth": 0},
    }  # fmt: skip
    marks = figures.points(
        [month for _k, month in alarmed], [k for k, _month in alarmed], figures.INK, 9, symbol="x-thin-open"
    )
    drawn = figures.layout(
        _("month"), "",
        xaxis={"type": "category"},
        yaxis={
            "tickvals": list(range(len(arms))), "ticktext": [arm.name for arm in arms],
            "range": [len(arms) - 0.5, -0.5],
            "automargin": True, "showgrid": False, "zeroline": False,
        },
    )  # fmt: skip
    many = len(arms) > ALL_NAMED
    alt = _("Matrix of {count} arms by months, coloured by the RMS found over the expected one.", count=len(arms))
    note = _("A cross is an alarm. A click on an arm opens its charts.")
    if many:  # there is room for the names of those alone that stand apart
        asking = [k for k, arm in enumerate(arms) if arm.state in ("changed", "alarm")]
        beside = [asking[k : k + _TOGETHER] for k in range(0, len(asking), _TOGETHER)]
        texts = [", ".join(arms[k].name for k in of) for of in beside]
        drawn["yaxis"] |= {"tickvals": [sum(of) / len(of) for of in beside], "ticktext": texts, "ticks": ""}
    return Figure(
        "months", _("Every arm, month by month"), alt, [heat, marks], drawn, note,
        key=[Key(_("alarm"), figures.INK, "cross")], height=110 + (6 if many else 22) * len(arms),
        paper_height=90 + (4 if many else 15) * len(arms), links=[f"arm-{k}" for k in range(len(arms))],
        narrow={
            "xaxis.tickvals": columns[:: -(-len(columns) // _NARROW_MONTHS)],
            **({"yaxis.showticklabels": False} if many else {}),
        },
    )  # fmt: skip


def ratio_chart(arms: Sequence[ArmHistory]) -> Figure | None:
    """RMS found over expected of every check of every arm."""
    traces = []
    for arm in arms:
        sizes = [(e, misfit_of(e.content)) for e in arm.events if e.kind == "check"]
        checks = [(e, size[0] / size[1]) for e, size in sizes if size is not None and size[1] > 0]
        if checks:
            ratio = np.array([each for _, each in checks])
            colour = figures.ALERT if arm.state == "changed" else figures.AFTER
            hover = f"{arm.name}, %{{x}}: %{{y:.2f}}"
            traces.append(
                figures.line([e.date for e, _ in checks], ratio, colour, hover=hover, mode="lines+markers", opacity=0.7)
            )
    if not traces:
        return None
    drawn = figures.layout(_("date"), _("RMS found / expected"), xaxis=DATES, yaxis={"rangemode": "tozero"})
    alt = _("RMS of every check relative to the expected RMS, one line per arm; 1 is the level of the noise.")
    key = [Key(_("arm that holds"), figures.AFTER, "solid"), Key(_("arm that has changed"), figures.ALERT, "solid")]
    return Figure("ratio", _("All checks"), alt, traces, drawn, columns=6, height=300, key=key)
