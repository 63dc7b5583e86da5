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
from fastcal.report.kind_words import noise_text, noise_title
from fastcal.report.language import _, in_language
from fastcal.report.sections import Section, present, updated_table, who_measured
from fastcal.report.tables import unit_text
from fastcal.report.words import Remark, Verdict


def update_page(found: UpdateResult, language: str = "en") -> str:
    """The HTML text of an update's page."""
    with in_language(language):
        main = found.errors[0] if found.errors else (found.before.main.kind, found.before.rms, float("nan"))
        kind, (before, after) = main[0], map(main[0].shown, main[1:])
        unit = unit_text(kind.unit)
        return page.render(
            "monitoring.html",
            title=_("Update of {robot}", robot=found.model.name),
            eyebrow=_("A calibrated model, brought up to date"),
            robot_name=found.model.name,
            simulated=False,
            meta=[plural(len(found.before.data), "pose"), *who_measured(found.model.made_by)],
            verdict=Verdict(
                "good" if found.status == "converged" else "bad",
                _("Up to date") if found.status == "converged" else _("Not converged"),
                _(
                    "The model's RMS error on the new poses is {after} {unit}; it was {before} {unit}.",
                    after=fixed(after, 3 if kind.unit == "mm" else 4),
                    before=fixed(before, 3 if kind.unit == "mm" else 4),
                    unit=unit,
                ),
                [Remark(check_sentence(found.before), found.before.verdict != "holds", "before")],
            ),
            tiles=[
                (
                    _("RMS error"),
                    f"{significant(after)} {unit}",
                    _("was {before} {unit}", before=significant(before), unit=unit),
                ),
                *((noise_title(of.kind), noise_text(of), _("pooled")) for of in found.noise.values()),
                (_("Degrees of freedom"), str(found.degrees_of_freedom), _("those of the calibration with them")),
            ],
            sections=[
                Section(
                    "parameters",
                    _("Parameters"),
                    _("What was known counts as much as it was certain; what has changed is free."),
                    tables=[updated_table(found.parameters)],
                ),
                Section(
                    "before",
                    _("The old model on these poses"),
                    check_sentence(found.before),
                    drawings=present(drawings.errors(found.before), drawings.moved(found.before)),
                ),
                *([Section("notes", _("Notes"), notes=found.notes)] if found.notes else []),
            ],
            document=document_facts(found.model.made_by),
        )
