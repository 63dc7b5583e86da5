# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of checks of all arms in a folder; nothing is fitted here."""

from __future__ import annotations

import numpy as np

from fastcal.monitoring.arms import NO_FILE, NOTHING_NEW, ArmCheck, ArmChecks
from fastcal.report import figures, page
from fastcal.report import monitoring_figures as drawings
from fastcal.report.check_report import causes_section, check_sentence, next_poses_sections
from fastcal.report.document import document_facts
from fastcal.report.figures import Figure, Key
from fastcal.report.formatting import plural
from fastcal.report.history_report import ON_PAPER
from fastcal.report.kind_words import beside_mm
from fastcal.report.language import _, in_language
from fastcal.report.sections import Section, present, state_word
from fastcal.report.tables import Cell, Column, Group, Table
from fastcal.report.words import Remark, Verdict
from fastcal.said import first_few

MOST_ARMS = 30  # that have sections of their own; the table has all
_MOST_NAMES = 8


def arms_page(found: ArmChecks, language: str = "en") -> str:
    """The HTML text of the page."""
    with in_language(language):
        count = len(found.arms)
        of_all = _("of one arm") if count == 1 else _("of {count} arms", count=count)
        changed, open_ = found.of("changed"), found.of("cannot_tell", "unchecked")
        shown = [*changed, *found.of("cannot_tell")][:MOST_ARMS]
        sections = [Section("all", _("All arms"), drawings=present(_ratios(found)), tables=[_table(found)])]
        sections += [_arm(k, arm) for k, arm in enumerate(shown)]
        return page.render(
            "monitoring.html",
            title=_("Check of one arm") if count == 1 else _("Checks of {count} arms", count=count),
            eyebrow=_("Do the calibrations still hold?"),
            robot_name=plural(count, "arm"),
            simulated=False,
            meta=[],
            verdict=Verdict(
                "bad" if changed else "caution" if open_ else "good",
                _("Attention") if changed or open_ else _("All hold"),
                _headline(found, changed),
                [Remark(f"{arm.name}: {arm_sentence(arm)}", True, "all") for arm in [*changed, *open_][:_MOST_NAMES]],
                _acts(changed, open_),
            ),
            tiles=[
                (_("Hold"), str(len(found.of("holds"))), of_all),
                (_("Changed"), str(len(changed)), _("or out of tolerance")),
                (_("Cannot tell"), str(len(found.of("cannot_tell"))), ""),
                (_("Not checked"), str(len(found.of("unchecked"))), ""),
            ],
            sections=sections,
            document=_document(found),
        )


def _acts(changed: list[ArmCheck], open_: list[ArmCheck]) -> list[str]:
    """What to do now about the arms that do not hold."""
    out = []
    if changed:
        names = first_few([arm.name for arm in changed], _MOST_NAMES)
        out.append(_("Find what moved on {names}; then `fastcal update`, or calibrate again.", names=names))
    if open_:
        names = first_few([arm.name for arm in open_], _MOST_NAMES)
        out.append(_("Measure more poses of {names} and check again.", names=names))
    return out


def _headline(found: ArmChecks, changed: list[ArmCheck]) -> str:
    if changed:
        names = ", ".join(arm.name for arm in changed[:_MOST_NAMES])
        if len(changed) == 1:
            return _("1 of {all} arms has changed: {names}.", all=len(found.arms), names=names)
        return _("{count} of {all} arms have changed: {names}.", count=len(changed), all=len(found.arms), names=names)
    if found.of("cannot_tell", "unchecked"):
        return _("No arm is known to have changed; for some the data cannot tell.")
    return _("Every model still holds.")


def arm_sentence(arm: ArmCheck) -> str:
    """What the check says of an arm, in the language of the page."""
    if arm.found is not None:
        return check_sentence(arm.found)
    known = {
        NO_FILE: _("there is no file of this name"),
        NOTHING_NEW: _("nothing was measured since the model was made"),
    }
    return known.get(arm.message, arm.message)


def _table(found: ArmChecks) -> Table:
    titles = (_("Arm"), _("Type"), _("State"))
    columns = [Column(title, numeric=False) for title in titles]
    columns += [Column(title) for title in (_("RMS (mm)"), _("Expected (mm)"), _("Largest (mm)"))]
    columns += [Column(_("Found"), numeric=False), Column(_("Data"), numeric=False)]
    rows = []
    for arm in found.arms:
        each = arm.found
        kind = None if each is None else each.main.kind
        of = [None] * 3 if each is None else [each.rms, each.expected_rms, each.largest]
        sizes = [None if size is None or kind is None else kind.shown(size) for size in of]
        rows.append(
            [
                Cell(arm.name),
                Cell("" if each is None else each.model.name),
                Cell(state_word(arm.state)),
                *(beside_mm(size, "mm" if kind is None else kind.unit) for size in sizes),
                Cell("" if arm.state == "holds" else arm_sentence(arm)),
                Cell(", ".join(arm.files)),
            ]
        )
    return Table(_("All arms"), columns, [Group(rows)], is_sortable=len(rows) > 1)


def _ratios(found: ArmChecks) -> Figure | None:
    """RMS found over expected of every arm, the smallest first."""
    arms = sorted(((arm.ratio, arm) for arm in found.arms if arm.ratio is not None), key=lambda each: each[0])
    if len(arms) < 2:
        return None
    place = np.arange(1, len(arms) + 1)
    kinds = (
        (Key(_("arm that holds"), figures.AFTER, "point"), ("holds",)),
        (Key(_("arm that has changed"), figures.ALERT, "point"), ("changed",)),
        (Key(_("cannot tell"), figures.INK, "point"), ("cannot_tell",)),
    )
    traces, key = [figures.line([0.5, len(arms) + 0.5], [1.0, 1.0], figures.INK, "dash")], []
    for entry, states in kinds:
        own = [k for k, (_ratio, arm) in enumerate(arms) if arm.state in states]
        if own:
            values = np.array([arms[k][0] for k in own])
            trace = figures.points(place[own], values, entry.colour, 9, hover="%{text}: %{y:.2f}")
            traces.append(trace | {"text": [arms[k][1].name for k in own]})
            key.append(entry)
    key.append(Key(_("expected"), figures.INK, "dash"))
    drawn = figures.layout(_("arms, the smallest first"), _("RMS found / expected"), yaxis={"rangemode": "tozero"})
    alt = _("RMS of every arm relative to the expected RMS, sorted; 1 is the level of the noise.")
    return Figure("ratios", _("Errors of all arms"), alt, traces, drawn, columns=6, height=300, key=key)


def _arm(k: int, arm: ArmCheck) -> Section:
    """An arm that asks for attention."""
    if arm.found is None:
        raise ValueError(f"{arm.name} was not checked")
    drawn = drawings.moved(arm.found, f"moved-{k}")
    causes = causes_section(arm.found)
    tables = [*causes.tables, *(table for section in next_poses_sections(arm.found) for table in section.tables)]
    notes = [*causes.notes, *arm.found.notes]
    return Section(
        f"arm-{k}", arm.name, check_sentence(arm.found), present(drawn), tables, notes=notes, on_paper=k < ON_PAPER
    )


def _document(found: ArmChecks) -> list[tuple[str, str]]:
    """What all checks have in common."""
    origins = [arm.found.made_by for arm in found.arms if arm.found is not None]
    if not origins:
        return []
    common = {k: v for k, v in origins[0].items() if all(each.get(k) == v for each in origins)}
    return document_facts({k: v for k, v in common.items() if k not in ("serial", "data", "data_sha256")})
