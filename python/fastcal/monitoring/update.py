# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibrated model brought up to date by a few poses: what was known is the prior, what may have moved since is free.

    r = B b + J (R z + Q d + D k + H h) + e,    z, d, h ~ N(0, 1),  k ~ N(0, (3 S)^2)

R the root of the model's covariance, Q each parameter's quiet drift, D the directions of what a check of the same rows
says has changed, its rivals among them, with typical sizes S; H what the gauge held, where the new rows show it. Gauss
and Newton's iteration; the noise's variance is pooled with the calibration's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal.calibration.data_notes import covered
from fastcal.calibration.evaluation import Evaluation, evaluate
from fastcal.calibration.result import IdentifiedParameter
from fastcal.display import late
from fastcal.display.shown import Shown
from fastcal.effects.entries import edge_name, edge_unit, full_name, identity
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.check import Setting, check, joined, prepared
from fastcal.monitoring.drift import drift_of
from fastcal.monitoring.hypotheses import Hypothesis
from fastcal.monitoring.linear import MOTIONS, LinearRows, as_known, linear_rows, record_of
from fastcal.monitoring.result import CheckResult
from fastcal.monitoring.setups import SetUp, set_ups
from fastcal.robot.calibration_record import CalibrationRecord, lower_root
from fastcal.robot.given import DataLike, RobotLike, as_robot
from fastcal.robot.identified_spec import identified_spec
from fastcal.robot.made_by import made_by, robot_hash
from fastcal.robot.robot import Robot
from fastcal.units import factor, from_si

FloatArray = NDArray[np.float64]

EVENT_SIZES = 3.0  # typical sizes: how far what has changed may be from the model
_ROUNDS = 3  # a zero off by a degree is linear to a ten-thousandth after the second
_UNSEEN = 0.1  # standard deviations: less of a held direction leaves it held
_FEWEST = 3.0  # numbers beyond the bases' motions


@dataclass(frozen=True, eq=False, repr=False)
class UpdateResult(Shown):
    """What `update` found.

    Attributes:
        model: Up to date, in the measuring frame of the first set-up.
        before: The check of the same rows against the old model.
        parameters: Of the arm and its tool; `nominal` is what the old model had.
        train: Errors on the rows.
        sigma: Noise of a coordinate [m], pooled; degrees_of_freedom too.
        left_out: Rows that were left out as wrong.
    """

    model: Robot
    before: CheckResult
    parameters: list[IdentifiedParameter]
    train: Evaluation
    sigma: float
    degrees_of_freedom: int
    left_out: list[int]
    notes: list[str] = field(default_factory=list)

    def to_json_dict(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "status": "converged",
            "method": "update",
            "loss": "none",
            "train": self.train.to_json_dict(),
            "test": None,
            "parameters": [vars(p) for p in self.parameters],
            "unidentifiable": [],
            "sigma_mm": from_si(self.sigma, "mm"),
            "degrees_of_freedom": self.degrees_of_freedom,
            "outliers": self.left_out,
            "check": self.before.to_json_dict(),
            "notes": self.notes,
            "made_by": self.model.spec["made_by"],
        }

    def save(self, folder: Any) -> None:
        """Writes model.yaml, result.json and report.html into a folder, all or none."""
        late.call("write_update", self, folder)


