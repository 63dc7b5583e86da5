# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibrated cell brought up to date by a few pictures: what was known is the prior, what has moved is free.

With theta the arm's parameters and the changes of cameras, boards and lenses, L the root of the covariance that the
model keeps, D the directions of what has moved by a check of the same pictures and S their sizes,

    theta = theta_0 + L z + D S k,    z, k ~ N(0, 1),    r(theta) ~ N(0, s^2 n / (6 m))

for n coordinates in m pictures: six numbers are what a picture says of its posture, as in the check. Gauss-Newton
iteration, each step halved until the cost falls.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.camera_places import CameraPlace, camera_place, middles_of_boards
from fastcal.calibration.data_notes import covered
from fastcal.calibration.evaluation import Evaluation, evaluate
from fastcal.calibration.pictures import seen_by_model
from fastcal.calibration.result import IdentifiedParameter
from fastcal.calibration.unknowns import CORNERS, given_rig, kept_unknowns, of_corners
from fastcal.effects.entries import edge_name, edge_unit, full_name
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.monitoring.causes import LEVEL
from fastcal.monitoring.hypotheses import zero_direction
from fastcal.monitoring.picture_check import NUMBERS, PictureCheck, check_pictures
from fastcal.place import place_of
from fastcal.robot.calibration_record import CalibrationRecord, lower_root
from fastcal.robot.hand_eye import hand_eyes
from fastcal.robot.identified_spec import Values, identified_spec
from fastcal.robot.made_by import made_by
from fastcal.robot.rig import PLACEMENT, with_found
from fastcal.robot.robot import Robot
from fastcal.units import factor, from_si, to_si

SIZES = 3.0  # times as far as the check says that it moved, and the least sizes: how far a thing may have moved
LEAST_MM, LEAST_DEG = 1.0, 0.1
_ROUNDS = 30
_HALVED = 20
_SETTLED = 1e-4  # standard deviations of the prior: less of a step is none


@dataclass(frozen=True, eq=False)
class PictureUpdate:
    """What `update_pictures` found.

    Attributes:
        model: Up to date.
        before: The check of the same pictures against the old model.
        freed: What may have moved and was free: cameras, boards, joints.
        parameters: Those that the model keeps; of cameras and boards the change, and 0 as what they had.
        train: Errors on the pictures, and `was` those of the old model.
        cameras: How surely each camera's place is known now.
        status: converged, or not_converged where what is left is more than noise.
    """

    model: Robot
    before: PictureCheck
    freed: tuple[str, ...]
    parameters: list[IdentifiedParameter]
    train: Evaluation
    was: Evaluation
    cameras: list[CameraPlace]
    notes: tuple[str, ...]
    status: str

    @property
    def errors_px(self) -> tuple[float, float]:
        """RMS distance of a corner [px] with the old model and with this one."""
        before, after = (of.kinds[CORNERS].statistics[1] for of in (self.was, self.train))
        return (np.nan if before is None else before.rms, np.nan if after is None else after.rms)

    @property
    def sentence(self) -> str:
        """In words."""
        before, after = self.errors_px
        if self.status != "converged":
            return f"The pictures are not explained: {after:.3g} px RMS remain of {before:.3g} px; calibrate again."
        moved = f"{' or '.join(self.freed)} moved" if self.freed else "nothing moved"
        return f"Up to date: {moved}; RMS {before:.3g} px before and {after:.3g} px after."

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
            "freed": list(self.freed),
            "cameras": [of.to_json_dict() for of in self.cameras],
            "check": self.before.to_json_dict(),
            "notes": list(self.notes),
            "made_by": self.model.made_by,
        }


