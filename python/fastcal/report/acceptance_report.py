# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of an acceptance test, its lines on the terminal, and its files accept.json and report.html."""

from __future__ import annotations

import os
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from fastcal.acceptance.judgement import SURE, Judged
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.report import acceptance_figures, page
from fastcal.report.document import document_facts
from fastcal.report.formatting import fixed, percent, plural, significant, with_uncertainty
from fastcal.report.language import _, decimal_sign, in_language
from fastcal.report.tables import Cell, Column, Group, Table, number_cell
from fastcal.report.words import Remark, Verdict
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance

FILES = ("accept.json", "report.html")
_IN_POSES = ("AP_x", "AP_y", "AP_z")  # they stand in the table of the poses
_UNITS = {"m": "mm", "rad": "deg"}
_SHOWN = {"mm": "mm", "deg": "°"}
_LEAST_MM = 1e-7  # what rounding leaves of a contribution that an alignment takes away
_SMALL = 0.001  # a probability that is not told more finely
_TONES = {"pass": "good", "fail": "bad", "cannot_tell": "caution", None: "caution"}


def write_acceptance(found: Acceptance, folder: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes accept.json and report.html into a folder, both or none."""
    with atomic_folder(folder, owned=FILES) as place:
        write_json(place / "accept.json", found.to_json_dict())
        (place / "report.html").write_text(acceptance_page(found, language), encoding="utf-8")


def acceptance_page(found: Acceptance, language: str = "en") -> str:
    """The HTML text of the page."""
    with in_language(language):
        source = PurePath(found.campaign.data.source.split(", ")[0]).name
        return page.render(
            "acceptance.html",
            title=_("Acceptance test of {robot}", robot=found.model.name),
            robot_name=found.model.name,
            simulated=False,
            source=source,
            rows=plural(sum(len(s.rows) for s in found.campaign.stations), _("measured stop"), _("measured stops")),
            verdict=_verdict(found),
            tiles=_tiles(found),
            figures_table=_figures_table(found),
            poses_table=_poses_table(found),
            budget_table=_budget_table(found),
            volume_table=_volume_table(found),
            drawings=acceptance_figures.drawings(found),
            method=_method(found),
            document=document_facts(found.made_by),
            rule=_(
                "U is the expanded uncertainty, k its coverage factor. A limit is kept where the true figure lies "
                "within it with a probability P of at least {sure}, exceeded where P is at most {rest}; in between, "
                "within the guard band g, the measurement cannot decide (ISO 14253-1, JCGM 106).",
                sure=percent(SURE),
                rest=percent(1 - SURE),
            ),
        )


def acceptance_lines(found: Acceptance, source: str) -> list[str]:
    """What `fastcal accept` prints."""
    lines = [f"{found.model.name} on {source}: {_words(found.verdict)}"]
    lines[0] += "" if found.probability is None else f", probability of keeping the limits {found.probability:.3f}"
    for symbol in dict.fromkeys(each.figure.symbol for each in found.figures if "_" not in each.figure.symbol):
        several = [each for each in found.figures if each.figure.symbol == symbol]
        worst = max(several, key=lambda each: abs(each.figure.value))
        value, expanded = (from_si(abs(v), "mm") for v in (worst.figure.value, worst.uncertainty.expanded))
        limit = "" if worst.limit is None else f", limit {from_si(worst.limit, 'mm'):g} mm"
        lines.append(f"{symbol}: at most {value:.4f} mm at {worst.figure.where}, +- {expanded:.4f} mm{limit}")
    for symbol in ("AP", "RP"):
        turned = [e for e in found.figures if e.figure.symbol.startswith(f"{symbol}_r")]
        if turned:
            worst = max(turned, key=lambda each: abs(each.figure.value))
            lines.append(
                f"{worst.figure.symbol}: at most {from_si(abs(worst.figure.value), 'deg'):.4f} deg at "
                f"{worst.figure.where}, +- {from_si(worst.uncertainty.expanded, 'deg'):.4f} deg"
            )
    return lines


def _words(verdict: str | None) -> str:
    return {"pass": "pass", "fail": "fail", "cannot_tell": "cannot tell", None: "not judged"}[verdict]


def _verdict(found: Acceptance) -> Verdict:
    word = {
        "pass": _("Pass"),
        "fail": _("Fail"),
        "cannot_tell": _("Cannot tell"),
        None: _("Not judged"),
    }[found.verdict]
    headline = {
        "pass": _("The arm keeps every limit that was set."),
        "fail": _("The arm is out of a limit."),
        "cannot_tell": _("The measurement cannot decide whether the arm keeps its limits."),
        None: _("No limit was given: the figures stand without a verdict."),
    }[found.verdict]
    judged = [each for each in found.figures if each.verdict is not None]
    remarks = [Remark(_judged_sentence(each), each.verdict != "pass", "figures") for each in _worst(judged)]
    remarks += [Remark(text, True, "method") for text in _cautions(found)]
    return Verdict(_TONES[found.verdict], word, headline, remarks)


def _worst(judged: list[Judged]) -> list[Judged]:
    """Of each symbol the figure that keeps its limit least surely."""
    best: dict[str, Judged] = {}
    for each in judged:
        known = best.get(each.figure.symbol)
        if known is None or (each.probability or 0) < (known.probability or 0):
            best[each.figure.symbol] = each
    return list(best.values())


def _judged_sentence(each: Judged) -> str:
    value, expanded, limit = _texts(each)
    return _(
        "{symbol} at {where}: {value} ± {expanded} {unit}, limit {limit} {unit}; kept with a probability of {odds}.",
        symbol=each.figure.symbol,
        where=each.figure.where,
        value=value,
        expanded=expanded,
        limit=limit,
        unit=_SHOWN[_UNITS[each.figure.unit]],
        odds=_odds(each.probability),
    )


def _odds(probability: float | None) -> str:
    if probability is None:
        return "\N{EN DASH}"
    said = min(max(probability, _SMALL), 1 - _SMALL)
    sign = "" if said == probability else "< " if probability < said else "> "
    return f"{sign}{fixed(100 * said, 1)}\N{NARROW NO-BREAK SPACE}%"


def _cautions(found: Acceptance) -> list[str]:
    """The notes of the test in the language of the page."""
    out = [
        _("A limit is given for {name}, and nothing was measured that shows it.", name=name) for name in found.missing
    ]
    if found.budget is None:
        out.append(_("No budget was given: the uncertainties hold the scatter of the visits alone."))
    if not found.is_iso_9283:
        out.append(_("The plan of ISO 9283, five poses with thirty visits each, is not met."))
    if found.campaign.fitted:
        out.append(
            _("The instrument was aligned to the poses: AP holds nothing that a rigid motion of all would explain.")
        )
    return out


def _texts(each: Judged) -> tuple[str, str, str]:
    """Value, expanded uncertainty and limit in the unit of the page."""
    unit = _UNITS[each.figure.unit]
    value, expanded = from_si(each.figure.value, unit), from_si(each.uncertainty.expanded, unit)
    said = with_uncertainty(expanded or None, value)
    limit = "" if each.limit is None else f"{from_si(each.limit, unit):.6g}".replace(".", decimal_sign())
    return said[1], said[0], limit


def _tiles(found: Acceptance) -> list[tuple[str, str, str]]:
    out = []
    for symbol, name in (
        ("AP", _("Accuracy AP, largest")),
        ("RP", _("Repeatability RP, largest")),
        ("AD", _("Distance accuracy AD")),
        ("vAP", _("Variation of direction vAP")),
    ):
        several = [each for each in found.figures if each.figure.symbol == symbol]
        if several:
            worst = max(several, key=lambda each: abs(each.figure.value))
            value, expanded, _limit = _texts(worst)
            out.append((name, f"{value} mm", f"± {expanded} mm, {worst.figure.where}"))
    return out


def _figures_table(found: Acceptance) -> Table:
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
        unit = _UNITS[each.figure.unit]
        value, expanded, limit = _texts(each)
        by_draws = "" if drawn is None else significant(from_si(drawn, unit), 2)
        guard = "" if each.guard is None else significant(from_si(each.guard, unit), 2)
        odds = "" if each.probability is None else _odds(each.probability)
        texts = [value, expanded, fixed(each.uncertainty.coverage_factor, 2), by_draws, limit, guard]
        cells = [Cell(each.figure.symbol), Cell(each.figure.where), *map(Cell, [*texts, odds, verdicts[each.verdict]])]
        groups.setdefault(_("Positions (mm)") if each.figure.unit == "m" else _("Orientations (°)"), []).append(cells)
    return Table(_("Figures of ISO 9283"), columns, [Group(rows, title) for title, rows in groups.items()])


def _poses_table(found: Acceptance) -> Table:
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
        _("Commanded poses in the base, and how far the mean attained points are from them"), columns, [Group(rows)]
    )


def _budget_table(found: Acceptance) -> Table | None:
    """Contributions to the uncertainty of AP, the root mean square over the poses; None without a budget."""
    if found.budget is None:
        return None
    figures = [each.uncertainty for each in found.figures if each.figure.symbol == "AP"]
    total = float(np.mean([u.standard**2 for u in figures]))
    kinds = {each.name: each for each in found.budget.inputs}
    parts = {name: [dict(u.parts).get(name, 0.0) for u in figures] for name in kinds}
    rows = [_contribution(_("visits"), _("observed"), "", [u.observed for u in figures], total)]
    for name, values in sorted(parts.items(), key=lambda part: -float(np.sum(np.square(part[1])))):
        rows.append(_contribution(name, kinds[name].kind, _distribution(kinds[name].distribution), values, total))
    rows.append(_contribution(_("combined"), "", "", [u.standard for u in figures], total))
    columns = [Column(title, numeric=False) for title in (_("Input"), _("Kind"), _("Distribution"))]
    return Table(
        _("Contributions to the standard uncertainty of AP"),
        [*columns, Column(_("u (mm)")), Column(_("Share of the variance"))],
        [Group(rows)],
    )


def _volume_table(found: Acceptance) -> Table | None:
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


def _method(found: Acceptance) -> list[tuple[str, str]]:
    plan = _("five poses, thirty cycles: met") if found.is_iso_9283 else _("not met")
    frame = _("fitted to the commanded poses") if found.campaign.fitted else _("the base of the model")
    level = 0.95 if found.budget is None else found.budget.level
    return [
        (_("Robot"), found.model.name),
        (_("Plan of ISO 9283"), plan),
        (_("Measuring frame"), frame),
        (_("Expanded uncertainty"), _("U = k u covers {level}", level=percent(level))),
    ]
