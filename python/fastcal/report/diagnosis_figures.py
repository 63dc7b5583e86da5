# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The figures of a diagnosis: which causes were ruled out, how small they could be, and which look alike."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fastcal.diagnosis.reasons import Reason
from fastcal.report import figures, shop
from fastcal.report.diagnosis_tables import Smallest
from fastcal.report.diagnosis_words import reason_in_brief, spoken
from fastcal.report.figures import Figure, Key, Trace
from fastcal.report.formatting import fixed, percent, significant
from fastcal.report.gap import TAKEN
from fastcal.report.language import _, decimal_sign
from fastcal.report.tables import capitalised, places_in_words

if TYPE_CHECKING:
    from fastcal.diagnosis.result import Diagnosis

Array = NDArray[np.float64]

_MOST_ALTERNATIVES = 8
_LINE = 105  # letters of a cause and its reason that fit one line on paper
_MOST_LIMITS = 16
_SHORT_NAME = 30  # letters that a narrow screen has room for beside an axis
_BAND = [[0.0, "#ffffff"], [0.5, "#dbe7ee"], [0.8, "#8fb8cf"], [0.95, "#e09f3e"], [1.0, "#a11d1d"]]


def alternatives(found: Diagnosis, told: Callable[[str], str] = str) -> Figure | None:
    """The leading causes by the share of the misfit that each explains alone, named or ruled out, and why.

    `told`: a text with the names of a cell, where the diagnosis is of a way in one.
    """
    shown = sorted(found.ranking, key=lambda r: -r.share)[:_MOST_ALTERNATIVES]
    if not shown or found.verdict == "none":  # where nothing is missing there is nothing to have a share of
        return None
    is_given = [r.because.reason is Reason.GIVEN for r in shown]
    # The name of an arm is as its file has it.
    spoken_of = [(spoken(r.label), told(spoken(r.label))) for r in shown]
    names = [capitalised(plain) if own == plain else places_in_words(own) for plain, own in spoken_of]
    reasons = [places_in_words(told(reason_in_brief(r.because))) for r in shown]
    is_long = max(len(name) + len(reason) for name, reason in zip(names, reasons, strict=True)) > _LINE
    row, paper_row, between = (60, 48, "<br>") if is_long else (46, 34, ": ")
    share = [100 * max(r.share, 0.0) for r in shown]
    bars: Trace = {
        "type": "bar", "orientation": "h", "x": share, "y": list(range(len(shown))), "width": 16 / row,
        "marker": {"color": [TAKEN if given else figures.BEFORE for given in is_given]},
        "text": [percent(r.share) for r in shown], "textposition": "outside", "cliponaxis": False,
        "hovertemplate": "%{text}<extra></extra>",
    }  # fmt: skip
    drawn = figures.layout(
        _("share of the misfit that it explains alone (%)"), "",
        xaxis={"range": [0, 1.12 * max(*share, 1.0)]},
        yaxis={
            "range": [len(shown) - 0.6, -0.85], "showgrid": False, "zeroline": False, "showticklabels": False,
            "ticks": "",
        },
        margin={"l": 10},
    )  # fmt: skip
    drawn["annotations"] = [
        {
            "x": 0, "y": k - 0.24, "text": f"<b>{name}</b>{between}{reason}", "showarrow": False,
            "align": "left", "xanchor": "left", "yanchor": "bottom", "font": {"color": figures.INK},
        }
        for k, (name, reason) in enumerate(zip(names, reasons, strict=True))
    ]  # fmt: skip
    key = [Key(_("named"), TAKEN, "solid")] if any(is_given) else []
    key.append(Key(_("not named"), figures.BEFORE, "solid"))
    alt = _(
        "The leading causes by the share that each explains alone; the largest is {cause} with {share}.",
        cause=names[0],
        share=percent(shown[0].share),
    )
    return Figure(
        "alternatives", _("Reported and ruled-out causes"), alt, [bars], drawn, key=key, height=80 + row * len(shown),
        paper_height=60 + paper_row * len(shown),
        narrow={f"annotations[{k}].text": name for k, name in enumerate(names)},
    )  # fmt: skip


