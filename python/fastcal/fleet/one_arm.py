# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""One arm of a fleet, as a worker does it: read, calibrate or diagnose, write, and a row for the table."""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fastcal
from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.evaluation import ErrorStatistics, Evaluation
from fastcal.errors import FastcalError, InvalidInput
from fastcal.fleet.arms import Arm
from fastcal.fleet.result import NOT_CALIBRATED, ArmResult
from fastcal.io import inputs
from fastcal.io.folder import atomic_folder
from fastcal.io.results import read_json, write_json
from fastcal.io.robot_file import load_robot, write_spec
from fastcal.measurements.kinds import POINTS, KindNoise
from fastcal.report.calibration_report import calibration_page
from fastcal.robot.given import RobotLike
from fastcal.robot.robot import Robot
from fastcal.said import joined, sentence_of

if TYPE_CHECKING:
    from fastcal.diagnosis import Diagnosis

FILES = ("model.yaml", "result.json", "report.html")


def calibrate_arm(
    arm: Arm,
    options: Mapping[str, Any],
    *,
    checks: bool,
    folder: str | None = None,
    report: bool = False,
    language: str = "en",
) -> ArmResult:
    """Calibrates an arm; with a folder, writes its files there, or takes what they hold where nothing has changed.

    Args:
        arm: The arm.
        options: Further arguments of `calibrate`.
        checks: Look at the columns and for signs in the residuals that the fit is wrong, which takes ten times as long.
        folder: Of this arm; None: nothing is written.
        report: Write its page too.
        language: Of the page.
    """
    key = "" if folder is None else key_of(arm, {**options, **(_page_in(language) if report else {})})
    if folder is not None and (known := _known(Path(folder) / "result.json", key)) is not None:
        has_page = known.model is None or (Path(folder) / "report.html").is_file()
        if (known.checks == "all" or not checks) and (has_page or not report):
            return known
    found: CalibrationResult | None = None
    try:
        found = calibrate(_robot(arm.robot), arm.data, test=arm.test, checks=checks, **options)
        row = _row(arm.name, found, "all" if checks else "fit")
    except FastcalError as error:
        row = ArmResult(arm.name, NOT_CALIBRATED, checks="all" if checks else "fit", message=sentence_of(error))
    if folder is not None:
        _write(Path(folder), found, row, key, language if report else None)
    return row


def _page_in(language: str) -> dict[str, str]:
    """What a page in another language adds to what a result depends on."""
    return {} if language == "en" else {"language": language}


def diagnose_arm(arm: Arm, options: Mapping[str, Any], *, folder: str | None = None, language: str = "en") -> ArmResult:
    """Diagnoses an arm; with a folder, writes its files there, or takes what they hold where nothing has changed.

    Args:
        arm: The arm.
        options: Further arguments of `diagnose`.
        folder: Of this arm; None: nothing is written.
        language: Of its page.
    """
    from fastcal.diagnosis import diagnose  # takes longer to import than an arm to calibrate
    from fastcal.report.diagnosis_report import FILES as OF_DIAGNOSIS
    from fastcal.report.diagnosis_report import write_diagnosis

    key = "" if folder is None else key_of(arm, {"diagnose": True, **options, **_page_in(language)})
    if folder is not None and (known := _known(Path(folder) / "diagnosis.json", key)) is not None:
        return known
    try:
        found = diagnose(_robot(arm.robot), arm.data, test=arm.test, **options)
        if found.few:
            raise InvalidInput(found.few)
    except FastcalError as error:
        row = ArmResult(arm.name, NOT_CALIBRATED, checks="all", message=sentence_of(error))
        if folder is not None:
            with atomic_folder(folder, owned=OF_DIAGNOSIS) as place:
                write_json(place / "diagnosis.json", _record(key, row))
        return row
    row = _diagnosed_row(arm.name, found)
    if folder is not None:
        write_diagnosis(found, folder, also=_record(key, row), language=language)
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
    return ArmResult(
        name,
        found.status,
        **_errors(found.train, found.test, found.noise),
        outliers=len(found.outliers),
        unidentifiable=len(found.unidentifiable),
        checks=checks,
        message=found.message if found.status != "converged" else joined("; ", found.notes),
        model=found.model if found.status == "converged" else None,
    )


def _diagnosed_row(name: str, found: Diagnosis) -> ArmResult:
    last = found.steps[-1]
    return ArmResult(
        name,
        "converged",
        **_errors(last.train, last.test, found.noise),
        outliers=len(found.outliers),
        checks="all",
        message=found.sentence,
        verdict=found.verdict,
        causes="; ".join(f"{effect.grade} {effect.label}" for effect in found.effects),
        model=last.model,
    )


def _errors(train: Evaluation, test: Evaluation | None, noise: Mapping[str, KindNoise]) -> dict[str, Any]:
    """How many rows, and the fields of errors."""
    main = train.main
    if main is None:
        return {"rows": train.row_count}
    kind = main.kind
    tested = None if test is None else test.kinds.get(kind.name)

    def rms(figures: ErrorStatistics | None) -> float | None:
        return None if figures is None else figures.to_unit(kind.unit)["rms"]

    before, after = map(rms, main.statistics)
    own = noise.get(kind.name)
    sizes = {
        "before": before,
        "after": after,
        "test": None if tested is None else rms(tested.statistics[1]),
        "noise": None if own is None else kind.shown(own.value),
    }
    of_points = ("before_mm", "after_mm", "test_mm", "sigma_mm") if kind.name == POINTS else ()
    in_mm = dict(zip(of_points, sizes.values(), strict=False))
    return {"rows": train.row_count, "kind": kind.name, "unit": kind.unit, **sizes, **in_mm}


def _record(key: str, row: ArmResult) -> dict[str, Any]:
    """What a later run looks for: it takes the row where the key is that of its own arm."""
    return {"fleet": {"key": key, "row": row.to_row()}}


def _known(path: Path, key: str) -> ArmResult | None:
    """The row of an earlier run that was given the same, or None."""
    try:
        with inputs.replaceable():
            fleet = read_json(path)["fleet"]
            if fleet["key"] != key:
                return None
            row = dict(fleet["row"])
            is_there = row["status"] == "converged"
            return ArmResult(**row, model=load_robot(path.with_name("model.yaml")) if is_there else None)
    except (FastcalError, KeyError, TypeError):
        return None


def _write(folder: Path, found: CalibrationResult | None, row: ArmResult, key: str, language: str | None) -> None:
    """The files of an arm, with its page in a language; None: without."""
    with atomic_folder(folder, owned=FILES) as place:
        if row.model is not None:
            write_spec(row.model.spec, place / "model.yaml", f"Identified by fastcal {fastcal.__version__}")
        content = {"status": row.status, "message": row.message} if found is None else found.to_json_dict()
        write_json(place / "result.json", content | _record(key, row))
        if language is not None and found is not None:
            (place / "report.html").write_text(calibration_page(found, language=language), encoding="utf-8")
