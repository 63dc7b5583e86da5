# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The pages of an update, by poses and by pictures; nothing is fitted here."""

from __future__ import annotations

from fastcal.monitoring.picture_update import PictureUpdate
from fastcal.monitoring.update import UpdateResult
from fastcal.report import monitoring_figures as drawings
from fastcal.report import page
from fastcal.report.check_report import check_sentence
from fastcal.report.document import document_facts
from fastcal.report.formatting import fixed, plural, significant
from fastcal.report.kind_words import noise_text, noise_title
from fastcal.report.language import _, in_language
from fastcal.report.pictures import picture_part
from fastcal.report.sections import Section, present, updated_table, who_measured
from fastcal.report.tables import in_words, unit_text
from fastcal.report.words import Remark, Verdict, camera_remarks

Tiles = list[tuple[str, str, str]]


def update_page(found: UpdateResult, language: str = "en") -> str:
    """The HTML text of an update's page."""
    with in_language(language):
        main = found.errors[0] if found.errors else (found.before.main.kind, found.before.rms, float("nan"))
        kind, (before, after) = main[0], map(main[0].shown, main[1:])
        unit = unit_text(kind.unit)
        is_good = found.status == "converged"
        verdict = Verdict(
            "good" if is_good else "bad",
            _("Up to date") if is_good else _("Not converged"),
            _(
                "The model's RMS error on the new poses is {after} {unit}; it was {before} {unit}.",
                after=fixed(after, 3 if kind.unit == "mm" else 4),
                before=fixed(before, 3 if kind.unit == "mm" else 4),
                unit=unit,
            ),
            [Remark(check_sentence(found.before), found.before.verdict != "holds", "before")],
            _acts(is_good=is_good),
        )
        tiles = [
            (
                _("RMS error"),
                f"{significant(after)} {unit}",
                _("was {before} {unit}", before=significant(before), unit=unit),
            ),
            *((noise_title(of.kind), noise_text(of), _("pooled")) for of in found.noise.values()),
            (_("Degrees of freedom"), str(found.degrees_of_freedom), _("those of the calibration with them")),
        ]
        before_it = Section(
            "before",
            _("The old model on these poses"),
            check_sentence(found.before),
            drawings=present(drawings.errors(found.before), drawings.moved(found.before)),
        )
        return _page(found, plural(len(found.before.data), "pose"), verdict, tiles, before_it)


def picture_update_page(found: PictureUpdate, language: str = "en") -> str:
    """The HTML text of the page of an update by pictures."""
    with in_language(language):
        before, after = (f"{significant(size)} px" for size in found.errors_px)
        is_good = found.status == "converged"
        verdict = Verdict(
            "good" if is_good else "bad",
            _("Up to date") if is_good else _("Not explained"),
            _headline(found),
            camera_remarks(found.cameras),
            _acts(is_good=is_good),
        )
        pictures = Section(
            "pictures",
            _("Pictures"),
            _("Reprojection residuals of the new model, in pixels."),
            drawings=picture_part(found.model, found.train).drawings,
        )
        tiles = [(_("RMS error"), after, _("was {before}", before=before))]
        return _page(found, plural(len(found.before.rms_px), "picture"), verdict, tiles, pictures)


def _acts(*, is_good: bool) -> list[str]:
    """What to do with the new model."""
    if is_good:
        return [_("Compensate with the new model.yaml from now on.")]
    return [_("Calibrate again with as many poses as the first time: these are too few for what has changed.")]


def _page(found: UpdateResult | PictureUpdate, counted: str, verdict: Verdict, tiles: Tiles, shown: Section) -> str:
    """What both have: the arm, its parameters before and now, `shown`, the notes, and who measured."""
    parameters = Section(
        "parameters",
        _("Parameters"),
        _("Prior values are weighted by their certainty; whatever has changed is estimated freely."),
        tables=[updated_table(found.parameters)],
    )
    return page.render(
        "monitoring.html",
        title=_("Update of {robot}", robot=found.model.name),
        eyebrow=_("A calibrated model, brought up to date"),
        robot_name=found.model.name,
        simulated=False,
        meta=[counted, *who_measured(found.model.made_by)],
        verdict=verdict,
        tiles=tiles,
        sections=[
            parameters,
            shown,
            *([Section("notes", _("Notes"), notes=list(found.notes))] if found.notes else []),
        ],
        document=document_facts(found.model.made_by),
    )


def _headline(found: PictureUpdate) -> str:
    if found.status != "converged":
        return _("No move that was tested explains the pictures: calibrate again.")
    if not found.freed:
        return _("Nothing moved; the pictures only reduce the uncertainty a little.")
    return _(
        "{what} moved, and its new place was found from the pictures.",
        what=f" {_('or')} ".join(in_words(of) for of in found.freed),
    )