def update_pictures(
    model: Robot, data: Dataset, *, who: Mapping[str, str | None] | None = None, threads: int = 1
) -> PictureUpdate:
    """Brings a calibrated cell up to date with a few new pictures.

    Args:
        model: With its cameras and boards, and the covariance of their places: model.yaml.
        data: Postures, and the corners seen in them.
        who: What the model shall keep: serial, instrument, operator, date (YYYY-MM-DD).
        threads: Cores; the result does not depend on it.

    Raises:
        InvalidInput: There are no corners, or the model keeps no covariance of its cameras.
    """
    before = check_pictures(model, data, threads)
    record = model.record
    if record is None or not record.unknowns:
        raise InvalidInput(
            f"{model.name} keeps no covariance of its cameras and boards; expected a model.yaml that this version's "
            "`fastcal calibrate` made of pictures"
        )
    looked = seen_by_model(model, data, threads)
    problem = _Pictures.of(model, looked.data, record, threads)
    moved = np.column_stack(
        [np.zeros((problem.count, 0)), *(_may_have_moved(model, problem, of) for of in before.moved)]
    )
    L = problem.root_of(record)
    theta, root = problem.fitted(np.hstack([L, moved]))
    own, parameters = problem.own, problem.measured.parameters
    covariance = root @ root.T
    free = [i for i in range(own) if covariance[i, i] > 0]
    kept = [*free, *range(own, problem.count)]
    values = Values(theta, kept, covariance[np.ix_(kept, kept)])
    std = np.sqrt(np.diag(covariance))
    spec = with_found(
        identified_spec(model, model.error_model, Values(theta[:own], free, covariance[np.ix_(free, free)])),
        parameters,
        theta[own:],
        np.where(std[own:] > 0, std[own:], np.nan),
    )
    ranges = _widened(record.covered, covered(model, looked.data))
    names, rows = kept_unknowns(values, problem.measured, own, values.covariance)
    new = CalibrationRecord(
        [problem.names[i] for i in free],
        lower_root(covariance[np.ix_(free, free)]) if free else np.zeros((0, 0)),
        record.noise,
        record.degrees_of_freedom + NUMBERS * problem.pictures,
        record.moved,
        record.directions,
        ranges,
        names,
        rows,
    )
    nominal = {k: v for k, v in model.description.calibration.items() if k == "nominal"}
    result = Robot(spec).with_(
        calibration=new.to_spec() | nominal,
        made_by=made_by(model, data, who) | {"updated_from": model.sha256},
        correction=model.correction,
    )
    after = check_pictures(result, looked.data, threads)
    status = "converged" if after.p_value >= LEVEL else "not_converged"
    freed = tuple(of.owner for of in before.moved)
    return PictureUpdate(
        result,
        before,
        freed,
        _table(problem, theta, std, kept),
        evaluate(result, looked.data, unknowns=given_rig(result, looked.data), threads=threads),
        evaluate(model, looked.data, unknowns=given_rig(model, looked.data), threads=threads),
        _cameras(result, looked.data, problem, covariance, new, with_arm=bool(free)),
        (*looked.notes, *_doubts(freed)),
        status,
    )


