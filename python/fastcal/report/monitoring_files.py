# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files of checks, updates, comparisons and histories; the files of one result all or none."""

from __future__ import annotations

import os
from pathlib import Path, PurePath

import fastcal
from fastcal.io.atomic import write_text
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.robot_file import write_spec
from fastcal.io.tables import write_csv
from fastcal.monitoring.arms import ArmChecks
from fastcal.monitoring.compare import Comparison
from fastcal.monitoring.history import History
from fastcal.monitoring.picture_update import PictureUpdate
from fastcal.monitoring.result import CheckResult
from fastcal.monitoring.update import UpdateResult
from fastcal.report.arms_report import arms_page
from fastcal.report.check_report import check_page
from fastcal.report.comparison_report import comparison_page
from fastcal.report.history_report import history_page
from fastcal.report.update_report import picture_update_page, update_page

UPDATE_FILES = ("model.yaml", "result.json", "report.html")
COMPARISON_FILES = ("compare.json", "report.html")
ARMS_FILES = ("checks.csv", "report.html")
HISTORY_FILES = ("history.json", "report.html")

Place = str | os.PathLike[str]


def write_check(found: CheckResult, path: Place, *, language: str = "en") -> None:
    """Writes check.json, or the page where the path ends in .html; whole or not at all."""
    if Path(path).suffix.lower() in (".html", ".htm"):
        write_text(path, check_page(found, language))
    else:
        write_json(path, found.to_json_dict())


def write_arm_checks(found: ArmChecks, folder: Place, *, language: str = "en") -> None:
    """Writes checks.csv, report.html and a check an arm, ARM_DATA.json: those of other data stay beside them."""
    rows = [arm.to_row() for arm in found.arms]
    columns = {name: ["" if row[name] is None else row[name] for row in rows] for name in rows[0]}
    with atomic_folder(folder, owned=ARMS_FILES) as place:
        for arm in found.arms:
            if arm.found is not None:
                write_json(place / f"{arm.name}_{Path(arm.files[-1]).stem}.json", arm.found.to_json_dict())
        write_csv(place / "checks.csv", columns)
        (place / "report.html").write_text(arms_page(found, language), encoding="utf-8")


def write_update(found: UpdateResult | PictureUpdate, folder: Place, *, language: str = "en") -> None:
    """Writes model.yaml, result.json and report.html."""
    if isinstance(found, PictureUpdate):
        source = "pictures" if found.status == "converged" else "pictures, which it does not explain"
        text = picture_update_page(found, language)
    else:
        source = ", ".join(PurePath(each).name for each in found.before.data.source.split(", "))
        text = update_page(found, language)
    with atomic_folder(folder, owned=UPDATE_FILES) as place:
        write_spec(found.model.spec, place / "model.yaml", f"Updated by fastcal {fastcal.__version__} from {source}")
        write_json(place / "result.json", found.to_json_dict())
        (place / "report.html").write_text(text, encoding="utf-8")


def write_comparison(found: Comparison, folder: Place, *, language: str = "en") -> None:
    """Writes compare.json and report.html."""
    with atomic_folder(folder, owned=COMPARISON_FILES) as place:
        write_json(place / "compare.json", found.to_json_dict())
        (place / "report.html").write_text(comparison_page(found, language), encoding="utf-8")


def write_history(found: History, folder: Place, *, language: str = "en") -> None:
    """Writes history.json and report.html; checks and models are only read."""
    with atomic_folder(folder, owned=HISTORY_FILES) as place:
        write_json(place / "history.json", found.to_json_dict())
        (place / "report.html").write_text(history_page(found, language), encoding="utf-8")
