# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The acceptance test of ISO 9283: its program, its figures, and a verdict with guard bands."""

from fastcal.acceptance.acceptance import Acceptance, accept
from fastcal.acceptance.judgement import LIMITS
from fastcal.acceptance.path_figures import PathFigures, PathRun, path_figures
from fastcal.acceptance.path_judgement import PathVerdict, judged_path
from fastcal.acceptance.path_plan import PathPlan, plan_path
from fastcal.acceptance.plan import AcceptancePlan, plan_acceptance

__all__ = [
    "LIMITS",
    "Acceptance",
    "AcceptancePlan",
    "PathFigures",
    "PathPlan",
    "PathRun",
    "PathVerdict",
    "accept",
    "judged_path",
    "path_figures",
    "plan_acceptance",
    "plan_path",
]