@dataclass(frozen=True, eq=False)
class _Pictures:
    """The pictures as rows of theta: the model's parameters, then the changes of cameras, boards and lenses."""

    model: Robot
    samples: _core.Samples
    measured: _core.Measurements
    noise: float
    names: list[str]
    threads: int

    @staticmethod
    def of(model: Robot, data: Dataset, record: CalibrationRecord, threads: int) -> _Pictures:
        measured = measurements(data, model)
        names = [full_name(p) for p in (*model.error_model.parameters, *measured.parameters)]
        return _Pictures(model, model.samples(data), measured, record.sigma(CORNERS) or np.nan, names, threads)

    @property
    def own(self) -> int:
        """Parameters of the model, before the unknowns."""
        return len(self.model.error_model.start)

    @property
    def count(self) -> int:
        return len(self.names)

    @property
    def start(self) -> FloatArray:
        return np.concatenate([np.asarray(self.model.error_model.start), np.zeros(self.count - self.own)])

    @property
    def pictures(self) -> int:
        return len(np.unique(self._linear(self.start)[2]))

    def _linear(self, theta: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.int32]]:
        """Predicted less seen [px], its derivative, and rows, of the corners' coordinates."""
        ones = [1.0] * len(self.measured.observations)
        near = _core.linearize(self.model.error_model, self.samples, self.measured, theta, ones, self.threads)
        own = of_corners(near, self.measured)
        return np.asarray(near.r)[own], np.asarray(near.J)[own], np.asarray(near.row)[own]

    def root_of(self, record: CalibrationRecord) -> FloatArray:
        """(T, P + U) root of the covariance that the model keeps; 0 of what it did not identify."""
        rows = record.roots
        none = np.zeros(len(record.parameters) + len(record.unknowns))
        return np.array([rows.get(name, none) for name in self.names])

    def fitted(self, G: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(T,) theta = start + G u where the pictures and the priors of u put it, and a root of its covariance."""
        theta, u = self.start, np.zeros(G.shape[1])
        r, J, row = self._linear(theta)
        weight = np.sqrt(NUMBERS * len(np.unique(row)) / len(r)) / self.noise
        cost = float(weight**2 * (r @ r))
        for _ in range(_ROUNDS):
            M = weight * (J @ G)
            du = np.linalg.solve(M.T @ M + np.eye(len(u)), -(weight * (M.T @ r) + u))
            for halved in range(_HALVED):
                step = du / 2**halved
                there = self._linear(theta + G @ step)
                new = float(weight**2 * (there[0] @ there[0]) + (u + step) @ (u + step))
                if new <= cost:
                    theta, u, cost, (r, J, row) = theta + G @ step, u + step, new, there
                    break
            else:
                break
            if np.abs(du).max() < _SETTLED:
                break
        M = weight * (J @ G)
        T = np.linalg.cholesky(M.T @ M + np.eye(len(u)))
        return theta, np.asarray(np.linalg.solve(T, G.T).T, dtype=np.float64)


def _may_have_moved(model: Robot, problem: _Pictures, of: Any) -> FloatArray:
    """(T, k) columns of what may have moved, times how far."""
    columns = np.zeros((problem.count, 0))
    if of.shift_mm is not None and of.turn_deg is not None:
        shift, turn = to_si(SIZES * max(of.shift_mm, LEAST_MM), "mm"), to_si(SIZES * max(of.turn_deg, LEAST_DEG), "deg")
        sizes = dict(zip(PLACEMENT, [shift] * 3 + [turn] * 3, strict=True))
        at = [k for k, p in enumerate(problem.measured.parameters) if p.owner == of.owner and p.name in sizes]
        columns = np.zeros((problem.count, len(at)))
        for column, k in enumerate(at):
            columns[problem.own + k, column] = sizes[problem.measured.parameters[k].name]
        return columns
    shift_mm, turn_deg = of.shift_mm, of.turn_deg
    size = (
        to_si(SIZES * max(shift_mm, LEAST_MM), "mm")
        if turn_deg is None
        else to_si(SIZES * max(turn_deg, LEAST_DEG), "deg")
    )
    columns = np.zeros((problem.count, 1))
    columns[: problem.own, 0] = size * zero_direction(model, place_of(of.owner).index)
    return columns


def _widened(
    ranges: Mapping[str, tuple[float, float]], new: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """The ranges, with those of the new rows."""
    out = dict(ranges)
    for name, (low, high) in new.items():
        least, most = out.get(name, (low, high))
        out[name] = (min(low, least), max(high, most))
    return out


def _table(problem: _Pictures, theta: FloatArray, std: FloatArray, kept: list[int]) -> list[IdentifiedParameter]:
    parameters = [*problem.model.error_model.parameters, *problem.measured.parameters]
    geometry = len(problem.model.core.parameters)
    start, out = problem.start, []
    for i in kept:
        is_geometry = i < geometry or i >= problem.own
        unit = edge_unit(parameters[i], geometry=is_geometry)
        name = edge_name(parameters[i], geometry=is_geometry)
        value, nominal = (from_si(float(of[i]), unit) for of in (theta, start))
        out.append(IdentifiedParameter(name, parameters[i].owner, value, float(std[i]) / factor(unit), unit, nominal))
    return out


def _cameras(
    model: Robot,
    data: Dataset,
    problem: _Pictures,
    covariance: FloatArray,
    record: CalibrationRecord,
    *,
    with_arm: bool,
) -> list[CameraPlace]:
    at = {(p.owner, p.name): problem.own + k for k, p in enumerate(problem.measured.parameters)}
    out = []
    for of in hand_eyes(model.description):
        six = [at[f"camera {of.camera}", axis] for axis in PLACEMENT if (f"camera {of.camera}", axis) in at]
        middles = middles_of_boards(model, data, of.camera)
        if len(six) == len(PLACEMENT) and len(middles):
            C = covariance[np.ix_(six, six)]
            out.append(camera_place(of.camera, of.parent, C, record.degrees_of_freedom, middles, with_arm=with_arm))
    return out


def _doubts(freed: tuple[str, ...]) -> list[str]:
    if len(freed) < 2:
        return []
    return [
        f"{' or '.join(freed)} moved: these pictures do not tell which, and both are given a part; pictures from other "
        "postures tell them apart"
    ]
