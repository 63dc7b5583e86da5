# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a calibration is for: the commands that bring the tool to where it should be."""

from fastcal.compensation.carried import kilograms
from fastcal.compensation.commands import METHODS, Compensation, compensate
from fastcal.compensation.one_step import one_step
from fastcal.compensation.paths import PathAccuracy, path_accuracy
from fastcal.compensation.places import TargetRefused, target_points
from fastcal.compensation.programs import AlreadyCompensated, CompensatedProgram, compensate_program
from fastcal.compensation.shared_shift import shared_in_words, shared_shift
from fastcal.measurements.targets import Targets

__all__ = [
    "METHODS",
    "AlreadyCompensated",
    "CompensatedProgram",
    "Compensation",
    "PathAccuracy",
    "TargetRefused",
    "Targets",
    "compensate",
    "compensate_program",
    "kilograms",
    "one_step",
    "path_accuracy",
    "shared_in_words",
    "shared_shift",
    "target_points",
]
