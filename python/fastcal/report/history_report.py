# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a history: one arm, or a fleet."""

from __future__ import annotations

from fastcal.monitoring.events import misfit_of
from fastcal.monitoring.history import Alarm, ArmHistory, History
from fastcal.monitoring.words import kept_sentence
from fastcal.report import monitoring_figures as drawings
from fastcal.report import page
from fastcal.report.figures import Figure
from fastcal.report.formatting import plural, significant
from fastcal.report.kind_words import beside_mm
from fastcal.report.language import _, in_language, retold
from fastcal.report.sections import Section, present, state_word, translated
from fastcal.report.tables import Cell, Column, Group, Table, in_words, unit_text
from fastcal.report.words import Remark, Verdict
from fastcal.said import first_few

MOST_ARMS = 24  # whose charts a page has; the table has all
_MOST_NAMED = 8  # arms in a sentence
_FEW = 12  # arms: a table of these is open
OPEN = 4  # arms that ask for attention and are shown without a click
ON_PAPER = 3  # of them


def history_page(found: History, language: str = "en") -> str:
    """The HTML text of a history's page: one arm, or a fleet."""
    with in_language(language):
        arms = sorted(found.arms, key=lambda a: (_ORDER.index(a.state), a.name))
        bad = [a for a in arms if a.state in ("changed", "alarm")]
        checks = sum(e.kind == "check" for a in arms for e in a.events)
        tone = "bad" if any(a.state == "changed" for a in arms) else "caution" if bad else "good"
        headline = _headline(arms, bad)
        one = len(arms) == 1
        sections = [Section("all", _("Errors over time") if one else _("All arms"), drawings=_over_time(arms))]
        for k, arm in enumerate(arms[:MOST_ARMS]):
            asks = arm in bad or one
            sections.append(_arm(k, arm, on_paper=asks and k < ON_PAPER, folded=not asks or k >= OPEN))
        table = Section("table", _("Table of all arms"), tables=[_fleet_table(arms)], folded=len(arms) > _FEW)
        if not one:
            sections.insert(1, table)
        if found.notes:
            sections.append(Section("notes", _("Notes"), notes=[*map(retold, found.notes)]))
        title = arms[0].name if one else _("{count} arms", count=len(arms))
        return page.render(
            "monitoring.html",
            title=_("History: {name}", name=title),
            eyebrow=_("Checks and models over time"),
            robot_name=title,
            simulated=False,
            meta=[plural(checks, "check")],
            verdict=Verdict(
                tone,
                _("Attention") if bad else _("All hold"),
                headline,
                [Remark(f"{a.arm}, {a.date}: {_alarm(a)}", True, "all") for a in found.alarms[-12:]],
                _acts(bad),
            ),
            tiles=[
                (_("Arms"), str(len(arms)), ""),
                (_("Checks"), str(checks), ""),
                (_("Alarms"), str(len(found.alarms)), _("checks, EWMA and CUSUM")),
            ],
            sections=sections,
            document=[],
        )


def _over_time(arms: list[ArmHistory]) -> list[Figure]:
    """The matrix of arms and months, and for few arms a line each."""
    return present(drawings.months(arms), drawings.ratio_chart(arms) if len(arms) <= drawings.ALL_NAMED else None)


_ORDER = ["changed", "alarm", "cannot_tell", "unchecked", "holds"]


def _headline(arms: list[ArmHistory], bad: list[ArmHistory]) -> str:
    """How many arms need attention, and which."""
    if not bad:
        return _("No arm needs attention.")
    if len(arms) == 1:
        return _("This arm needs attention.")
    names = ", ".join(a.name for a in bad[:_MOST_NAMED])
    if len(bad) == 1:
        return _("1 of {all} arms needs attention: {names}.", all=len(arms), names=names)
    return _("{count} of {all} arms need attention: {names}.", count=len(bad), all=len(arms), names=names)


def _acts(bad: list[ArmHistory]) -> list[str]:
    """What to do now about the arms that need attention."""
    out = []
    if changed := [a.name for a in bad if a.state == "changed"]:
        names = first_few(changed, _MOST_NAMED)
        out.append(_("Find what moved on {names}; then `fastcal update`, or calibrate again.", names=names))
    if drifting := [a.name for a in bad if a.state != "changed"]:
        names = first_few(drifting, _MOST_NAMED)
        act = _("Check {names} again soon, with more poses: the errors drift, though no check failed.", names=names)
        out.append(act)
    return out


def _arm(k: int, arm: ArmHistory, *, on_paper: bool, folded: bool) -> Section:
    """The charts and the files of an arm."""
    return Section(
        f"arm-{k}",
        arm.name,
        f"{arm.robot}: {state_word(arm.state)}",
        drawings=drawings.control_charts(arm, f"arm-{k}"),
        tables=[_event_table(arm)],
        on_paper=on_paper,
        folded=folded,
    )


def _alarm(alarm: Alarm) -> str:
    if alarm.event is not None:
        return kept_sentence(alarm.event.content, translated)
    if alarm.by == "ewma":
        return _("the misfit's EWMA is beyond its limit")
    return _("the CUSUM of {name} is beyond its limit", name=in_words(alarm.what))


def _fleet_table(arms: list[ArmHistory]) -> Table:
    columns = [Column(_("Arm"), numeric=False), Column(_("Type"), numeric=False), Column(_("State"), numeric=False)]
    columns += [Column(_("Checks")), Column(_("Last check"), numeric=False), Column(_("RMS (mm)")), Column(_("Alarms"))]
    rows = []
    for arm in arms:
        last = next((e for e in reversed(arm.events) if e.kind == "check"), None)
        rms, _expected, unit = (None, None, "mm") if last is None else misfit_of(last.content) or (None, None, "mm")
        count = sum(e.kind == "check" for e in arm.events)
        rows.append(
            [
                Cell(arm.name),
                Cell(arm.robot),
                Cell(state_word(arm.state)),
                Cell(str(count), count),
                Cell("" if last is None else _one_line(last.date)),
                beside_mm(rms, unit),
                Cell(str(len(arm.alarms)), len(arm.alarms)),
            ]
        )
    return Table(_("All arms"), columns, [Group(rows)], is_sortable=len(rows) > 1)


def _event_table(arm: ArmHistory) -> Table:
    columns = [Column(_("Date"), numeric=False), Column(_("What"), numeric=False), Column(_("RMS (mm)"))]
    columns += [Column(_("Expected (mm)")), Column(_("Found"), numeric=False)]
    columns.append(Column(_("File"), numeric=False, whole=True))
    rows = []
    for e in arm.events:
        if e.kind == "model":
            each = e.content["noise"].values()
            noise = ", ".join(f"{significant(of['value'], 2)} {unit_text(of['unit'])}" for of in each)
            rows.append(
                [
                    Cell(_one_line(e.date)),
                    Cell(_("model")),
                    Cell(""),
                    Cell(""),
                    Cell(_("noise {size}", size=noise)),
                    Cell(e.file),
                ]
            )
            continue
        rms, expected, unit = misfit_of(e.content) or (None, None, "mm")
        rows.append(
            [
                Cell(_one_line(e.date)),
                Cell(_("check")),
                beside_mm(rms, unit),
                beside_mm(expected, unit),
                Cell(state_word("holds") if e.verdict == "holds" else kept_sentence(e.content, translated)),
                Cell(e.file),
            ]
        )
    return Table(_("History of {name}", name=arm.name), columns, [Group(rows)])


def _one_line(date: str) -> str:
    return date.replace("-", "\N{NON-BREAKING HYPHEN}")
