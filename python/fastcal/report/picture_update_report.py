# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of an update by pictures; nothing is fitted here."""

from __future__ import annotations

import os

import fastcal
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.robot_file import write_spec
from fastcal.monitoring.picture_update import PictureUpdate
from fastcal.report import page
from fastcal.report.document import document_facts
from fastcal.report.formatting import plural, significant
from fastcal.report.language import _, in_language
from fastcal.report.monitoring_files import UPDATE_FILES
from fastcal.report.pictures import picture_part
from fastcal.report.sections import Section, updated_table, who_measured
from fastcal.report.tables import in_words
from fastcal.report.words import Verdict, camera_remarks


def write_picture_update(found: PictureUpdate, folder: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes model.yaml, result.json and report.html, all or none."""
    with atomic_folder(folder, owned=UPDATE_FILES) as place:
        comment = f"Updated by fastcal {fastcal.__version__} from pictures"
        if found.status != "converged":
            comment = f"{comment}, which it does not explain"
        write_spec(found.model.spec, place / "model.yaml", comment)
        write_json(place / "result.json", found.to_json_dict())
        (place / "report.html").write_text(picture_update_page(found, language), encoding="utf-8")


def picture_update_page(found: PictureUpdate, language: str = "en") -> str:
    """The HTML text of its page."""
    with in_language(language):
        before, after = (f"{significant(size)} px" for size in found.errors_px)
        is_good = found.status == "converged"
        return page.render(
            "monitoring.html",
            title=_("Update of {robot}", robot=found.model.name),
            eyebrow=_("A calibrated model, brought up to date"),
            robot_name=found.model.name,
            simulated=False,
            meta=[plural(len(found.before.rms_px), "picture"), *who_measured(found.model.made_by)],
            verdict=Verdict(
                "good" if is_good else "bad",
                _("Up to date") if is_good else _("Not explained"),
                _headline(found),
                camera_remarks(found.cameras),
            ),
            tiles=[(_("RMS error"), after, _("was {before}", before=before))],
            sections=[
                Section(
                    "parameters",
                    _("Parameters"),
                    _("What was known counts as much as it was certain; what has changed is free."),
                    tables=[updated_table(found.parameters)],
                ),
                Section(
                    "pictures",
                    _("Pictures"),
                    _("What the new model leaves of the corners, in pixels."),
                    drawings=picture_part(found.model, found.train).drawings,
                ),
                *([Section("notes", _("Notes"), notes=list(found.notes))] if found.notes else []),
            ],
            document=document_facts(found.model.made_by),
        )


def _headline(found: PictureUpdate) -> str:
    if found.status != "converged":
        return _("The pictures are not explained by what may have moved: calibrate again.")
    if not found.freed:
        return _("Nothing moved; the pictures make what is known a little surer.")
    return _(
        "{what} moved, and is where the pictures show it now.",
        what=f" {_('or')} ".join(in_words(of) for of in found.freed),
    )