def update(
    model: RobotLike,
    *data: DataLike,
    as_read: bool = False,
    who: Mapping[str, str | None] | None = None,
    threads: int = 1,
) -> UpdateResult:
    """Brings a calibrated model up to date with a few new poses, twelve or so; the base is fitted anew.

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
    if not data:
        raise InvalidInput("expected the model and then at least one set of measured poses")
    robot = as_robot(model)
    measured = joined(data, robot)
    before = check(robot, measured, as_read=as_read, who=who, threads=threads)
    wrong = [int(cause.label.removeprefix("row ")) for cause in before.causes if cause.kind == "row"]
    kept = measured.select(np.setdiff1d(np.arange(len(measured)), wrong)) if wrong else measured
    setting, _, notes = prepared(robot, kept, as_read=True, threads=threads)
    named = {label for cause in before.causes for label in (cause.label, *cause.equivalents)}
    changed = [h for h in setting.possible if h.label in named and h.directions is not None]
    fitted = _fit(setting, changed, kept, threads)
    record = _record(robot, fitted, kept)
    spec = fitted.spec | {
        "calibration": record.to_spec() | {k: v for k, v in (robot.spec["calibration"]).items() if k == "nominal"},
        "made_by": made_by(robot, measured, who) | {"updated_from": robot_hash(robot)},
    }
    if robot.correction is not None:
        spec["correction"] = robot.correction
    result = Robot(spec)
    if wrong:
        rows = ", ".join(map(str, wrong))
        notes.append(f"row{'s' if len(wrong) > 1 else ''} {rows} left out: nothing else explains what is off there")
    one = (
        replace(kept, station=None, station_names=()) if len(fitted.places) == 1 else kept.select(fitted.places[0].rows)
    )
    return UpdateResult(
        result,
        before,
        _table(setting, fitted, record),
        evaluate(result, one, threads=threads),
        fitted.scale * before.sigma,
        record.degrees_of_freedom,
        wrong,
        notes,
    )


@dataclass(frozen=True, eq=False)
class _Fitted:
    """Where the iteration ended.

    Attributes:
        spec: Of the model, its base that of the first set-up.
        start: The model that the fit began from, its new effects at 0.
        rows: The last linear problem; scale the root of the pooled variance over the old one.
        theta: (P,) of `start`'s parameters, the base's included.
        covariance: (P, P) of them.
        free: Indices of what has a covariance.
        held: (P, j) directions that the new rows don't show either.
    """

    spec: dict[str, Any]
    start: Robot
    places: list[SetUp]
    rows: LinearRows
    scale: float
    freedom: float
    theta: FloatArray
    covariance: FloatArray
    free: list[int]
    held: FloatArray


@dataclass(frozen=True, eq=False)
class _Solution:
    """What `identified_spec` asks for."""

    theta: FloatArray
    free: list[int]
    covariance: FloatArray


def _fit(setting: Setting, changed: list[Hypothesis], data: Dataset, threads: int) -> _Fitted:
    arm = _with_named_effects(setting, changed)
    record = record_of(setting.arm)
    known, _ = as_known(data, record)
    names = [full_name(p) for p in arm.error_model.parameters]
    at = _places_of(setting.extended_arm, arm)
    robot, spread, u = arm, np.zeros((0, 0)), np.zeros(0)
    for _ in range(_ROUNDS):
        places = set_ups(robot, known, threads=threads)
        rows = linear_rows(places, record, threads=threads)
        B, J = rows.B, rows.J
        F = len(record.parameters)
        seen, held = _held(rows, F)
        k = [h.directions[at] * (EVENT_SIZES * h.sizes) for h in changed if h.directions is not None]
        G = np.hstack([rows.R[:, :F], _quiet(arm, record, names), *k, seen])
        u = u if len(u) == G.shape[1] else np.zeros(G.shape[1])
        A = np.block([[B, J @ G], [np.zeros((G.shape[1], B.shape[1])), np.eye(G.shape[1])]])
        y = np.concatenate([rows.r, -u])
        size = np.linalg.norm(A, axis=0)
        Q, T = np.linalg.qr(A / size)
        step = np.linalg.solve(T, Q.T @ y) / size
        spread = np.linalg.solve(T, np.eye(len(T))) / size[:, None]
        u = u + step[B.shape[1] :]
        left = y - A @ step
        theta = places[0].robot.error_model.start + G @ step[B.shape[1] :]
        base = [i for i, p in enumerate(rows.parameters[: rows.own]) if p.owner == "base"]
        theta[base] += step[:MOTIONS]
        robot = Robot(
            identified_spec(places[0].robot, places[0].robot.error_model, _Solution(theta, [], np.zeros((0, 0))))
        )
    freedom = rows.freedom + len(rows.r) - B.shape[1]
    scale = float(np.sqrt((rows.freedom + left @ left) / freedom))
    to_theta = np.zeros((len(theta), len(step)))
    to_theta[base, :MOTIONS] = np.eye(MOTIONS)
    to_theta[:, B.shape[1] :] = G
    root = scale * to_theta @ spread
    free = [i for i in range(len(theta)) if np.any(root[i] != 0)]
    covariance = root[free] @ root[free].T
    held[base] = -np.linalg.lstsq(B[:, :MOTIONS], J @ held, rcond=None)[0]
    spec = identified_spec(places[0].robot, places[0].robot.error_model, _Solution(theta, free, covariance))
    return _Fitted(spec, arm, places, rows, scale, freedom, theta, covariance, free, held)


def _with_named_effects(setting: Setting, changed: list[Hypothesis]) -> Robot:
    """The arm with those of the effects it did not have that are among what has changed."""
    named = {h.label for h in changed if h.kind == "new effect"}
    there = {identity(entry) for entry in setting.arm.spec["effects"]}
    effects = [
        entry
        for entry in setting.extended_arm.spec["effects"]
        if identity(entry) in there or f"{entry['effect']}@{entry['owner']}" in named
    ]
    return Robot(setting.arm.spec | {"effects": effects})


def _places_of(larger: Robot, smaller: Robot) -> list[int]:
    """Indices of the smaller model's parameters among those of the larger."""
    own = len(larger.core.parameters)
    out, at = list(range(own)), own
    kept = {identity(entry) for entry in smaller.spec["effects"]}
    for entry, effect in zip(larger.spec["effects"], larger.effects, strict=True):
        if identity(entry) in kept:
            out += range(at, at + len(effect.parameters))
        at += len(effect.parameters)
    return out


def _quiet(arm: Robot, record: CalibrationRecord, names: list[str]) -> FloatArray:
    """(P, p) quiet drift of each parameter that the calibration identified, but for the base."""
    model = arm.error_model
    own = len(arm.core.parameters)
    columns = []
    for i, (p, name) in enumerate(zip(model.parameters, names, strict=True)):
        if name in record.parameters and not (i < own and p.owner == "base"):
            column = np.zeros(len(names))
            column[i] = drift_of(p, float(model.start[i]), geometry=i < own).quiet
            columns.append(column)
    return np.array(columns).reshape(-1, len(names)).T


def _held(rows: LinearRows, known: int) -> tuple[FloatArray, FloatArray]:
    """(P, s) held directions that the new rows show beside the bases, and (P, j) those that they don't."""
    H = rows.R[:, known:]
    Q = np.linalg.qr(rows.B / np.linalg.norm(rows.B, axis=0))[0]
    g = rows.J @ H
    shown = np.linalg.norm(g - Q @ (Q.T @ g), axis=0) > _UNSEEN
    return H[:, shown], H[:, ~shown].copy()


def _record(old: Robot, fitted: _Fitted, data: Dataset) -> CalibrationRecord:
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
        record.sigma_mm * fitted.scale,
        round(fitted.freedom),
        [full_name(fitted.rows.parameters[i]) for i in moved],
        fitted.held[moved],
        ranges,
        None if record.sigma_deg is None else record.sigma_deg * fitted.scale,
    )


def _table(setting: Setting, fitted: _Fitted, record: CalibrationRecord) -> list[IdentifiedParameter]:
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
