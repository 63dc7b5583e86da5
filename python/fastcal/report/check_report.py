# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a check; nothing is fitted here."""

from __future__ import annotations

from pathlib import PurePath

import numpy as np

from fastcal.monitoring import words
from fastcal.monitoring.result import FEWEST_DEGREES, CheckResult
from fastcal.report import monitoring_figures as drawings
from fastcal.report import page, workspace
from fastcal.report.arm import checked_arm
from fastcal.report.cell_scene import with_own_rig
from fastcal.report.document import document_facts
from fastcal.report.figures import Figure
from fastcal.report.formatting import fixed, plural, significant, with_uncertainty
from fastcal.report.kind_words import noise_text, noise_title
from fastcal.report.language import _, in_language, retold
from fastcal.report.sections import (
    TONES,
    Section,
    bare,
    before_and_now,
    p_text,
    present,
    state_word,
    translated,
    who_measured,
)
from fastcal.report.tables import Cell, Column, Group, Table, in_words, number_cell, unit_text
from fastcal.report.words import Remark, Verdict


def check_sentence(found: CheckResult) -> str:
    """The verdict in the language of the page."""
    enough = found.degrees_of_freedom >= FEWEST_DEGREES
    given = (found.verdict, found.causes, found.within_tolerance, found.tolerance, found.largest, enough)
    return words.sentence(*given, translated)


def check_act(found: CheckResult) -> str:
    """What to do now, in the language of the page."""
    return words.next_act(found.verdict, found.causes, found.within_tolerance, bool(found.next_poses), translated)


def check_reasons(found: CheckResult) -> list[str]:
    """The evidence in the language of the page."""
    given = (found.fits, found.p_value, found.degrees_of_freedom, found.places, found.causes)
    return words.reasons(*given, translated)


def check_page(found: CheckResult, language: str = "en") -> str:
    """The HTML text of a check's page."""
    with in_language(language):
        sections = [
            Section("errors", _("Errors and changes"), drawings=present(drawings.errors(found), drawings.moved(found))),
            *_workspace(found),
            causes_section(found),
            *next_poses_sections(found),
            _sought(found),
            _check_method(found),
        ]
        return page.render(
            "monitoring.html",
            title=_("Check of {robot}", robot=found.model.name),
            eyebrow=_("Does the calibration still hold?"),
            robot_name=found.model.name,
            simulated=False,
            meta=[
                PurePath(found.data.source.split(", ")[0]).name,
                plural(len(found.data), "pose"),
                *who_measured(found.made_by),
            ],
            verdict=Verdict(
                TONES[found.verdict],
                state_word(found.verdict).capitalize(),
                check_sentence(found),
                [
                    *(Remark(act, True, "next" if found.next_poses else "errors") for act in [check_act(found)] if act),
                    *(
                        Remark(reason[:1].upper() + reason[1:] + ".", found.verdict != "holds", "errors")
                        for reason in check_reasons(found)
                    ),
                ],
            ),
            tiles=_check_tiles(found),
            sections=sections,
            document=document_facts(found.made_by),
        )


def errors_in_space(found: CheckResult) -> Figure | None:
    """The arm and the errors in its workspace; None where no whole point was measured."""
    seen = checked_arm(found)
    if seen is None:
        return None
    positions, errors, arm = seen
    arm = with_own_rig(arm, found.model, found.data.q[[row for _set, row in arm.rows]])
    base = np.asarray(found.model.description.base.xyz_mm, float)
    return workspace.scene(positions, errors, None, base, _("the measuring frame"), arm)


def _workspace(found: CheckResult) -> list[Section]:
    drawn = errors_in_space(found)
    return [] if drawn is None else [Section("workspace", _("Where in the workspace"), drawings=[drawn])]


def _check_tiles(found: CheckResult) -> list[tuple[str, str, str]]:
    kind = found.main.kind

    def size(value: float) -> str:
        return f"{significant(kind.shown(value))} {unit_text(kind.unit)}"

    return [
        (_("RMS error"), size(found.rms), _("after fitting the base")),
        (_("Expected"), size(found.expected_rms), _("noise and the model's uncertainty")),
        (_("Largest error"), size(found.largest), _("of {count} poses", count=len(found.data))),
        (_("p-value"), p_text(found.p_value), _("of an unchanged arm")),
    ]