def limits(kinds: Sequence[Smallest]) -> Figure | None:
    """How small an effect would have shown, over its usual size: a bar an effect, from its best place to its worst.

    Left of 1 a usual size would have been noticed four times in five.
    """
    known = sorted((kind for kind in kinds if kind.ratios), key=lambda kind: max(kind.ratios))
    if not known:
        return None
    shown = known[-_MOST_LIMITS:]
    looks: tuple[tuple[Key, Callable[[list[float]], bool]], ...] = (
        (Key(_("detectable everywhere"), TAKEN, "solid"), lambda r: max(r) <= 1),
        (Key(_("undetectable at some places"), figures.COMPONENT_COLOURS[0], "solid"), lambda r: min(r) <= 1 < max(r)),
        (Key(_("undetectable everywhere"), figures.BEFORE, "solid"), lambda r: min(r) > 1),
    )
    traces, key = [], []
    for entry, fits in looks:
        some = [kind for kind in shown if fits(kind.ratios)]
        if not some:
            continue
        x = [end for kind in some for end in (min(kind.ratios), max(kind.ratios), None)]
        y = [place for kind in some for place in (kind.name, kind.name, None)]
        text = [
            _(
                "{times} times the usual {size}",
                times=significant(end, 2),
                size=shop.size_text(kind.unit, kind.typical or 0),
            )
            if end
            else ""
            for kind in some
            for end in (min(kind.ratios), max(kind.ratios), None)
        ]
        bar = figures.line(x, y, entry.colour, hover="%{y}: %{text}", mode="lines+markers", text=text)
        traces.append(bar | {"line": {"color": entry.colour, "width": 9}, "marker": {"color": entry.colour, "size": 9}})
        key.append(entry)
    names = [kind.name for kind in shown]
    traces.append(figures.line([1, 1], [names[0], names[-1]], figures.INK, "dash"))
    key.append(Key(_("usual size"), figures.INK, "dash"))
    drawn = figures.layout(
        _("smallest detectable size / usual size, logarithmic"), "",
        xaxis={"type": "log", "dtick": 1, "exponentformat": "none"},
        yaxis={
            "type": "category", "automargin": True, "nticks": 0, "dtick": 1, "categoryorder": "array",
            "categoryarray": names,
        },
        margin={"l": 120},
    )  # fmt: skip
    hidden = sum(max(kind.ratios) > 1 for kind in known)
    alt = _(
        "Smallest detectable size of each effect, relative to its usual size; for {count} of them even a usual size "
        "could go undetected.",
        count=hidden,
    )
    all_shown = len(known) == len(shown)
    note = (
        ""
        if all_shown
        else _("The {some} of {all} that are hardest to detect are drawn.", some=len(shown), all=len(known))
    )
    return Figure(
        "limits", _("The smallest sizes that would have been detected"), alt, traces, drawn, note, key=key,
        height=80 + 22 * len(shown), paper_height=60 + 15 * len(shown),
        narrow={"xaxis.dtick": 2, **_on_two_lines(names)},
    )  # fmt: skip


def _on_two_lines(names: Sequence[str]) -> dict[str, Any]:
    """Of categories with long names on a narrow screen: each on lines of few letters, and room for these."""
    if max(map(len, names)) <= _SHORT_NAME:
        return {}
    texts = ["<br>".join(textwrap.wrap(name, _SHORT_NAME)) for name in names]
    ticks = {"tickmode": "array", "tickvals": list(names), "ticktext": texts, "tickfont.size": 10}
    return {"height": 80 + 34 * len(names), **{f"yaxis.{key}": value for key, value in ticks.items()}}


def confusion_map(names: Sequence[str], correlation: Array, boxed: Collection[int]) -> Figure:
    """How alike the signatures of causes are in these data: |correlation| (n, n); boxed: those that are given."""
    n = len(names)
    size = np.abs(correlation)
    cells = [(y, x) for y in range(n) for x in range(n)]
    heat: Trace = {
        "type": "heatmap", "z": size, "x": list(range(n)), "y": list(range(n)), "zmin": 0, "zmax": 1, "xgap": 2,
        "ygap": 2, "colorscale": _BAND, "hoverinfo": "skip",
        "showscale": False,
    }  # fmt: skip
    written = {
        "type": "scatter", "mode": "text", "hoverinfo": "skip",
        "x": [x for _, x in cells], "y": [y for y, _ in cells],
        "text": [fixed(float(np.floor(100 * size[cell] + 1e-9)) / 100, 2).removeprefix("0") for cell in cells],
        "textfont": {"size": 11, "color": ["#fefefe" if size[cell] > 0.97 else figures.INK for cell in cells]},
    }  # fmt: skip
    numbers, spelled = [str(k + 1) for k in range(n)], [capitalised(name) for name in names]
    ticks = {"tickvals": list(range(n)), "ticktext": numbers, "showgrid": False, "side": "top"}
    ticks |= {"zeroline": False, "automargin": True, "ticks": "", "showline": False}
    rows = [f"{name}  {number}" for number, name in zip(numbers, spelled, strict=True)]
    drawn = figures.layout(
        "", "", xaxis=ticks, yaxis=ticks | {"autorange": "reversed", "ticktext": rows, "side": "left"}, margin={"t": 30}
    )
    drawn["shapes"] = [
        {"type": "rect", "x0": k - 0.5, "x1": k + 0.5, "y0": k - 0.5, "y1": k + 0.5,
         "line": {"color": figures.INK, "width": 3}} for k in boxed
    ]  # fmt: skip
    alt = _("Correlation of the signatures of the first causes: near 1 these data can hardly distinguish them.")
    limit = f"0{decimal_sign()}95"
    note = _(
        "Framed: the reported causes. Above {limit} two causes are hard to tell apart with the poses that were "
        "measured.",
        limit=limit,
    )
    narrow = {"yaxis.ticktext": numbers, "margin.l": 20}
    return Figure(
        "confusion", _("Which causes look alike"), alt, [heat, written], drawn, note, height=90 + 40 * n, narrow=narrow,
        names=spelled,
    )  # fmt: skip
