# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of measured paths: accuracy and repeatability along the commanded path, and its corners; path.json."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from fastcal.acceptance.judgement import UNITS
from fastcal.acceptance.path_judgement import PathVerdict
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.report import figures, page
from fastcal.report.acceptance_report import judged_sentence, judgement_rule, missing_sentence, verdict_of
from fastcal.report.acceptance_tables import odds_text, shown
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import plural, significant
from fastcal.report.language import _, in_language
from fastcal.report.tables import Cell, Column, Group, Table, capitalised, number_cell
from fastcal.report.words import Remark, Verdict
from fastcal.units import from_si

if TYPE_CHECKING:
    from fastcal.acceptance.path_figures import PathFigures

FILES = ("path.json", "report.html")
STANDARD_RUNS = 10  # ISO 9283: cycles of a path


def write_measured_path(
    found: PathFigures,
    robot_name: str,
    folder: str | os.PathLike[str],
    judged: PathVerdict | None = None,
    *,
    language: str = "en",
) -> dict[str, Any]:
    """Writes path.json and report.html into a folder, both or none; returns the content of path.json."""
    judged = judged or PathVerdict()
    content = found.to_json_dict() | judged.to_json_dict()
    with atomic_folder(folder, owned=FILES) as place:
        write_json(place / "path.json", content)
        text = measured_path_page(found, robot_name, judged, language)
        (place / "report.html").write_text(text, encoding="utf-8")
    return content


def measured_path_page(
    found: PathFigures, robot_name: str, judged: PathVerdict | None = None, language: str = "en"
) -> str:
    """The HTML text of the page."""
    judged = judged or PathVerdict()
    with in_language(language):
        return page.render(
            "measured_path.html",
            title=_("Measured path of {robot}", robot=robot_name),
            robot_name=robot_name,
            simulated=False,
            runs=plural(found.runs, _("run"), _("runs")),
            length=f"{significant(from_si(found.length, 'mm'), 4)} mm",
            verdict=_verdict(found, judged),
            rule=judgement_rule() if judged.verdict else "",
            tiles=_tiles(found),
            table=_table(found),
            limits=_limits_table(judged) if judged.figures else None,
            drawing=_figure(found),
        )


def _verdict(found: PathFigures, judged: PathVerdict) -> Verdict:
    """Whether the limits are kept, where the path is farthest off, and what the standard asks that is not there."""
    content = found.to_json_dict()
    at, rt, at_place, rt_place = (significant(content[key]) for key in ("AT_mm", "RT_mm", "AT_at_mm", "RT_at_mm"))
    farthest = _("The mean path is up to {at} mm from the commanded one, {place} mm along it.", at=at, place=at_place)
    remarks = [
        Remark(
            _("Runs repeat each other within {rt} mm, worst {place} mm along.", rt=rt, place=rt_place),
            False,
            "accuracy",
        )
    ]
    if found.corners:
        worst = max(found.corners, key=lambda each: each.rounding)
        rounding = significant(from_si(worst.rounding, "mm"))
        text = _("Corner {corner} is rounded most, by {rounding} mm.", corner=worst.corner, rounding=rounding)
        remarks.append(Remark(text, False, "accuracy"))
    if found.runs < STANDARD_RUNS:
        text = _("ISO 9283 asks for {standard} runs; these are {runs}.", standard=STANDARD_RUNS, runs=found.runs)
        remarks.append(Remark(text, True, "accuracy"))
    if judged.verdict is None:
        acts = verdict_of(None, []).acts
        return Verdict("caution", _("Not judged"), farthest, remarks, acts)
    kept = [Remark(judged_sentence(each), each.verdict != "pass", "accuracy") for each in judged.figures]
    kept += [Remark(missing_sentence(name), True, "accuracy") for name in judged.missing]
    told = [*kept, Remark(farthest, False, "accuracy"), *remarks]
    return verdict_of(judged.verdict, told)


def _tiles(found: PathFigures) -> list[tuple[str, str, str]]:
    named = (
        (_("Path accuracy AT"), found.accuracy.max()),
        (_("Path repeatability RT"), found.repeatability.max()),
        (_("Rounding CR, largest"), max((each.rounding for each in found.corners), default=None)),
        (_("Overshoot CO, largest"), max((each.overshoot for each in found.corners), default=None)),
    )
    return [(name, f"{significant(from_si(float(value), 'mm'))} mm", "") for name, value in named if value is not None]


def _limits_table(judged: PathVerdict) -> Table:
    """Of each symbol with a limit the figure that keeps it least surely."""
    verdicts = {"pass": _("pass"), "fail": _("fail"), "cannot_tell": _("cannot tell"), None: ""}
    columns = [Column(_("Figure"), numeric=False), Column(_("Place"), numeric=False), Column(_("Value")), Column("U")]
    columns += [Column(_("Limit")), Column("P"), Column(_("Verdict"), numeric=False)]
    rows = []
    for each in judged.figures:
        unit = UNITS[each.figure.unit].replace("deg", "°")
        value, expanded, limit = shown(each)
        texts = [f"{each.figure.symbol} ({unit})", _(each.figure.where), value, expanded, limit]
        rows.append([Cell(text) for text in (*texts, odds_text(each.probability), verdicts[each.verdict])])
    return Table(_("Limits, each at the place where its margin is smallest"), columns, [Group(rows)])


def _table(found: PathFigures) -> Table:
    content = found.to_json_dict()
    names = [("AT (mm)", "AT_mm"), ("RT (mm)", "RT_mm")]
    if found.turn_accuracy is not None:
        names += [
            (_("{symbol} about {axis} (deg)", symbol=symbol, axis=axis), f"{symbol}_r{axis}_deg")
            for symbol in ("AT", "RT")
            for axis in "xyz"
        ]
    values = [(name, float(content[key])) for name, key in names]
    for each in found.corners:
        for symbol, value in (("CR", each.rounding), ("CO", each.overshoot)):
            name = _("{symbol}, corner {corner} (mm)", symbol=symbol, corner=each.corner)
            values.append((name, float(from_si(value, "mm"))))
    rows = [[number_cell(name, None), number_cell(significant(value, 4), value)] for name, value in values]
    heads = [Column(capitalised(_("figure")), numeric=False), Column(capitalised(_("value")))]
    return Table(_("Figures of ISO 9283."), heads, [Group(rows)])


def _figure(found: PathFigures) -> Figure:
    along = from_si(found.along, "mm")
    key = [Key(_("accuracy |m - c|"), figures.BEFORE, "dash"), Key(_("repeatability l + 3 S"), figures.AFTER, "solid")]
    hover = _("%{{y:.4g}} mm at %{{x:.5g}} mm")
    traces = [
        figures.line(along, from_si(values, "mm"), entry.colour, entry.mark, hover=hover)
        for entry, values in zip(key, (found.accuracy, found.repeatability), strict=True)
    ]
    drawn = figures.layout(_("along the path (mm)"), _("error (mm)"))
    alt = _("Path accuracy and repeatability at each plane along the commanded path.")
    return Figure("measured-path", _("Along the path"), alt, traces, drawn, columns=6, height=380, key=key)
