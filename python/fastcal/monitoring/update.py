# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibrated model brought up to date by a few poses: what was known is the prior, what may have moved is free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fastcal.calibration.alignment import measurements
from fastcal.calibration.data_notes import covered
from fastcal.calibration.evaluation import Evaluation, evaluate
from fastcal.calibration.parallel import one_blas_thread
from fastcal.calibration.result import IdentifiedParameter
from fastcal.calibration.unknowns import unknowns_by_owner
from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.effects.entries import edge_name, edge_unit, full_name
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, Kind, KindNoise
from fastcal.monitoring.check import check
from fastcal.monitoring.linear import record_of
from fastcal.monitoring.refit import Refit, refit
from fastcal.monitoring.result import CheckResult
from fastcal.monitoring.setting import given, prepared
from fastcal.robot.calibration_record import LACKS_EFFECT, CalibrationRecord, lower_root
from fastcal.robot.given import DataLike, RobotLike
from fastcal.robot.made_by import made_by
from fastcal.robot.robot import Robot
from fastcal.units import factor, from_si


@dataclass(frozen=True, eq=False, repr=False)
class UpdateResult(Shown):
    """What `update` found.

    Attributes:
        model: Up to date, in the measuring frame of the first set-up.
        before: The check of the same rows against the old model.
        parameters: Of the arm and its tool; `nominal` is what the old model had.
        train: Errors on the rows.
        noise: Of a number of each kind of reading, pooled; degrees_of_freedom too.
        left_out: Rows that were left out as wrong.
        status: converged or not_converged.
    """

    model: Robot
    before: CheckResult
    parameters: list[IdentifiedParameter]
    train: Evaluation
    noise: Mapping[str, KindNoise]
    degrees_of_freedom: int
    left_out: list[int]
    notes: list[str] = field(default_factory=list)
    status: str = "converged"

    @property
    def sigma(self) -> float | None:
        """Noise of a coordinate [m]; None where no point was measured."""
        return self.noise[POINTS].value if POINTS in self.noise else None

    @property
    def errors(self) -> list[tuple[Kind, float, float]]:
        """RMS error of each kind [m or rad] with the old model and with this one."""
        before = {fit.kind.name: fit.found.rms for fit in self.before.fits}
        after = {name: of.statistics[1] for name, of in self.train.kinds.items()}
        return [
            (self.train.kinds[name].kind, before[name], now.rms)
            for name, now in after.items()
            if now is not None and name in before
        ]

    def to_json_dict(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "status": self.status,
            "method": "update",
            "loss": "none",
            "train": self.train.to_json_dict(),
            "test": None,
            "parameters": [vars(p) for p in self.parameters],
            "unidentifiable": [],
            "sigma_mm": None if self.sigma is None else from_si(self.sigma, "mm"),
            "noise": {name: of.to_json_dict() for name, of in self.noise.items()},
            "degrees_of_freedom": self.degrees_of_freedom,
            "outliers": self.left_out,
            "check": self.before.to_json_dict(),
            "notes": self.notes,
            "made_by": self.model.made_by,
        }

    def save(self, folder: Any) -> None:
        """Writes model.yaml, result.json and report.html into a folder, all or none."""
        late.call("write_update", self, folder)


@one_blas_thread()
def update(
    model: RobotLike,
    *data: DataLike,
    as_read: bool = False,
    who: Mapping[str, str | None] | None = None,
    threads: int = 1,
) -> UpdateResult:
    """Brings a calibrated model up to date with a few new poses, twelve or so; the base is refitted.

    Args:
        model: A calibrated robot, which keeps its covariance: model.yaml.
        data: Measured poses; several files are several set-ups.
        as_read: Take the columns as they are, though another reading fits far better.
        who: What the model shall keep: serial, instrument, operator, date (YYYY-MM-DD).
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: The model keeps no covariance, or the data are of another robot.
        Undetermined: Too few points to fix a base.
    """
    robot, measured = given(model, data)
    before = check(robot, measured, as_read=as_read, who=who, threads=threads)
    wrong = [int(cause.label.removeprefix("row ")) for cause in before.causes if cause.kind == "row"]
    kept = measured.select(np.setdiff1d(np.arange(len(measured)), wrong)) if wrong else measured
    setting, _, notes = prepared(robot, kept, as_read=True, threads=threads)
    named = {label for cause in before.causes for label in (cause.label, *cause.equivalents)}
    changed = [h for h in setting.possible if h.label in named and h.directions is not None]
    fitted = refit(setting, changed, kept, threads)
    record = _record(robot, fitted, kept)
    nominal = {k: v for k, v in robot.description.calibration.items() if k in ("nominal", LACKS_EFFECT)}
    result = Robot(fitted.spec).with_(
        calibration=record.to_spec() | nominal,
        made_by=made_by(robot, measured, who) | {"updated_from": robot.sha256},
        correction=robot.correction,
    )
    if wrong:
        rows = ", ".join(map(str, wrong))
        notes.append(f"row{'s' if len(wrong) > 1 else ''} {rows} left out: no cause explains their error")
    if not fitted.converged:
        notes.append("the fit had not converged when it ended; the model is the best fit found")
    one = (
        replace(kept, station=None, station_names=()) if len(fitted.places) == 1 else kept.select(fitted.places[0].rows)
    )
    first = fitted.places[0]
    unknowns = unknowns_by_owner(measurements(first.data, first.robot), first.unknowns)
    return UpdateResult(
        result,
        before,
        _table(fitted),
        evaluate(result, one, unknowns=unknowns, threads=threads),
        {fit.kind.name: replace(fit.noise, value=fitted.scale * fit.noise.value) for fit in before.fits},
        record.degrees_of_freedom,
        wrong,
        notes,
        "converged" if fitted.converged else "not_converged",
    )


def _record(old: Robot, fitted: Refit, data: Dataset) -> CalibrationRecord:
    """What the new model keeps."""
    record = record_of(old)
    names = [full_name(fitted.rows.parameters[i]) for i in fitted.free]
    moved = [i for i in range(len(fitted.held)) if np.any(fitted.held[i] != 0)]
    ranges = dict(record.covered)
    for name, (low, high) in covered(old, data).items():
        before = ranges.get(name, (low, high))
        ranges[name] = (min(low, before[0]), max(high, before[1]))
    return CalibrationRecord(
        names,
        lower_root(fitted.covariance),
        {kind: (value * fitted.scale, unit) for kind, (value, unit) in record.noise.items()},
        round(fitted.freedom),
        [full_name(fitted.rows.parameters[i]) for i in moved],
        fitted.held[moved],
        ranges,
    )


def _table(fitted: Refit) -> list[IdentifiedParameter]:
    """The arm's parameters, now and before; those of the base are of the instrument."""
    out = []
    start = np.asarray(fitted.start.error_model.start)
    deviation = np.sqrt(np.diag(fitted.covariance))
    for k, i in enumerate(fitted.free):
        p, geometry = fitted.rows.parameters[i], i < fitted.rows.own
        if geometry and p.owner == "base":
            continue
        unit = edge_unit(p, geometry=geometry)
        f = factor(unit)
        out.append(
            IdentifiedParameter(
                edge_name(p, geometry=geometry),
                p.owner,
                fitted.theta[i] / f,
                float(deviation[k]) / f,
                unit,
                start[i] / f,
            )
        )
    return out
