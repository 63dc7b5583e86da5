# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Does a calibrated cell of several arms still hold? Each way from the world to a target is checked as one arm.

Where there are no such ways, the cell is checked as a whole: `whole_check`.

The base of each way is refitted, as the instrument stands elsewhere. A joint that several ways share has changed where
the readings of one of them say so; those of the others are named beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from fastcal.calibration.unknowns import CORNERS
from fastcal.cells.branches import possible_ways
from fastcal.cells.cell import Cell
from fastcal.cells.paths import Way
from fastcal.cells.readings import Readings
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.check import check
from fastcal.monitoring.result import Cause, CheckResult
from fastcal.units import from_si

_WORST_FIRST = ("changed", "cannot_tell", "holds")


@dataclass(frozen=True, eq=False)
class WayCheck:
    """One way, and what was found of it."""

    way: Way
    found: CheckResult

    @property
    def state(self) -> str:
        """The verdict, "changed" too where an error is out of tolerance."""
        return "changed" if self.found.within_tolerance is False else self.found.verdict

    @property
    def sentence(self) -> str:
        """What was found, with the cell's names."""
        return self.way.words(self.found.sentence)

    def label(self, cause: Cause) -> str:
        """A cause as the cell calls it: "left.joint3 zero"; the tool of a way is its target."""
        return self.way.name if cause.label == "tool" else self.way.words(cause.label)

    def changes(self) -> list[dict[str, Any]]:
        """Numbers that are no longer what the model says."""
        causes = self.found.causes if self.found.verdict == "changed" else []
        return [{**vars(of), "owner": self.way.owner(of.owner)} for cause in causes for of in cause.changes]

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `ways`."""
        found = self.found
        return {
            "arms": [arm.name for arm in self.way.arms],
            "verdict": found.verdict,
            "sentence": self.sentence,
            "reasons": [self.way.words(reason) for reason in found.reasons],
            "rms_mm": found.rms_mm,
            "expected_rms_mm": found.expected_rms_mm,
            "max_mm": found.largest_mm,
            "p_value": found.p_value,
            "within_tolerance": found.within_tolerance,
            "aligned": found.places[0].to_json_dict() if found.places else None,
            "changed": self.changes(),
            "causes": [
                {"kind": of.kind, "label": self.label(of), "equivalents": [self.way.words(e) for e in of.equivalents]}
                for of in found.causes
            ],
            "blind": [self.way.words(label) for label in found.blind],
            "count": len(found.data),
        }


@dataclass(frozen=True, eq=False)
class CellCheck:
    """What `check_cell` found, way by way."""

    cell: Cell
    ways: list[WayCheck]
    tolerance: float | None = None

    @property
    def verdict(self) -> str:
        """Changed where one way has changed, else cannot_tell where one is, else holds."""
        return min((each.found.verdict for each in self.ways), key=_WORST_FIRST.index)

    @property
    def within_tolerance(self) -> bool | None:
        """Are all ways? None without a tolerance, or where one does not decide it."""
        each = [way.found.within_tolerance for way in self.ways]
        return False if False in each else None if None in each else True

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        told = [each for each in self.ways if each.state != "holds"]
        if not told:
            return "The cell's model still holds: the readings of each target agree with it to within the noise."
        return " ".join(f"{each.way.name}: {each.sentence}" for each in told)

    @property
    def changed(self) -> list[dict[str, Any]]:
        """All numbers that have changed, each with the target whose readings say so."""
        return [{**of, "way": each.way.name} for each in self.ways for of in each.changes()]

    def to_json_dict(self) -> dict[str, Any]:
        """The content of check.json."""
        return {
            "verdict": self.verdict,
            "sentence": self.sentence,
            "tolerance_mm": None if self.tolerance is None else from_si(self.tolerance, "mm"),
            "within_tolerance": self.within_tolerance,
            "changed": self.changed,
            "ways": {each.way.name: each.to_json_dict() for each in self.ways},
            "robot": self.cell.name,
        }


def checked_ways(cell: Cell, readings: Readings) -> list[Way]:
    """Ways from the world to all that was read, each with a record; none where one of these is no such way."""
    ways = possible_ways(cell, readings.views)
    if CORNERS in readings.tables or {way.name for way in ways if way.record is not None} != set(readings.views):
        return []
    try:
        return ways if all(way.robot.joint_count for way in ways) else []
    except InvalidInput:  # an arm has what no longer arm brings along
        return []


def check_cell(
    cell: Cell,
    data: Sequence[tuple[Way, Dataset]],
    *,
    tolerance: float | None = None,
    as_read: bool = False,
    threads: int = 1,
) -> CellCheck:
    """Holds a calibrated cell against new postures.

    Args:
        cell: Calibrated: model.yaml.
        data: Each way with its rows.
        tolerance: Largest distance of a point [m] that is accepted.
        as_read: Take the columns as they are.
        threads: Cores.

    Raises:
        InvalidInput: The cell keeps no covariance of a way, or as of `check`.
    """
    ways = []
    for way, rows in data:
        if way.record is None:
            raise InvalidInput(
                f"{cell.name} keeps no covariance of what carries {way.name}; expected a model.yaml of `fastcal "
                "calibrate` from readings that fix it"
            )
        found = check(way.robot, rows, tolerance=tolerance, as_read=as_read, threads=threads)
        ways.append(WayCheck(way, found))
    return CellCheck(cell, ways, tolerance)
