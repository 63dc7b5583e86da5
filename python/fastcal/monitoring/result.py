# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What a check found: the content of check.json."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.error_statistics import ErrorStatistics
from fastcal.calibration.kind_errors import KindErrors
from fastcal.display import late
from fastcal.display.shown import PlottedArm, Shown
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, Kind, KindNoise
from fastcal.monitoring.setups import SetUp
from fastcal.place import joint_column
from fastcal.robot.pendant import controller_columns
from fastcal.robot.robot import Robot
from fastcal.units import from_si, to_si

VERDICTS = ("holds", "changed", "cannot_tell")
FEWEST_DEGREES = 6  # of freedom: with fewer a change hides in the base, four points have six


@dataclass(frozen=True)
class Change:
    """One number that is no longer what the model says, in the unit of its name.

    Attributes:
        value, was: Now and in the model; std is that of their difference.
        p_value: Of the change, held against all changes that were tried.
    """

    name: str
    owner: str
    value: float
    std: float
    unit: str
    was: float
    p_value: float

    @property
    def change(self) -> float:
        """Value - was."""
        return self.value - self.was


@dataclass(frozen=True)
class Cause:
    """What happened, as far as the poses show it.

    Attributes:
        kind: zero, tool, effect, new effect, link, row or noise.
        label: "joint3 zero", "tool", "joint_compliance@joint2".
        probability: Among all that were tried, given that one of them happened.
        equivalents: Labels of others that the poses cannot distinguish from it, the likeliest first.
        changes: Its numbers.
    """

    kind: str
    label: str
    probability: float
    equivalents: tuple[str, ...]
    changes: tuple[Change, ...]


@dataclass(frozen=True)
class Test:
    """A change that was looked for, alone: for control charts.

    Attributes:
        kind: zero, tool, effect, new effect or link.
        value: Estimated change, in `unit`; std its standard deviation, std_noise the part of it that is the new rows'
            own: two checks of one model share the rest.
        detectable: The smallest change that these poses show four times in five, in `unit`.
    """

    kind: str
    name: str
    owner: str
    value: float
    std: float
    std_noise: float
    unit: str
    p_value: float
    detectable: float


@dataclass(frozen=True)
class NextPose:
    """A pose to measure next: joints in edge units, payload [kg]."""

    q: tuple[float, ...]
    payload_kg: float


@dataclass(frozen=True, eq=False)
class KindFit:
    """How a kind of reading fits the model.

    Attributes:
        errors: What the readings are off.
        expected_rms: [m or rad] as noise and the model's uncertainty make it.
        noise: Of a number.
    """

    errors: KindErrors
    expected_rms: float
    noise: KindNoise

    @property
    def kind(self) -> Kind:
        """Which one."""
        return self.errors.kind

    @property
    def found(self) -> ErrorStatistics:
        """Of what the readings are off."""
        return self.errors.statistics[1] or ErrorStatistics(0, 0.0, 0.0, 0.0, 0.0)

    def to_json_dict(self) -> dict[str, Any]:
        """An entry of `kinds` in check.json."""
        return self.errors.to_json_dict() | {"expected_rms": self.kind.shown(self.expected_rms)}


