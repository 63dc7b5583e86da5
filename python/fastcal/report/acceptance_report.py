# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of an acceptance test, and its files accept.json and report.html."""

from __future__ import annotations

import os
from pathlib import PurePath
from typing import TYPE_CHECKING

from fastcal.acceptance.judgement import CONFIDENCE, UNITS, Judged, least_sure
from fastcal.acceptance.judgement import Verdict as Judgement
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.report import acceptance_figures, page
from fastcal.report.acceptance_tables import (
    budget_table,
    figures_table,
    odds_text,
    poses_table,
    shown,
    volume_table,
)
from fastcal.report.document import document_facts
from fastcal.report.formatting import percent, plural
from fastcal.report.language import _, in_language
from fastcal.report.words import Remark, Verdict

if TYPE_CHECKING:
    from fastcal.acceptance import Acceptance

FILES = ("accept.json", "report.html")
_SHOWN = {"mm": "mm", "deg": "°"}
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
            figures_table=figures_table(found),
            poses_table=poses_table(found),
            budget_table=budget_table(found),
            volume_table=volume_table(found),
            drawings=acceptance_figures.drawings(found),
            scene=acceptance_figures.arm_in_space(found),
            method=_method(found),
            document=document_facts(found.made_by),
            rule=judgement_rule(),
        )


def _verdict(found: Acceptance) -> Verdict:
    judged = [each for each in found.figures if each.verdict is not None]
    remarks = [Remark(judged_sentence(each), each.verdict != "pass", "figures") for each in least_sure(judged)]
    remarks += [Remark(text, True, "method") for text in _cautions(found)]
    return verdict_of(found.verdict, remarks)


def verdict_of(verdict: Judgement | None, remarks: list[Remark]) -> Verdict:
    """The box that says whether limits are kept."""
    word = {
        "pass": _("Pass"),
        "fail": _("Fail"),
        "cannot_tell": _("Cannot tell"),
        None: _("Not judged"),
    }[verdict]
    headline = {
        "pass": _("The arm meets every limit that was set."),
        "fail": _("The arm exceeds a limit."),
        "cannot_tell": _("The measurement cannot decide whether the arm meets its limits."),
        None: _("No limit was given, so there is no verdict."),
    }[verdict]
    act = {
        "pass": [],
        "fail": [_("Calibrate the arm, compensate its programs, and measure again.")],
        "cannot_tell": [
            _("Measure more cycles, or with a more certain instrument: the uncertainty is too large for this limit.")
        ],
        None: [_("State the limits, with --limit, to have a verdict.")],
    }[verdict]
    return Verdict(_TONES[verdict], word, headline, remarks, act)


def judged_sentence(each: Judged) -> str:
    """A figure beside its limit."""
    value, expanded, limit = shown(each)
    if each.uncertainty.standard == 0:
        return _(
            "{symbol} at {where}: {value} {unit}, limit {limit} {unit}.",
            symbol=each.figure.symbol,
            where=each.figure.where,
            value=value,
            limit=limit,
            unit=_SHOWN[UNITS[each.figure.unit]],
        )
    return _(
        "{symbol} at {where}: {value} ± {expanded} {unit}, limit {limit} {unit}; met with a probability of {odds}.",
        symbol=each.figure.symbol,
        where=each.figure.where,
        value=value,
        expanded=expanded,
        limit=limit,
        unit=_SHOWN[UNITS[each.figure.unit]],
        odds=odds_text(each.probability),
    )


def missing_sentence(name: str) -> str:
    """A limit that no figure shows."""
    return _("A limit is given for {name}, but no measurement determines it.", name=name)


def judgement_rule() -> str:
    """How a figure is held against its limit."""
    return _(
        "U is the expanded uncertainty, k its coverage factor. A limit is met if the true value lies within it with "
        "a probability P of at least {sure}, and exceeded if P is at most {rest}; in between, within the guard band "
        "g, the measurement cannot decide (ISO 14253-1, JCGM 106).",
        sure=percent(CONFIDENCE),
        rest=percent(1 - CONFIDENCE),
    )


def _cautions(found: Acceptance) -> list[str]:
    """The notes of the test in the language of the page."""
    out = [missing_sentence(name) for name in found.missing]
    if found.budget is None:
        out.append(_("No budget was given: the uncertainties include only the scatter of the visits."))
    if not found.is_iso_9283:
        out.append(_("The plan of ISO 9283, five poses with thirty visits each, is not met."))
    if found.campaign.fitted:
        out.append(
            _(
                "The instrument was aligned to the commanded poses: AP excludes every error that a common rigid "
                "motion would explain."
            )
        )
    return out


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
            value, expanded, _limit = shown(worst)
            out.append((name, f"{value} mm", f"± {expanded} mm, {worst.figure.where}"))
    return out


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
