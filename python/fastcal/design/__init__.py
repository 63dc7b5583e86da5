# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Which poses to measure."""

from __future__ import annotations

from fastcal.design.instruments import Instruments
from fastcal.design.observability import observability_indices
from fastcal.design.poses import design_poses
from fastcal.design.result import PoseDesign
from fastcal.design.separation import Separation, separating_poses
from fastcal.design.surroundings import Surroundings, Tracker

__all__ = [
    "Instruments",
    "PoseDesign",
    "Separation",
    "Surroundings",
    "Tracker",
    "design_poses",
    "observability_indices",
    "separating_poses",
]