def causes_section(found: CheckResult) -> Section:
    """What has changed, number by number."""
    columns = [Column(_("What"), numeric=False), Column(_("Number"), numeric=False), Column(_("Model"))]
    columns += [Column(_("Now")), Column(_("Change")), Column("±"), Column(_("Unit"), numeric=False)]
    rows = []
    for cause in found.causes:
        for change in cause.changes:
            name = in_words(bare(change.name, change.unit))
            rows.append(
                [
                    Cell(words.spoken(cause.label, translated)),
                    Cell(name),
                    *before_and_now(change.was, change.value, change.change, change.std),
                    Cell(unit_text(change.unit)),
                ]
            )
    notes = [
        _(
            "Equally likely from these poses: {names}.",
            names=", ".join(words.spoken(label, translated) for label in cause.equivalents),
        )
        for cause in found.causes
        if cause.equivalents
    ]
    if found.blind:
        names = ", ".join(words.spoken(label, translated) for label in found.blind)
        notes.append(_("After the instrument has been set up again, no pose can determine: {names}.", names=names))
    if not rows:
        return Section("causes", _("What has changed"), _("Nothing that these poses can detect."), notes=notes)
    return Section("causes", _("What has changed"), tables=[Table(_("Changes"), columns, [Group(rows)])], notes=notes)


def next_poses_sections(found: CheckResult) -> list[Section]:
    """The poses to measure next, where there are any."""
    if not found.next_poses:
        return []
    units = ["°" if kind == "revolute" else "mm" for kind in found.model.joint_types]
    letter = "q" if found.model.pendant.is_chain else "J"
    columns = [Column(_("Pose")), *(Column(f"{letter}{i + 1} ({unit})") for i, unit in enumerate(units))]
    columns.append(Column(_("payload (kg)")))
    rows = [
        [number_cell(str(k), k), *(number_cell(fixed(v, 2), v) for v in (*found.shown(pose).values(), pose.payload_kg))]
        for k, pose in enumerate(found.next_poses, start=1)
    ]
    return [
        Section(
            "next",
            _("What to measure next"),
            _("These poses decide it."),
            tables=[Table(_("Poses"), columns, [Group(rows)])],
        )
    ]


def _sought(found: CheckResult) -> Section:
    """What an arm may lose in service, and how small a change of it these poses would have shown."""
    shown = [test for test in found.tests if test.kind in ("zero", "tool", "effect")]
    columns = [
        Column(_("What"), numeric=False),
        Column(_("Estimated change")),
        Column("±"),
        Column(_("Detectable from")),
    ]
    columns.append(Column(_("Unit"), numeric=False))
    rows = []
    for test in shown:
        texts = with_uncertainty(test.std, test.value, test.detectable)
        cells = [number_cell(text, v) for text, v in zip(texts, (test.std, test.value, test.detectable), strict=True)]
        name = in_words(f"{test.owner} {bare(test.name, test.unit)}")
        rows.append([Cell(name), cells[1], cells[0], cells[2], Cell(unit_text(test.unit))])
    lead = _(
        "Each parameter on its own. A change of the size in the column Detectable from is found four times in five."
    )
    return Section(
        "sought", _("What would have been detected"), lead, tables=[Table(_("Changes"), columns, [Group(rows)])]
    )


def _check_method(found: CheckResult) -> Section:
    facts = [
        (_("Degrees of freedom"), _("{count}: numbers less six for each set-up", count=found.degrees_of_freedom)),
        *((noise_title(fit.kind), noise_text(fit.noise)) for fit in found.fits),
    ]
    for place in found.places:
        block = place.to_json_dict()
        xyz, rpy = (words.listed_numbers(block[key], 3) for key in ("xyz_mm", "rpy_deg"))
        name = _("Station {name}", name=place.name) if place.name else _("Instrument")
        facts.append(
            (
                name,
                translated("the base has moved by xyz {xyz} mm, rpy {rpy}° in the measuring frame", xyz=xyz, rpy=rpy),
            )
        )
    return Section("method", _("Method and data"), facts=facts, notes=[*map(retold, found.notes)])
