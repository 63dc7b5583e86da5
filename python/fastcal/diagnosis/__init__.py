# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Finding, naming and repairing what a robot model is missing."""

from fastcal.diagnosis.diagnosis import diagnose
from fastcal.diagnosis.result import Diagnosis

__all__ = ["Diagnosis", "diagnose"]
