# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""fastcal: from a robot file and measured poses to an identified robot, its uncertainty, and a report."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from fastcal.display import late
from fastcal.errors import unloaded

if TYPE_CHECKING:
    from fastcal.beams.frame import BeamFrame
    from fastcal.calibration.bootstrap import Bootstrap, bootstrap
    from fastcal.calibration.calibrate import CalibrationResult, calibrate
    from fastcal.calibration.evaluation import evaluate
    from fastcal.calibration.parameter_identifiability import Redundancy, redundancy
    from fastcal.calibration.prediction import predict
    from fastcal.calibration.regularization import regularized_least_squares
    from fastcal.calibration.simulation import perturbed, random_poses, simulate
    from fastcal.compensation import Compensation, Targets, compensate, compensate_program, path_accuracy
    from fastcal.conversion import convert
    from fastcal.conversion.delta_firmware import delta_numbers, firmware_text
    from fastcal.design import design_poses
    from fastcal.diagnosis import Diagnosis, diagnose
    from fastcal.diagnosis.plan import foresee
    from fastcal.effects.registered import register_effect
    from fastcal.errors import FastcalError, InvalidInput, ParseError
    from fastcal.fleet import Arm, Fleet, calibrate_many, diagnose_many
    from fastcal.ik.all_configurations import branches
    from fastcal.ik.inertia_load import InertiaLoad, inertia_load
    from fastcal.ik.inverse_kinematics import InverseKinematics, inverse_kinematics
    from fastcal.ik.pose_solver import PoseSolver
    from fastcal.ik.posture import configurations
    from fastcal.ik.redundancy_resolution import arm_angles, choose_posture
    from fastcal.importers import load_measurements
    from fastcal.io.long_files import open_measurements
    from fastcal.io.measurements_out import write_measurements
    from fastcal.io.robot_file import load_robot
    from fastcal.io.targets import load_targets
    from fastcal.measurements.dataset import Dataset
    from fastcal.measurements.long_dataset import LongDataset
    from fastcal.monitoring.arms import ArmChecks, check_arms
    from fastcal.monitoring.check import check
    from fastcal.monitoring.compare import Comparison, compare
    from fastcal.monitoring.history import History, history
    from fastcal.monitoring.plan import check_poses
    from fastcal.monitoring.result import CheckResult
    from fastcal.monitoring.update import UpdateResult, update
    from fastcal.report import write_report
    from fastcal.robot.dropped_effects import drop_effects
    from fastcal.robot.robot import Robot
    from fastcal.selection.choose_parameters import choose_parameters

    __version__: str

# Public name: the module that defines it, imported at the name's first use, so that `import fastcal` takes no time.
_HOMES = {
    "__version__": "_core",
    "BeamFrame": "beams.frame",
    "Arm": "fleet",
    "ArmChecks": "monitoring.arms",
    "Bootstrap": "calibration.bootstrap",
    "CalibrationResult": "calibration.calibrate",
    "CheckResult": "monitoring.result",
    "Comparison": "monitoring.compare",
    "Compensation": "compensation",
    "Dataset": "measurements.dataset",
    "Diagnosis": "diagnosis",
    "FastcalError": "errors",
    "History": "monitoring.history",
    "InertiaLoad": "ik.inertia_load",
    "Fleet": "fleet",
    "InverseKinematics": "ik.inverse_kinematics",
    "PoseSolver": "ik.pose_solver",
    "InvalidInput": "errors",
    "LongDataset": "measurements.long_dataset",
    "ParseError": "errors",
    "Redundancy": "calibration.parameter_identifiability",
    "Robot": "robot.robot",
    "Targets": "compensation",
    "UpdateResult": "monitoring.update",
    "arm_angles": "ik.redundancy_resolution",
    "bootstrap": "calibration.bootstrap",
    "branches": "ik.all_configurations",
    "calibrate": "calibration.calibrate",
    "calibrate_many": "fleet",
    "check": "monitoring.check",
    "check_arms": "monitoring.arms",
    "check_poses": "monitoring.plan",
    "choose_parameters": "selection.choose_parameters",
    "choose_posture": "ik.redundancy_resolution",
    "compare": "monitoring.compare",
    "compensate": "compensation",
    "compensate_program": "compensation",
    "configurations": "ik.posture",
    "convert": "conversion",
    "delta_numbers": "conversion.delta_firmware",
    "design_poses": "design",
    "diagnose": "diagnosis",
    "diagnose_many": "fleet",
    "drop_effects": "robot.dropped_effects",
    "evaluate": "calibration.evaluation",
    "firmware_text": "conversion.delta_firmware",
    "foresee": "diagnosis.plan",
    "history": "monitoring.history",
    "inertia_load": "ik.inertia_load",
    "inverse_kinematics": "ik.inverse_kinematics",
    "load_measurements": "importers",
    "load_robot": "io.robot_file",
    "load_targets": "io.targets",
    "open_measurements": "io.long_files",
    "path_accuracy": "compensation",
    "perturbed": "calibration.simulation",
    "predict": "calibration.prediction",
    "random_poses": "calibration.simulation",
    "redundancy": "calibration.parameter_identifiability",
    "register_effect": "effects.registered",
    "regularized_least_squares": "calibration.regularization",
    "simulate": "calibration.simulation",
    "update": "monitoring.update",
    "write_measurements": "io.measurements_out",
    "write_report": "report",
}

