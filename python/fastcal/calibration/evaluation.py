# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How far a model is from what was measured: error statistics, and ISO 9283 where poses repeat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.display.shown import Shown
from fastcal.measurements.dataset import Dataset
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.robot import Robot
from fastcal.units import from_si

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ErrorStatistics:
    """Distances over all rows [m]: of points, or of lengths where no point was measured. std is with n - 1."""

    count: int
    mean: float
    std: float
    max: float
    rms: float

    @staticmethod
    def of(distances: FloatArray) -> ErrorStatistics | None:
        """Statistics of (N,) distances [m], NaN left out; None where nothing is left."""
        known = distances[~np.isnan(distances)]
        if len(known) == 0:
            return None
        std = float(np.std(known, ddof=1)) if len(known) > 1 else 0.0
        return ErrorStatistics(
            len(known), float(np.mean(known)), std, float(np.max(known)), float(np.sqrt(np.mean(known**2)))
        )

    def to_mm(self) -> dict[str, float]:
        """mean, std, max, rms in mm, as result.json holds them."""
        return {name: from_si(getattr(self, name), "mm") for name in ("mean", "std", "max", "rms")}


@dataclass(frozen=True)
class Repeatability:
    """ISO 9283:1998, 7.2: accuracy and repeatability of the poses that were measured more than once [m].

    Attributes:
        poses: Number of poses with at least two visits.
        visits: Rows that belong to them.
        accuracy: (poses,) AP, distance from the predicted point to the mean of the visits.
        repeatability: (poses,) RP = mean l + 3 S_l, l the distance of a visit from their mean.
        sigma: Pure noise of one coordinate, pooled over the poses.
    """

    poses: int
    visits: int
    accuracy: FloatArray
    repeatability: FloatArray
    sigma: float


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation(Shown):
    """A data set beside a model before and after calibration.

    Attributes:
        data: What was measured.
        error_before, error_after: (N, 3) predicted less measured point [m], NaN where not measured; error_before is
            None where only one model is judged.
        length_before, length_after: (N,) predicted less measured length [m], or None where no length was measured.
        turn_after: (N,) angle between predicted and measured orientation [rad], or None.
        before, after: Statistics of the distances; None where nothing of the kind was measured.
        repeatability: ISO 9283, where poses repeat.
    """

    data: Dataset
    error_after: FloatArray
    length_after: FloatArray | None
    turn_after: FloatArray | None
    after: ErrorStatistics | None
    error_before: FloatArray | None = None
    length_before: FloatArray | None = None
    before: ErrorStatistics | None = None
    repeatability: Repeatability | None = None

    def to_json_dict(self) -> dict[str, Any]:
        """The blocks `train` and `test` of result.json."""
        out: dict[str, Any] = {"count": len(self.data)}
        if self.before is not None:
            out["before_mm"] = self.before.to_mm()
        out["after_mm"] = None if self.after is None else self.after.to_mm()
        if self.turn_after is not None and not np.all(np.isnan(self.turn_after)):
            out["after_rotation_deg"] = {
                "mean": from_si(float(np.nanmean(self.turn_after)), "deg"),
                "max": from_si(float(np.nanmax(self.turn_after)), "deg"),
                "rms": from_si(float(np.sqrt(np.nanmean(self.turn_after**2))), "deg"),
            }
        if self.repeatability is not None:
            r = self.repeatability
            out["iso_9283"] = {
                "poses": r.poses,
                "visits": r.visits,
                "accuracy_mm": {
                    "mean": from_si(float(np.mean(r.accuracy)), "mm"),
                    "max": from_si(float(np.max(r.accuracy)), "mm"),
                },
                "repeatability_mm": {
                    "mean": from_si(float(np.mean(r.repeatability)), "mm"),
                    "max": from_si(float(np.max(r.repeatability)), "mm"),
                },
                "sigma_mm": from_si(r.sigma, "mm"),
            }
        return out