@dataclass(frozen=True, eq=False, repr=False)
class CheckResult(PlottedArm, Shown):
    """What `check` found.

    Attributes:
        verdict: holds, changed or cannot_tell; `sentence` says it, `reasons` why.
        model: As it was given.
        data: What was measured.
        places: Each set-up of the instrument, with the model's base where it is now.
        fits: How each kind of reading fits, points first.
        p_value: That the model, unchanged, gives such a misfit; held against all changes that were tried.
        misfit_p_value: Of the misfit as a whole.
        within_tolerance: None without a tolerance, or where the poses don't decide it.
        degrees_of_freedom: Numbers less the bases' motions.
        causes: What changed, where the verdict is `changed`; what may explain it where it is `cannot_tell`.
        tests: Every change that was looked for.
        blind: Labels of changes that no pose shows, such as joint 1's zero where the base was set up again.
        next_poses: What to measure next, where that decides something.
        next_act: What to do now, in a sentence; empty where nothing is asked.
        made_by: Version, hashes and what is known of who measured what.
    """

    verdict: str
    sentence: str
    reasons: list[str]
    model: Robot
    data: Dataset
    places: list[SetUp]
    fits: list[KindFit]
    p_value: float
    misfit_p_value: float
    tolerance: float | None
    within_tolerance: bool | None
    degrees_of_freedom: int
    causes: list[Cause]
    tests: list[Test]
    blind: list[str]
    next_poses: list[NextPose]
    next_act: str = ""
    notes: list[str] = field(default_factory=list)
    made_by: dict[str, Any] = field(default_factory=dict)

    @property
    def changed(self) -> list[Change]:
        """All numbers of all causes."""
        return [change for cause in self.causes for change in cause.changes]

    @property
    def main(self) -> KindFit:
        """Of the kind that is spoken of: points where they were measured."""
        return self.fits[0]

    @property
    def rms(self) -> float:
        """Error of the readings that are spoken of, such as distances of points from the model [m or rad]."""
        return float(np.sqrt(np.nanmean(self.main.errors.after**2)))

    @property
    def expected_rms(self) -> float:
        """`rms` as noise and the model's uncertainty make it."""
        return self.main.expected_rms

    @property
    def largest(self) -> float:
        """The largest of these errors [m or rad]."""
        return self.main.found.max

    @property
    def sigma(self) -> float:
        """Noise of one of their numbers [m or rad]."""
        return self.main.noise.value

    @property
    def rms_mm(self) -> float | None:
        """`rms` in mm; None where no point was measured."""
        return self._mm(self.rms)

    @property
    def expected_rms_mm(self) -> float | None:
        """`expected_rms` in mm; None where no point was measured."""
        return self._mm(self.expected_rms)

    @property
    def largest_mm(self) -> float | None:
        """`largest` in mm; None where no point was measured."""
        return self._mm(self.largest)

    def _mm(self, value: float) -> float | None:
        return from_si(value, "mm") if self.main.kind.name == POINTS else None

    def errors(self) -> FloatArray:
        """(N,) error of each row's reading, such as the distance of a point [m or rad]; the largest of several."""
        each = self.main.errors.after
        return np.where(np.isnan(each).all(axis=1), np.nan, np.nan_to_num(each, nan=-1.0).max(axis=1))

    def shown(self, pose: NextPose) -> dict[str, float]:
        """A pose's joints as the controller shows them, by the names of a file's columns, to 0.001 deg or mm."""
        units = ["deg" if kind == "revolute" else "mm" for kind in self.model.joint_types]
        q = np.array([[to_si(value, unit) for value, unit in zip(pose.q, units, strict=True)]])
        columns = controller_columns(self.model.description, q)
        return {name: round(float(values[0]), 3) for name, values in columns.items()}

    def to_json_dict(self) -> dict[str, Any]:
        """The content of check.json."""
        units = ["deg" if kind == "revolute" else "mm" for kind in self.model.joint_types]
        out: dict[str, Any] = {
            "verdict": self.verdict,
            "sentence": self.sentence,
            "next_act": self.next_act or None,
            "reasons": self.reasons,
            "rms_mm": self.rms_mm,
            "expected_rms_mm": self.expected_rms_mm,
            "max_mm": self.largest_mm,
            "p_value": self.p_value,
            "misfit_p_value": self.misfit_p_value,
            "tolerance_mm": None if self.tolerance is None else from_si(self.tolerance, "mm"),
            "within_tolerance": self.within_tolerance,
            "aligned": self.places[0].to_json_dict() if self.places else None,
            "changed": [vars(change) for cause in self.causes for change in cause.changes]
            if self.verdict == "changed"
            else [],
            "causes": [
                {
                    "kind": cause.kind,
                    "label": cause.label,
                    "probability": cause.probability,
                    "equivalents": list(cause.equivalents),
                    "changes": [vars(change) | {"change": change.change} for change in cause.changes],
                }
                for cause in self.causes
            ],
            "next_poses": [
                {joint_column(i, unit): q for i, (unit, q) in enumerate(zip(units, pose.q, strict=True))}
                | self.shown(pose)
                | {"payload_kg": pose.payload_kg}
                for pose in self.next_poses
            ],
            "tests": [vars(test) for test in self.tests],
            "blind": self.blind,
            "count": len(self.data),
            "degrees_of_freedom": self.degrees_of_freedom,
            "sigma_mm": self._mm(self.sigma),
            "errors_mm": [float(v) for v in from_si(self.errors(), "mm")] if self.rms_mm is not None else None,
            "kinds": {fit.kind.name: fit.to_json_dict() for fit in self.fits},
            "noise": {fit.kind.name: fit.noise.to_json_dict() for fit in self.fits},
            "notes": self.notes,
            "robot": self.model.name,
            "made_by": self.made_by,
        }
        if len(self.places) > 1:
            out["stations"] = [{"station": place.name} | place.to_json_dict() for place in self.places]
        return out

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes check.json, or a page where the path ends in .html; whole or not at all."""
        late.call("write_check", self, path)
