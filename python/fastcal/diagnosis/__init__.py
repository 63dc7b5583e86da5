# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Finds the effect that a robot model is missing, grades the evidence, and adds it."""

from fastcal.diagnosis.diagnosis import diagnose
from fastcal.diagnosis.result import Diagnosis

__all__ = ["Diagnosis", "diagnose"]