def residuals(
    robot: Robot, data: Dataset, anchors: dict[str, FloatArray] | None = None, threads: int = 1
) -> tuple[FloatArray, FloatArray | None, FloatArray | None]:
    """Predicted less measured: points (N, 3) [m], lengths (N,) [m] or None, angles (N,) [rad] or None.

    NaN where not measured. `anchors` are the known places of the anchors by name; a length to another one is NaN.
    """
    T = robot.poses(data, threads=threads)
    points = np.full((len(data), 3), np.nan) if data.position is None else T[:, :3, 3] - data.position
    lengths = None
    if data.distance is not None and data.anchor is not None:
        places = np.array([(anchors or {}).get(name, np.full(3, np.nan)) for name in data.anchor_names])
        here = np.where((data.anchor >= 0)[:, None], places[data.anchor], np.nan)
        lengths = np.linalg.norm(T[:, :3, 3] - here, axis=1) - data.distance
    turns = None
    if data.rotation is not None:
        turns = np.array([_angle(R, wxyz) for R, wxyz in zip(T[:, :3, :3], data.rotation, strict=True)])
    return points, lengths, turns


def _angle(R: FloatArray, wxyz: FloatArray) -> float:
    if np.isnan(wxyz).any():
        return float("nan")
    return float(np.linalg.norm(_core.log_so3(_core.quaternion_to_rotation(wxyz).T @ R)))


def distances(points: FloatArray, lengths: FloatArray | None) -> FloatArray:
    """(N,) length of each whole point's error, or |error| of the row's length where it has no point; else NaN."""
    out = np.linalg.norm(points, axis=1)
    return out if lengths is None else np.where(np.isnan(out), np.abs(lengths), out)


def evaluate(
    robot: RobotLike,
    data: DataLike,
    *,
    before: Robot | None = None,
    anchors: dict[str, FloatArray] | None = None,
    anchors_before: dict[str, FloatArray] | None = None,
    threads: int = 1,
) -> Evaluation:
    """Error statistics of a model on measured data, beside those of `before` where it is given.

    Anchors of lengths are the ones that calibration found; without any, lengths are not judged. Paths are read.
    """
    robot = as_robot(robot)
    data = as_data(data, robot)
    points, lengths, turns = residuals(robot, data, anchors, threads)
    after = distances(points, lengths)
    out = Evaluation(
        data, points, lengths, turns, ErrorStatistics.of(after), repeatability=repeatability(robot, data, points)
    )
    if before is None:
        return out
    points_before, lengths_before, _ = residuals(before, data, anchors_before, threads)
    first = ErrorStatistics.of(distances(points_before, lengths_before))
    return Evaluation(data, points, lengths, turns, out.after, points_before, lengths_before, first, out.repeatability)


def pose_groups(data: Dataset) -> NDArray[np.intp]:
    """(N,) 0 ... poses - 1: rows with the same commanded joints and payload have the same number."""
    # 1e-6 rad or m: commands are rounded in files, and nobody commands two poses that close
    keys = np.round(np.column_stack([data.q, data.payload]) / 1e-6).astype(np.int64)
    return np.unique(keys, axis=0, return_inverse=True)[1].ravel()


def repeatability(robot: Robot, data: Dataset, error: FloatArray) -> Repeatability | None:
    """ISO 9283 accuracy and repeatability over poses with the same command and payload; None where none repeats."""
    whole = ~np.isnan(error).any(axis=1)
    if not whole.any():
        return None
    _, group, count = np.unique(pose_groups(data)[whole], return_inverse=True, return_counts=True)
    repeated = np.flatnonzero(count > 1)
    if len(repeated) == 0:
        return None
    e = error[whole]
    accuracy, spread, squares, freedom = [], [], 0.0, 0
    for g in repeated:
        visits = e[group.ravel() == g]
        mean = visits.mean(axis=0)
        lengths = np.linalg.norm(visits - mean, axis=1)
        accuracy.append(float(np.linalg.norm(mean)))
        spread.append(float(lengths.mean() + 3 * lengths.std(ddof=1)))
        squares += float(((visits - mean) ** 2).sum())
        freedom += 3 * (len(visits) - 1)
    return Repeatability(
        len(repeated),
        int(count[repeated].sum()),
        np.array(accuracy),
        np.array(spread),
        float(np.sqrt(squares / freedom)),
    )
