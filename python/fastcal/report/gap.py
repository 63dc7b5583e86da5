# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The gap: the error before, what each part of the model took of it, what remains, and what noise alone would make."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from fastcal.report import figures
from fastcal.report.figures import Figure, Key, Trace
from fastcal.report.formatting import alike, significant
from fastcal.report.language import _
from fastcal.report.tables import capitalised, unit_text

TAKEN = "#009e73"
_TEXT = 0.25  # of the longest bar, about what a size takes on a narrow screen


def waterfall(
    steps: Sequence[tuple[str, float]], floor: float, on: str, kind_unit: str = "mm", first: str = ""
) -> Figure:
    """RMS error of the geometry alone, what each effect takes away, what remains, and what noise alone makes.

    Args:
        steps: (name, RMS with it and all before it), geometry first.
        floor: RMS that noise alone would make.
        on: The poses, as in "test poses".
        kind_unit: Of all these.
        first: What the first step is, where that is not the geometry.
    """
    unit = unit_text(kind_unit)
    names = [first or _("geometry alone")]
    base, height, colours, texts = [0.0], [steps[0][1]], [figures.BEFORE], [f"{alike(steps[0][1], floor)} {unit}"]
    for (_was, before), (name, after) in pairwise(steps):
        names.append(_("with {name}", name=name))
        base.append(min(before, after))
        height.append(abs(before - after))
        colours.append(TAKEN if after <= before else figures.ALERT)
        sign = "\N{MINUS SIGN}" if after <= before else "+"
        texts.append(f"{sign}{_beside(abs(before - after), floor)} {unit}")
    if len(steps) > 1:
        names.append(_("what remains"))
        base.append(0.0)
        height.append(steps[-1][1])
        colours.append(figures.AFTER)
        texts.append(f"{alike(steps[-1][1], floor)} {unit}")
    bars: Trace = {
        "type": "bar", "orientation": "h", "x": height, "base": base, "y": list(range(len(names))), "width": 0.5,
        "marker": {"color": colours}, "customdata": texts,
        "hovertemplate": "%{customdata}<extra></extra>",
    }  # fmt: skip
    ends = [-0.8, len(names) - 0.5]
    top = max(floor, *(b + h for b, h in zip(base, height, strict=True)))
    drawn = figures.layout(
        _("RMS error ({unit})", unit=unit),
        "",
        xaxis={"range": [0, 1.16 * top]},
        yaxis={
            "range": ends[::-1],
            "showgrid": False,
            "zeroline": False,
            "showticklabels": False,
            "ticks": "",
        },
        margin={"l": 10},
    )
    # Names stand above their bars and not beside them: so they have room on any screen. The noise is drawn beside bars
    # alone, sizes stand beyond it: no line runs through a word.
    texted = {"showarrow": False, "xanchor": "left", "font": {"color": figures.INK}}
    drawn["annotations"] = [
        texted | {"x": 0, "y": place - 0.3, "yanchor": "bottom", "text": capitalised(name)}
        for place, name in enumerate(names)
    ] + [
        texted | {"x": _beyond(b + h, floor, top), "y": place, "yanchor": "middle", "text": text, "xshift": 4}
        for place, (b, h, text) in enumerate(zip(base, height, texts, strict=True))
    ]
    places = [y for place in range(len(names)) for y in (place - 0.3, place + 0.3, None)]
    traces = [bars, figures.line([floor] * len(places), places, figures.INK, "dash")]
    key = [Key(_("error"), figures.BEFORE, "solid")]
    if len(steps) > 1:
        key += [Key(_("removed by an effect"), TAKEN, "solid"), Key(_("what remains"), figures.AFTER, "solid")]
    key.append(Key(_("noise alone"), figures.INK, "dash"))
    alt = _(
        "Error on the {poses}: first {before}, then how much each step removes, what remains, and the noise.",
        poses=on,
        before=names[0],
    )
    title = _("RMS error on the {poses}", poses=on)
    return Figure("gap", title, alt, traces, drawn, columns=6, height=90 + 54 * len(names), key=key,
                  paper_height=56 + 38 * len(names),
                  narrow={"xaxis.range": [0, 1.5 * top]})  # fmt: skip


def _beyond(end: float, floor: float, top: float) -> float:
    """Where the size of a bar is written that ends here: behind the line of the noise, where that would cross it."""
    return floor if end < floor < end + _TEXT * top else end


def _beside(size: float, floor: float) -> str:
    """A size with the decimals of the noise; of one that these would make nothing, its first digit."""
    text = alike(size, floor)
    return text if size == 0 or any(digit in "123456789" for digit in text) else significant(size, 1)
