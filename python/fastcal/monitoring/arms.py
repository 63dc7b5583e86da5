# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Checks of all arms in a folder: a folder an arm, with its model and what was measured since.

An arm's model is the newest calibrated one in its folder, by its date or else that of the file. Checked are the files
that a pattern names, all of an arm together as set-ups of their own; without a pattern the newest file with measured
poses that the model was not made from.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fastcal.calibration.parallel import one_blas_thread
from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.errors import FastcalError, InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.check import check
from fastcal.monitoring.events import Event, model_event
from fastcal.monitoring.result import CheckResult
from fastcal.robot.robot import Robot

MODELS = (".yaml", ".yml")
NO_FILE, NOTHING_NEW = "there is no file of this name", "nothing was measured since the model was made"
MEASUREMENTS = (".csv", ".tsv", ".txt", ".xlsx", ".parquet")


@dataclass(frozen=True, eq=False)
class ArmCheck:
    """One arm.

    Attributes:
        name: Of its folder.
        files: What was measured, relative to that folder.
        found: None where it could not be checked; `message` says why.
    """

    name: str
    files: tuple[str, ...]
    found: CheckResult | None
    message: str = ""

    @property
    def state(self) -> str:
        """The verdict, "changed" too where an error is out of tolerance; "unchecked" where there is none."""
        if self.found is None:
            return "unchecked"
        return "changed" if self.found.within_tolerance is False else self.found.verdict

    @property
    def sentence(self) -> str:
        """What was found, or why nothing was."""
        return self.message if self.found is None else self.found.sentence

    @property
    def ratio(self) -> float | None:
        """RMS found over expected."""
        found = self.found
        return None if found is None or not found.expected_rms > 0 else found.rms / found.expected_rms

    def to_row(self) -> dict[str, Any]:
        """Its row of checks.csv, None where nothing is known."""
        found = self.found
        return {
            "arm": self.name,
            "robot": None if found is None else found.model.name,
            "serial": None if found is None else found.made_by.get("serial"),
            "state": self.state,
            "rms_mm": None if found is None else found.rms_mm,
            "expected_rms_mm": None if found is None else found.expected_rms_mm,
            "max_mm": None if found is None else found.largest_mm,
            "p_value": None if found is None else found.p_value,
            "data": " ".join(self.files),
            "sentence": self.sentence,
        }


@dataclass(frozen=True, eq=False, repr=False)
class ArmChecks(Shown):
    """What `check_arms` found: one check an arm, those that ask for attention first."""

    folder: str
    arms: list[ArmCheck]

    def of(self, *states: str) -> list[ArmCheck]:
        """The arms in one of these states: changed, cannot_tell, unchecked, holds."""
        return [arm for arm in self.arms if arm.state in states]

    def to_json_dict(self) -> dict[str, Any]:
        """The rows of checks.csv."""
        return {"arms": [arm.to_row() for arm in self.arms]}

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes checks.csv, report.html and a check an arm, ARM_DATA.json, into a folder, all or none."""
        late.call("write_arm_checks", self, folder)


STATES = ("changed", "cannot_tell", "unchecked", "holds")  # in the order in which they ask for attention


@one_blas_thread()
def check_arms(
    folder: str | os.PathLike[str],
    *,
    files: str | None = None,
    tolerance: float | None = None,
    as_read: bool = False,
    who: Mapping[str, str | None] | None = None,
    threads: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> ArmChecks:
    """Checks every arm that has a folder of its own in `folder`; what one arm lacks does not stop the others.

    Args:
        folder: With a folder an arm, in which its model.yaml and its measurements lie, in folders of their own or not.
        files: Names of the files to check, such as 2026-11*.csv; default: an arm's newest.
        tolerance: Largest distance [m] of a point from the model that is accepted.
        as_read: Take the columns as they are, though another reading fits far better.
        who: What the checks shall keep: instrument, operator, customer, date. An arm's serial number is its model's,
            else the name of its folder.
        threads: Cores; the result does not depend on it.
        progress: Called with what is being done.

    Raises:
        InvalidInput: There is no such folder, no calibrated model in any folder in it, or a serial number was given.
    """
    root = Path(folder)
    if not root.is_dir():
        raise InvalidInput(f"{folder}: expected a folder with a folder an arm")
    if who is not None and who.get("serial"):
        raise InvalidInput("a serial number is one arm's; many arms have those of their models or of their folders")
    arms = []
    for place in sorted(each for each in root.iterdir() if each.is_dir() and not each.name.startswith(".")):
        models, message = _models(place)
        if not models and not message:
            continue
        progress(f"checking {place.name}")
        options = {"tolerance": tolerance, "as_read": as_read, "who": who, "threads": threads}
        arms.append(ArmCheck(place.name, (), None, message) if message else _checked(place, models[-1], files, options))
    if not arms:
        expected = "expected one folder per arm, each with a calibrated model; found none"
        raise InvalidInput(f"{folder}: {expected} (for one arm name its model.yaml)")
    return ArmChecks(str(folder), sorted(arms, key=lambda arm: (STATES.index(arm.state), -(arm.ratio or 0), arm.name)))


def _models(place: Path) -> tuple[list[Event], str]:
    """The calibrated models of an arm, the newest last; or what is wrong with one of them."""
    try:
        found = [model_event(path, place) for path in _files(place, MODELS)]
    except FastcalError as error:
        return [], str(error)
    age = {event.file: (place / event.file).stat().st_mtime_ns for event in found if event is not None}
    return sorted((e for e in found if e is not None), key=lambda e: (e.date, age[e.file], e.file)), ""


def _checked(place: Path, model: Event, pattern: str | None, options: dict[str, Any]) -> ArmCheck:
    """The check of one arm."""
    names: tuple[str, ...] = ()
    try:
        robot: Robot = late.call("load_robot", place / model.file)
        paths, data = _measured(place, robot, pattern)
        names = tuple(str(path.relative_to(place)) for path in paths)
        serial = robot.made_by.get("serial") or place.name
        who = {**(options["who"] or {}), "serial": serial}
        return ArmCheck(place.name, names, check(robot, data, **(options | {"who": who})))
    except FastcalError as error:
        return ArmCheck(place.name, names, None, str(error))


def _measured(place: Path, robot: Robot, pattern: str | None) -> tuple[list[Path], Dataset]:
    """The files to check and their rows."""
    if pattern is not None:
        paths = [path for path in _files(place, MEASUREMENTS) if path.match(pattern)]
        if not paths:
            raise InvalidInput(NO_FILE)
        return paths, late.call("load_measurements", paths, robot)
    origin = robot.made_by
    newest = sorted(_files(place, MEASUREMENTS), key=lambda path: (path.stat().st_mtime_ns, path.name), reverse=True)
    for path in newest:
        if path.name in origin.get("data", []):
            continue
        data: Dataset = late.call("load_measurements", path, robot, require_measured=False)
        if data.measured.any():
            return [path], data
    raise InvalidInput(NOTHING_NEW)


def _files(place: Path, kinds: tuple[str, ...]) -> list[Path]:
    """Files of some kinds in a folder and below it, but for hidden ones."""
    found = sorted(path for path in place.rglob("*") if path.suffix.lower() in kinds and path.is_file())
    return [path for path in found if not any(part.startswith(".") for part in path.relative_to(place).parts)]
