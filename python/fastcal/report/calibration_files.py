# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The files of a calibration: model.yaml, result.json and report.html, all or none."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from fastcal.io.folder import atomic_folder
from fastcal.io.results import write_json
from fastcal.io.robot_file import write_spec
from fastcal.report.calibration_report import calibration_page

if TYPE_CHECKING:
    from fastcal.calibration.acceptance_limit import LimitJudged
    from fastcal.calibration.calibrate import CalibrationResult

FILES = ("model.yaml", "result.json", "report.html")


def write_calibration(
    result: CalibrationResult,
    folder: str | os.PathLike[str],
    *,
    simulated: bool = False,
    more: Mapping[str, Any] | None = None,
    limit: LimitJudged | None = None,
    language: str = "en",
    pictures: Mapping[tuple[int, str], Path] | None = None,
) -> None:
    """Writes a result's files into a folder; a model where anything was identified.

    Args:
        result: What `calibrate` gave.
        folder: Made where it is not there; an older result in it is replaced.
        simulated: True where no robot was measured: the page says so.
        more: Further entries of result.json.
        limit: An acceptance limit and what became of it.
        language: Of the report: en or de.
        pictures: Files of cameras' pictures, by row and camera, for the page.
    """
    import fastcal

    judged = {} if limit is None else {"acceptance": limit.to_json_dict()}
    with atomic_folder(folder, owned=FILES) as place:
        if result.parameters:
            source = ", ".join(PurePath(each).name for each in result.train.data.source.split(", "))
            comment = f"Identified by fastcal {fastcal.__version__} from {source}"
            if result.status != "converged":
                comment = f"{result.status.replace('_', ' ').capitalize()}, {source}: {result.message}"
            write_spec(result.model.spec, place / "model.yaml", comment)
        write_json(place / "result.json", result.to_json_dict() | dict(more or {}) | judged)
        page = calibration_page(result, simulated=simulated, limit=limit, language=language, pictures=pictures)
        (place / "report.html").write_text(page, encoding="utf-8")
