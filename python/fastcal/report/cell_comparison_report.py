# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The page of a comparison of two models of a cell; nothing is fitted here."""

from __future__ import annotations

import os
from pathlib import Path

from fastcal.cells.compare import CellComparison
from fastcal.io.atomic import write_text
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.report.cell_report import cell_page
from fastcal.report.comparison_report import difference_table, which_holds
from fastcal.report.formatting import significant
from fastcal.report.language import _, in_language, retold
from fastcal.report.monitoring_files import COMPARISON_FILES as FILES
from fastcal.report.monitoring_files import write_comparison
from fastcal.report.sections import Section
from fastcal.report.words import Remark, Verdict


def write_cell_comparison(found: CellComparison, folder: str | os.PathLike[str], *, language: str = "en") -> None:
    """Writes compare.json and report.html, both or none, and a folder with each way's own."""
    for each in found.ways:
        write_comparison(each.found, Path(folder) / each.way.name, language=language)
    with atomic_folder(folder, FILES) as place:
        write_json(place / "compare.json", found.to_json_dict())
        write_text(place / "report.html", comparison_page(found, language))


def comparison_page(found: CellComparison, language: str = "en") -> str:
    """The HTML text of the page."""
    with in_language(language):
        different = bool(found.significant)
        sections = [
            Section(
                each.way.name,
                each.way.name,
                _("Arms: {arms}; bases and tools aligned.", arms=", ".join(arm.name for arm in each.way.arms)),
                tables=[difference_table(each.parameters)],
            )
            for each in found.ways
        ]
        if found.seen is not None:
            sections.append(
                Section(
                    "seen",
                    _("Seen by sensors and cameras"),
                    _(
                        "The second model in the parameters of the first; of cameras and boards, how they moved in "
                        "their own frame."
                    ),
                    tables=[difference_table(found.seen.parameters)],
                )
            )
        tiles = []
        for each in found.ways:
            sizes = each.found.at_tool.to_mm()
            tiles.append((each.way.name, f"{significant(sizes['rms'])} mm", _("RMS at the target")))
        for view, of in found.seen.views.items() if found.seen is not None else ():
            tiles.append((view, f"{significant(of.to_mm()['rms'])} mm", _("RMS at the target")))
        return cell_page(
            found.first,
            (_("Two models of one cell"), _("Two models of {robot}", robot=found.first.name)),
            Verdict(
                "caution" if different else "good",
                _("Different") if different else _("Alike"),
                _headline(found),
                [Remark(retold(note), True, "") for note in found.notes],
                [which_holds()] if different else [],
            ),
            tiles,
            sections,
        )


def _headline(found: CellComparison) -> str:
    told = [
        _(
            "{target}: {count} of {all} numbers differ beyond noise.",
            target=each.way.name,
            count=len(each.significant),
            all=len(each.parameters),
        )
        for each in found.ways
    ]
    if found.seen is not None:
        told.append(
            _(
                "Seen by sensors and cameras: {count} of {all} numbers differ beyond noise.",
                count=len(found.seen.significant),
                all=len(found.seen.parameters),
            )
        )
    return " ".join(told)


__all__ = ["FILES", "comparison_page", "write_cell_comparison"]
