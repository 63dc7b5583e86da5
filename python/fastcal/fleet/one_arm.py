# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The calibration of one arm of a fleet, as a worker does it: read, fit, write, and a row for the table."""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import fastcal
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.errors import FastcalError
from fastcal.fleet.arms import Arm
from fastcal.fleet.result import NOT_CALIBRATED, ArmResult
from fastcal.io.folder import atomic_folder
from fastcal.io.results import read_json, write_json
from fastcal.io.robot_file import load_robot, write_spec
from fastcal.report.calibration_report import calibration_page
from fastcal.robot.given import RobotLike
from fastcal.robot.robot import Robot

FILES = ("model.yaml", "result.json", "report.html")


def calibrate_arm(
    arm: Arm, options: Mapping[str, Any], *, checks: bool, folder: str | None = None, report: bool = False
) -> ArmResult:
    """Calibrates an arm; with a folder, writes its files there, or takes what they hold where nothing has changed.

    Args:
        arm: The arm.
        options: Further arguments of `calibrate`.
        checks: Look at the columns and for signs in the residuals that the fit is wrong, which takes ten times as long.
        folder: Of this arm; None: nothing is written.
        report: Write its page too.
    """
    key = "" if folder is None else key_of(arm, options)
    if folder is not None and (known := _known(Path(folder), key, checks, report)) is not None:
        return known
    found: CalibrationResult | None = None
    try:
        found = calibrate(_robot(arm.robot), arm.data, test=arm.test, checks=checks, **options)
        row = _row(arm.name, found, "all" if checks else "fit")
    except FastcalError as error:
        row = ArmResult(arm.name, NOT_CALIBRATED, checks="all" if checks else "fit", message=str(error))
    if folder is not None:
        _write(Path(folder), found, row, key, report)
    return row


def key_of(arm: Arm, options: Mapping[str, Any]) -> str:
    """What a result depends on, in one number: the content of its files, the options and the version."""
    content = hashlib.sha256(f"{fastcal.__version__} {sorted(options.items())}".encode())
    for part in (arm.robot, arm.data, arm.test):
        path = Path(part) if isinstance(part, str | os.PathLike) else None
        content.update(path.read_bytes() if path is not None and path.is_file() else pickle.dumps(part))
    return content.hexdigest()


@functools.lru_cache(maxsize=64)
def _loaded(path: str, changed: int) -> Robot:
    return load_robot(path)


def _robot(given: RobotLike) -> RobotLike:
    """A fleet mostly has few kinds of arms: each robot file is read once a worker."""
    if not isinstance(given, str | os.PathLike):
        return given
    path = Path(given)
    return _loaded(os.fspath(given), path.stat().st_mtime_ns if path.exists() else 0)


def _row(name: str, found: CalibrationResult, checks: str) -> ArmResult:
    def rms(figures: Mapping[str, Any] | None) -> float | None:
        return None if figures is None else figures["rms"]

    train = found.train.to_json_dict()
    test = None if found.test is None else found.test.to_json_dict()
    return ArmResult(
        name,
        found.status,
        found.train.row_count,
        rms(train["before_mm"]),
        rms(train["after_mm"]),
        None if test is None else rms(test["after_mm"]),
        found.sigma_mm,
        len(found.outliers),
        len(found.unidentifiable),
        checks,
        found.message if found.status != "converged" else "; ".join(found.notes),
        found.model if found.status == "converged" else None,
    )


def _known(folder: Path, key: str, checks: bool, report: bool) -> ArmResult | None:
    """The row of an earlier run that was given the same, or None."""
    try:
        fleet = read_json(folder / "result.json")["fleet"]
        row = dict(fleet["row"])
        if fleet["key"] != key or (checks and row["checks"] != "all"):
            return None
        converged = row["status"] == "converged"
        if report and converged and not (folder / "report.html").is_file():
            return None
        return ArmResult(**row, model=load_robot(folder / "model.yaml") if converged else None)
    except (FastcalError, KeyError, TypeError):
        return None


def _write(folder: Path, found: CalibrationResult | None, row: ArmResult, key: str, report: bool) -> None:
    with atomic_folder(folder, owned=FILES) as place:
        if row.model is not None:
            write_spec(row.model.spec, place / "model.yaml", f"Identified by fastcal {fastcal.__version__}")
        content = {"status": row.status, "message": row.message} if found is None else found.to_json_dict()
        write_json(place / "result.json", content | {"fleet": {"key": key, "row": row.to_row()}})
        if report and found is not None:
            (place / "report.html").write_text(calibration_page(found), encoding="utf-8")
