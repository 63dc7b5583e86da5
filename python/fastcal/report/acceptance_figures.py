# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Drawings of an acceptance test: each limit with its figures, and the visits about each commanded pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fastcal.report import figures, workspace
from fastcal.report.arm import accepted_arm
from fastcal.report.figures import Figure, Key
from fastcal.report.language import _
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance

_VISITS_SHOWN = 400


def drawings(found: Acceptance) -> list[Figure]:
    """All drawings of the page."""
    return [_accuracies(found), _visits(found)]


def arm_in_space(found: Acceptance) -> Figure:
    """The arm at the commanded poses, with what was attained as arrows."""
    told = _("Each arrow points from the commanded point towards the mean of the attained points, magnified as stated.")
    positions, off, arm = accepted_arm(found)
    return workspace.scene(positions, off, None, np.zeros(3), _("the base"), arm, told=told)


def _accuracies(found: Acceptance) -> Figure:
    """AP and RP of each pose with U, and the limits."""
    traces, key = [], []
    for symbol, colour, mark, dash in (
        ("AP", figures.AFTER, "point", "dash"),
        ("RP", figures.BEFORE, "point", "dot"),
    ):
        several = [each for each in found.figures if each.figure.symbol == symbol]
        if not several:
            continue
        where = [each.figure.where for each in several]
        value = from_si(np.array([each.figure.value for each in several]), "mm")
        bar = from_si(np.array([each.uncertainty.expanded for each in several]), "mm")
        trace = figures.points(where, value, colour, 9, hover=f"{symbol} %{{y:.4f}} mm, %{{x}}")
        trace["error_y"] = {"type": "data", "array": bar, "color": colour, "thickness": 2, "width": 6}
        traces.append(trace)
        key.append(Key(symbol, colour, mark))
        limits = {each.limit for each in several if each.limit is not None}
        for limit in limits:
            edge = float(from_si(limit, "mm"))
            ends = [where[0], where[-1]]
            traces.append(figures.line(ends, [edge, edge], figures.ALERT, dash, hover=f"{edge:g} mm"))
            key.append(Key(_("limit of {symbol}", symbol=symbol), figures.ALERT, dash))
    drawn = figures.layout(_("pose"), _("AP, RP (mm)"), yaxis={"rangemode": "tozero"}, xaxis={"type": "category"})
    alt = _("Accuracy and repeatability of each pose with their expanded uncertainty, and the limits.")
    return Figure("accuracies", _("Accuracy and repeatability"), alt, traces, drawn, columns=3, height=330, key=key)


def _visits(found: Acceptance) -> Figure:
    """Attained less commanded points of every visit, seen from above."""
    names = list(dict.fromkeys(station.pose for station in found.campaign.stations))[:5]
    colours = dict(zip(names, (*figures.COMPONENT_COLOURS, figures.INK), strict=False))
    traces = []
    for k, station in enumerate(found.campaign.stations):
        if station.pose in colours:
            e = from_si(found.campaign.errors(k), "mm")
            shown = figures.spread_rows(len(e), _VISITS_SHOWN)
            hover = f"{station.pose}{station.direction}: %{{x:.4f}}, %{{y:.4f}} mm"
            traces.append(figures.points(e[shown, 0], e[shown, 1], colours[station.pose], 5, 0.55, hover=hover))
    drawn = figures.layout("x (mm)", "y (mm)", yaxis={"scaleanchor": "x", "scaleratio": 1})
    alt = _("Attained minus commanded points of all visits, in base coordinates.")
    key = [Key(name, colour, "point") for name, colour in colours.items()]
    return Figure("visits", _("Visits from above"), alt, traces, drawn, columns=3, height=330, key=key)
