# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""fastcal: from a robot file and measured poses to an identified robot, how sure it is, and a report."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fastcal._core import __version__

if TYPE_CHECKING:
    from fastcal.beams import BeamFrame
    from fastcal.branches import branches
    from fastcal.calibration import CalibrationResult, calibrate
    from fastcal.compensation import Compensation, Targets, compensate, compensate_program, path_accuracy
    from fastcal.conversion import convert
    from fastcal.dataset import Dataset
    from fastcal.design import design_poses
    from fastcal.diagnosis import Diagnosis, diagnose
    from fastcal.diagnosis.plan import foresee
    from fastcal.errors import FastcalError, InvalidInput, ParseError
    from fastcal.evaluation import evaluate
    from fastcal.ik import InverseKinematics, inverse_kinematics
    from fastcal.inertia import InertiaLoad, inertia_load
    from fastcal.io.measurements import load_measurements
    from fastcal.io.measurements_out import write_measurements
    from fastcal.io.robot_file import load_robot
    from fastcal.io.targets import load_targets
    from fastcal.null_space import arm_angles, choose_posture
    from fastcal.posture import configurations
    from fastcal.prediction import predict
    from fastcal.redundancy_analysis import Redundancy, redundancy
    from fastcal.registered import register_effect
    from fastcal.regularization import regularized_least_squares
    from fastcal.report import write_report
    from fastcal.robot import Robot
    from fastcal.selection import choose_parameters
    from fastcal.simulation import perturbed, random_poses, simulate

# Public name: the module that defines it, imported at the name's first use, so that `import fastcal` takes no time.
_HOMES = {
    "BeamFrame": "beams",
    "CalibrationResult": "calibration",
    "Compensation": "compensation",
    "Dataset": "dataset",
    "Diagnosis": "diagnosis",
    "FastcalError": "errors",
    "InertiaLoad": "inertia",
    "InverseKinematics": "ik",
    "InvalidInput": "errors",
    "ParseError": "errors",
    "Redundancy": "redundancy_analysis",
    "Robot": "robot",
    "Targets": "compensation",
    "arm_angles": "null_space",
    "branches": "branches",
    "calibrate": "calibration",
    "choose_parameters": "selection",
    "choose_posture": "null_space",
    "compensate": "compensation",
    "compensate_program": "compensation",
    "configurations": "posture",
    "convert": "conversion",
    "design_poses": "design",
    "diagnose": "diagnosis",
    "evaluate": "evaluation",
    "foresee": "diagnosis.plan",
    "inertia_load": "inertia",
    "inverse_kinematics": "ik",
    "load_measurements": "io.measurements",
    "load_robot": "io.robot_file",
    "load_targets": "io.targets",
    "path_accuracy": "compensation",
    "perturbed": "simulation",
    "predict": "prediction",
    "random_poses": "simulation",
    "redundancy": "redundancy_analysis",
    "register_effect": "registered",
    "regularized_least_squares": "regularization",
    "simulate": "simulation",
    "write_measurements": "io.measurements_out",
    "write_report": "report",
}

__all__ = [
    "BeamFrame",
    "CalibrationResult",
    "Compensation",
    "Dataset",
    "Diagnosis",
    "FastcalError",
    "InertiaLoad",
    "InvalidInput",
    "InverseKinematics",
    "ParseError",
    "Redundancy",
    "Robot",
    "Targets",
    "__version__",
    "arm_angles",
    "branches",
    "calibrate",
    "choose_parameters",
    "choose_posture",
    "compensate",
    "compensate_program",
    "configurations",
    "convert",
    "design_poses",
    "diagnose",
    "evaluate",
    "foresee",
    "inertia_load",
    "inverse_kinematics",
    "load_measurements",
    "load_robot",
    "load_targets",
    "path_accuracy",
    "perturbed",
    "predict",
    "random_poses",
    "redundancy",
    "register_effect",
    "regularized_least_squares",
    "simulate",
    "write_measurements",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'fastcal' has no attribute '{name}'")
    value = getattr(importlib.import_module(f"fastcal.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
