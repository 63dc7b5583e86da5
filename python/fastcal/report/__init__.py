# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Reports: one self-contained HTML page each, to read on a screen and to print."""

from fastcal.report.calibration_report import calibration_page, write_report
from fastcal.report.path_report import path_page, write_path_report

__all__ = ["calibration_page", "path_page", "write_path_report", "write_report"]
