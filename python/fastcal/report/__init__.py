# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Reports: one self-contained HTML page each, to read on a screen and to print."""

from fastcal.report.calibration_report import calibration_page, write_report

__all__ = ["calibration_page", "write_report"]
