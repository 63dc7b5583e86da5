# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files of a diagnosis: model, JSON and the page."""

from __future__ import annotations

import os
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from fastcal.io.design_out import write_poses
from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.robot_file import write_spec
from fastcal.report import page

if TYPE_CHECKING:
    from fastcal.diagnosis import Diagnosis

FILES = ("model.yaml", "diagnosis.json", "report.html", "next_poses.csv")


def write_diagnosis(found: Diagnosis, folder: str | os.PathLike[str]) -> None:
    """Writes model.yaml, diagnosis.json and report.html, all or none."""
    import fastcal

    with atomic_folder(Path(folder), owned=FILES) as place:
        source = PurePath(found.train.data.source).name
        write_spec(found.model.spec, place / "model.yaml", f"Diagnosed by fastcal {fastcal.__version__} from {source}")
        write_json(place / "diagnosis.json", found.to_json_dict())
        if found.plan is not None:
            write_poses(place / found.plan.file, found.plan.poses, found.model)
        (place / "report.html").write_text(diagnosis_page(found), encoding="utf-8")


def diagnosis_page(found: Diagnosis) -> str:
    """The HTML text of the page."""
    return page.render(
        "diagnosis.html", title=f"Diagnosis of {found.model.name}", robot_name=found.model.name, found=found
    )
