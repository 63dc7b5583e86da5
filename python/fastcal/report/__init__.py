# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Reports: one self-contained HTML page each, to read on a screen and to print."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from fastcal.calibration.result import CalibrationResult
from fastcal.errors import InvalidInput
from fastcal.report.calibration_report import calibration_page
from fastcal.report.path_report import path_page, write_path_report

if TYPE_CHECKING:
    from fastcal.diagnosis.result import Diagnosis

__all__ = ["calibration_page", "path_page", "write_path_report", "write_report"]


def write_report(
    result: CalibrationResult | Diagnosis, path: str | os.PathLike[str], *, simulated: bool = False
) -> None:
    """Writes the report of a calibration or a diagnosis to `path`, one HTML file that needs nothing else.

    Args:
        result: What `calibrate` or `diagnose` gave.
        path: The file; it appears whole or not at all.
        simulated: True where the measurements came from a simulator: a banner says so on the page and on paper.

    Raises:
        InvalidInput: It is no result, or the file cannot be written.
    """
    from fastcal.diagnosis.result import Diagnosis
    from fastcal.io.atomic import write_text
    from fastcal.report.diagnosis_report import diagnosis_page

    if isinstance(result, CalibrationResult):
        text = calibration_page(result, simulated=simulated)
    elif isinstance(result, Diagnosis):
        text = diagnosis_page(result, simulated=simulated)
    else:
        raise InvalidInput(f"expected a CalibrationResult or a Diagnosis, got {type(result).__name__}")
    write_text(path, text)
