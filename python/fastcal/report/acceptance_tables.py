# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The tables of an acceptance test's page: figures, poses, budget, and what the model knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fastcal.acceptance.judgement import ALIKE, UNITS
from fastcal.report.formatting import fixed, percent, significant, with_uncertainty
from fastcal.report.language import _, decimal_sign
from fastcal.report.tables import Cell, Column, Group, Table, number_cell
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance
    from fastcal.acceptance.judgement import Judged

_IN_POSES = ("AP_x", "AP_y", "AP_z")  # they stand in the table of the poses
_LEAST_MM = 1e-7  # what rounding leaves of a contribution that an alignment takes away


def shown(each: Judged) -> tuple[str, str, str]:
    """Value, expanded uncertainty and limit in the unit of the page."""
    unit = UNITS[each.figure.unit]
    value, expanded = from_si(each.figure.value, unit), from_si(each.uncertainty.expanded, unit)
    uncertainty_text, value_text = with_uncertainty(expanded or None, value)
    if not expanded:
        value_text = significant(value)
    limit = "" if each.limit is None else f"{from_si(each.limit, unit):.6g}".replace(".", decimal_sign())
    return value_text, uncertainty_text, limit


def odds_text(probability: float | None) -> str:
    """A probability in percent; how small or near to certain it is beyond a thousandth is left open."""
    if probability is None:
        return "\N{EN DASH}"
    bounded = min(max(probability, 1 - ALIKE), ALIKE)
    sign = "" if bounded == probability else "<\N{NO-BREAK SPACE}" if probability < bounded else ">\N{NO-BREAK SPACE}"
    return f"{sign}{fixed(100 * bounded, 1)}\N{NARROW NO-BREAK SPACE}%"


def figures_table(found: Acceptance) -> Table:
    """A row a figure; orientations after positions."""
    columns = [
        Column(_("Figure"), numeric=False),
        Column(_("Pose"), numeric=False),
        Column(_("Value")),
        Column("U"),
        Column("k"),
        Column(_("U by draws")),
        Column(_("Limit")),
        Column("g"),
        Column("P"),
        Column(_("Verdict"), numeric=False),
    ]
    verdicts = {"pass": _("pass"), "fail": _("fail"), "cannot_tell": _("cannot tell"), None: ""}
    groups: dict[str, list[list[Cell]]] = {}
    for each, drawn in zip(found.figures, found.simulated, strict=True):
        if each.figure.symbol in _IN_POSES:
            continue
        unit = UNITS[each.figure.unit]
        value, expanded, limit = shown(each)
        by_draws = "" if drawn is None else significant(from_si(drawn, unit), 2)
        guard = "" if each.guard is None else significant(from_si(each.guard, unit), 2)
        odds = "" if each.probability is None else odds_text(each.probability)
        texts = [value, expanded, fixed(each.uncertainty.coverage_factor, 2), by_draws, limit, guard]
        cells = [Cell(each.figure.symbol), Cell(each.figure.where), *map(Cell, [*texts, odds, verdicts[each.verdict]])]
        groups.setdefault(_("Positions (mm)") if each.figure.unit == "m" else _("Orientations (°)"), []).append(cells)
    return Table(_("Figures of ISO 9283"), columns, [Group(rows, title) for title, rows in groups.items()])


def poses_table(found: Acceptance) -> Table:
    """Commanded points, and the mean attained ones less them."""
    columns = [Column(_("Pose"), numeric=False), Column(_("Approached from"), numeric=False), Column(_("Visits"))]
    columns += [Column(f"{axis} (mm)") for axis in "xyz"]
    columns += [Column(f"{axis}\N{COMBINING MACRON} \N{MINUS SIGN} {axis} (mm)") for axis in "xyz"]
    rows = []
    for k, station in enumerate(found.campaign.stations):
        at = from_si(station.commanded[:3, 3], "mm")
        off = from_si(found.campaign.errors(k).mean(axis=0), "mm")
        side = f"±{station.direction}" if station.direction else _("the pose before")
        rows.append(
            [
                Cell(station.pose),
                Cell(side),
                number_cell(str(len(station.rows)), len(station.rows)),
                *(number_cell(fixed(float(v), 2), float(v)) for v in at),
                *(number_cell(fixed(float(v), 4), float(v)) for v in off),
            ]
        )
    return Table(
        _("Commanded poses in the base frame, and the deviation of the mean attained points from them"),
        columns,
        [Group(rows)],
    )


def budget_table(found: Acceptance) -> Table | None:
    """Contributions to the uncertainty of AP, the root mean square over the poses; None without a budget."""
    if found.budget is None:
        return None
    figures = [each.uncertainty for each in found.figures if each.figure.symbol == "AP"]
    total = float(np.mean([u.standard**2 for u in figures]))
    kinds = {each.name: each for each in found.budget.inputs}
    parts = {name: [dict(u.parts).get(name, 0.0) for u in figures] for name in kinds}
    rows = [_contribution(_("visits"), _("observed"), "", [u.observed for u in figures], total)]
    for name, values in sorted(parts.items(), key=lambda part: -float(np.sum(np.square(part[1])))):
        rows.append(
            _contribution(name, _kind(kinds[name].kind), _distribution(kinds[name].distribution), values, total)
        )
    rows.append(_contribution(_("combined"), "", "", [u.standard for u in figures], total))
    columns = [Column(title, numeric=False) for title in (_("Input"), _("Kind"), _("Distribution"))]
    return Table(
        _("Contributions to the standard uncertainty of AP"),
        [*columns, Column(_("u (mm)")), Column(_("Share of the variance"))],
        [Group(rows)],
    )


def volume_table(found: Acceptance) -> Table | None:
    """How surely the model knows its points; None where it was not calibrated."""
    known = found.predicted
    if known is None:
        return None
    columns = [Column(_("Point"), numeric=False), *(Column(f"{axis} (mm)") for axis in "xyz")]
    columns += [Column(f"U({axis}) (mm)") for axis in "xyz"] + [Column(_("U, worst direction (mm)"))]
    rows = []
    for name, point, coordinates, worst in zip(known.names, known.points, known.coordinates, known.worst, strict=True):
        at = [number_cell(fixed(float(v), 1), float(v)) for v in from_si(point, "mm")]
        sizes = [float(from_si(u.expanded, "mm")) for u in (*coordinates, worst)]
        rows.append([Cell(name), *at, *(number_cell(significant(size, 2), size) for size in sizes)])
    return Table(_("Expanded uncertainty of the model's own prediction"), columns, [Group(rows)])


def _kind(name: str) -> str:
    return {
        "range": _("range"),
        "angle": _("angle"),
        "position": _("position"),
        "target": _("target"),
        "orientation": _("orientation"),
        "temperature": _("temperature"),
        "payload": _("payload"),
        "masses": _("masses"),
    }[name]


def _distribution(name: str) -> str:
    return {
        "normal": _("normal"),
        "rectangular": _("rectangular"),
        "triangular": _("triangular"),
        "arcsine": _("arcsine"),
    }[name]


def _contribution(name: str, kind: str, distribution: str, values: list[float], total: float) -> list[Cell]:
    square = float(np.mean(np.square(values)))
    size = float(from_si(square**0.5, "mm"))
    return [
        Cell(name),
        Cell(kind),
        Cell(distribution),
        number_cell(significant(size, 2) if size > _LEAST_MM else "0", size),
        number_cell(percent(square / total) if total > 0 else "", square),
    ]
