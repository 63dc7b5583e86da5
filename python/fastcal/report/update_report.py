# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of an update; nothing is fitted here."""

from __future__ import annotations

from fastcal.monitoring.update import UpdateResult
from fastcal.report import monitoring_figures as drawings
from fastcal.report import page
from fastcal.report.check_report import check_sentence
from fastcal.report.document import document_facts
from fastcal.report.formatting import fixed, plural, significant
from fastcal.report.language import _, in_language
from fastcal.report.sections import Section, bare, before_and_now, present, who_measured
from fastcal.report.tables import Cell, Column, Group, Table, in_words, unit_text
from fastcal.report.words import Remark, Verdict
from fastcal.units import from_si


def update_page(found: UpdateResult, language: str = "en") -> str:
    """The HTML text of an update's page."""
    with in_language(language):
        before, after = found.before.rms_mm, found.train.after.to_mm()["rms"] if found.train.after else float("nan")
        columns = [Column(_("Parameter"), numeric=False), Column(_("Before")), Column(_("Now")), Column(_("Change"))]
        columns += [Column("±"), Column(_("Unit"), numeric=False)]
        groups: dict[str, list[list[Cell]]] = {}
        for p in found.parameters:
            cells = before_and_now(p.nominal, p.value, p.value - p.nominal, p.std)
            name = in_words(bare(p.name, p.unit))
            groups.setdefault(p.owner, []).append([Cell(name), *cells, Cell(unit_text(p.unit))])
        table = Table(_("Parameters"), columns, [Group(rows, in_words(owner)) for owner, rows in groups.items()], True)
        return page.render(
            "monitoring.html",
            title=_("Update of {robot}", robot=found.model.name),
            eyebrow=_("A calibrated model, brought up to date"),
            robot_name=found.model.name,
            simulated=False,
            meta=[plural(len(found.before.data), "pose"), *who_measured(found.model.spec["made_by"])],
            verdict=Verdict(
                "good" if found.status == "converged" else "bad",
                _("Up to date") if found.status == "converged" else _("Not converged"),
                _(
                    "The model's RMS error on the new poses is {after} mm; it was {before} mm.",
                    after=fixed(after, 3),
                    before=fixed(before, 3),
                ),
                [Remark(check_sentence(found.before), found.before.verdict != "holds", "before")],
            ),
            tiles=[
                (_("RMS error"), f"{significant(after)} mm", _("was {before} mm", before=significant(before))),
                (_("Noise of a coordinate"), f"{significant(from_si(found.sigma, 'mm'), 2)} mm", _("pooled")),
                (_("Degrees of freedom"), str(found.degrees_of_freedom), _("those of the calibration with them")),
            ],
            sections=[
                Section(
                    "parameters",
                    _("Parameters"),
                    _("What was known counts as much as it was certain; what has changed is free."),
                    tables=[table],
                ),
                Section(
                    "before",
                    _("The old model on these poses"),
                    check_sentence(found.before),
                    drawings=present(drawings.errors(found.before), drawings.moved(found.before)),
                ),
                *([Section("notes", _("Notes"), notes=found.notes)] if found.notes else []),
            ],
            document=document_facts(found.model.spec["made_by"]),
        )