# What lower rooms call and may not import (late.py).
late.bind(
    {
        "chart": "fastcal.report.notebook:chart",
        "dataset_of_frame": "fastcal.io.measurements:dataset_of_frame",
        "frame": "fastcal.report.frames:frame",
        "headline": "fastcal.report.summaries:headline",
        "is_long": "fastcal.io.long_files:is_long",
        "load_measurements": "fastcal.importers:load_measurements",
        "load_robot": "fastcal.io.robot_file:load_robot",
        "open_measurements": "fastcal.io.long_files:open_measurements",
        "read_json": "fastcal.io.results:read_json",
        "notebook_html": "fastcal.report.notebook:html",
        "summary": "fastcal.report.summaries:summary",
        "write_arm_checks": "fastcal.report.monitoring_files:write_arm_checks",
        "write_check": "fastcal.report.monitoring_files:write_check",
        "write_calibration": "fastcal.report.calibration_files:write_calibration",
        "write_diagnosis": "fastcal.report.diagnosis_report:write_diagnosis",
        "write_update": "fastcal.report.monitoring_files:write_update",
        "write_comparison": "fastcal.report.monitoring_files:write_comparison",
        "write_history": "fastcal.report.monitoring_files:write_history",
        "write_spec": "fastcal.io.robot_file:write_spec",
    }
)

__all__ = [
    "Arm",
    "ArmChecks",
    "BeamFrame",
    "Bootstrap",
    "CalibrationResult",
    "CheckResult",
    "Comparison",
    "Compensation",
    "Dataset",
    "Diagnosis",
    "FastcalError",
    "Fleet",
    "History",
    "InertiaLoad",
    "InvalidInput",
    "InverseKinematics",
    "LongDataset",
    "ParseError",
    "PoseSolver",
    "Redundancy",
    "Robot",
    "Targets",
    "UpdateResult",
    "__version__",
    "arm_angles",
    "bootstrap",
    "branches",
    "calibrate",
    "calibrate_many",
    "check",
    "check_arms",
    "check_poses",
    "choose_parameters",
    "choose_posture",
    "compare",
    "compensate",
    "compensate_program",
    "configurations",
    "convert",
    "delta_numbers",
    "design_poses",
    "diagnose",
    "diagnose_many",
    "drop_effects",
    "evaluate",
    "firmware_text",
    "foresee",
    "history",
    "inertia_load",
    "inverse_kinematics",
    "load_measurements",
    "load_robot",
    "load_targets",
    "open_measurements",
    "path_accuracy",
    "perturbed",
    "predict",
    "random_poses",
    "redundancy",
    "register_effect",
    "regularized_least_squares",
    "simulate",
    "update",
    "write_measurements",
    "write_report",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'fastcal' has no attribute '{name}'")
    try:
        value = getattr(importlib.import_module(f"fastcal.{_HOMES[name]}"), name)
    except ImportError as error:
        raise unloaded(error) or error from None
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
