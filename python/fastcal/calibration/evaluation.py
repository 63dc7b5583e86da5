# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""How far a model is from what was measured: error statistics, and repeatability where poses repeat."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.error_statistics import ErrorStatistics as ErrorStatistics
from fastcal.calibration.kind_errors import KindErrors as KindErrors
from fastcal.calibration.kind_errors import sizes_of, table
from fastcal.calibration.kind_repeats import Repeats, repeats_of
from fastcal.calibration.repeatability import Repeatability as Repeatability
from fastcal.calibration.repeatability import pose_groups as pose_groups
from fastcal.calibration.repeatability import repeatability
from fastcal.calibration.unknowns import fitted_unknowns
from fastcal.display.shown import Shown
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, Kind, kind_named, of_observation
from fastcal.measurements.rotations import best_motion
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import frame_spec
from fastcal.units import from_si

ALIGNED_BETTER = 5.0
ALIGNED_ROWS = 4  # points: twelve numbers for six unknowns


@dataclass(frozen=True, eq=False)
class Realigned:
    """The rigid motion with which the same rows would fit best: measured = motion * predicted (W. Kabsch 1976).

    Attributes:
        motion: (4, 4) in the measuring frame.
        after: Statistics of the distances that it leaves.
    """

    motion: FloatArray
    after: ErrorStatistics

    def to_json_dict(self) -> dict[str, Any]:
        """The block `aligned`."""
        return {**frame_spec(self.motion), "after_mm": self.after.to_mm()}


@dataclass(frozen=True, eq=False)
class Remounted:
    """The shift d of the target in the tool's frame with which the same rows would fit best: measured = p + R d.

    Attributes:
        shift: (3,) [m].
        after: Statistics of the distances that it leaves.
    """

    shift: FloatArray
    after: ErrorStatistics

    def to_json_dict(self) -> dict[str, Any]:
        """The block `remounted`."""
        return {"xyz_mm": [from_si(float(d), "mm") for d in self.shift], "after_mm": self.after.to_mm()}


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation(Shown):
    """A data set beside a model before and after calibration.

    Attributes:
        data: What was measured.
        error_before, error_after: (N, 3) predicted less measured point [m], NaN where not measured; error_before is
            None where only one model is judged.
        length_after: (N,) predicted less measured length, or height over a touched plane [m], or None.
        turn_after: (N,) angle between predicted and measured orientation [rad], or None.
        before, after: Statistics of the points' distances; None where none was measured.
        kinds: Errors of each kind of reading, by its name.
        repeatability: Where poses repeat.
        aligned: Where another place of the tracker or the base would make the rows fit ALIGNED_BETTER times better.
        remounted: Where another seat of the target on the tool would, and no other place of the base does.
        others_after: What is left of each observation that is no pose, by its name: (N, k) [m or rad].
        rows: (N,) which of `all_rows` rows these N are; None: there are no others. `before` and `after` are of all.
    """

    data: Dataset
    error_after: FloatArray
    length_after: FloatArray | None
    turn_after: FloatArray | None
    after: ErrorStatistics | None
    error_before: FloatArray | None = None
    before: ErrorStatistics | None = None
    repeatability: Repeatability | None = None
    aligned: Realigned | None = None
    others_after: Mapping[str, FloatArray] = field(default_factory=dict)
    kinds: Mapping[str, KindErrors] = field(default_factory=dict)
    rows: NDArray[np.intp] | None = None
    all_rows: int | None = None
    remounted: Remounted | None = None

    @property
    def main(self) -> KindErrors | None:
        """The kind that a headline speaks of: points where they were measured; None where nothing was judged."""
        return next(iter(self.kinds.values()), None)

    @property
    def _in_mm(self) -> tuple[ErrorStatistics | None, ErrorStatistics | None]:
        """Before and after, of points or of the lengths that were measured in their place."""
        if self.after is not None:
            return self.before, self.after
        return self.main.statistics if self.main is not None and self.main.kind.unit == "mm" else (None, None)

    @cached_property
    def repeats(self) -> dict[str, Repeats]:
        """Pure noise of each kind of which postures were read more than once, by its name."""
        found = {name: repeats_of(self.data, of) for name, of in self.kinds.items()}
        return {name: repeats for name, repeats in found.items() if repeats is not None}

    @property
    def row_count(self) -> int:
        """Rows that the statistics are of."""
        return len(self.data) if self.all_rows is None else self.all_rows

    def places(self, rows: Sequence[int]) -> NDArray[np.intp]:
        """Where the given of all rows are among the N, as far as they are."""
        return np.asarray(rows, dtype=np.intp) if self.rows is None else np.flatnonzero(np.isin(self.rows, rows))

    def to_json_dict(self) -> dict[str, Any]:
        """The blocks `train` and `test` of result.json."""
        out: dict[str, Any] = {"count": self.row_count}
        before, after = self._in_mm
        if self.error_before is not None:
            out["before_mm"] = None if before is None else before.to_mm()
        out["after_mm"] = None if after is None else after.to_mm()
        if self.turn_after is not None and not np.all(np.isnan(self.turn_after)):
            out["after_rotation_deg"] = {
                "mean": from_si(float(np.nanmean(self.turn_after)), "deg"),
                "max": from_si(float(np.nanmax(self.turn_after)), "deg"),
                "rms": from_si(float(np.sqrt(np.nanmean(self.turn_after**2))), "deg"),
            }
        others = {name: np.sqrt(np.nanmean(r**2)) for name, r in self.others_after.items() if not np.isnan(r).all()}
        if others:
            out["after_rms_si"] = {name: float(rms) for name, rms in others.items()}
        out["kinds"] = {name: of.to_json_dict() for name, of in self.kinds.items()}
        for name, repeats in self.repeats.items():
            out["kinds"][name]["repeats"] = repeats.to_json_dict()
        if self.repeatability is not None:
            out["repeated_poses"] = self.repeatability.to_json_dict()
        if self.aligned is not None:
            out["aligned"] = self.aligned.to_json_dict()
        if self.remounted is not None:
            out["remounted"] = self.remounted.to_json_dict()
        return out


@dataclass(frozen=True, eq=False)
class Compared:
    """Predicted less measured: NaN where not measured, None where nothing of the kind was.

    Attributes:
        points: (N, 3) [m].
        lengths: (N,) measured lengths, or heights over touched planes [m].
        turns: (N,) angles between orientations [rad].
        others: (N, k) of every observation that is no part of the tool's pose, by its name [m or rad].
        numbers: (N, k, c) predicted less measured of each kind, k instruments with c numbers a reading.
    """

    points: FloatArray
    lengths: FloatArray | None
    turns: FloatArray | None
    others: dict[str, FloatArray]
    numbers: dict[Kind, FloatArray]


def compared(
    robot: Robot,
    data: Dataset,
    unknowns: Mapping[str, FloatArray] | None = None,
    threads: int = 1,
    T: FloatArray | None = None,
) -> Compared:
    """What a robot is off of all that was measured; T (N, 4, 4) its predicted poses, where they are known.

    `unknowns` are those of the observations that are known, by what they are of ("anchor 1": its place); what hangs on
    another is NaN. A trained correction counts in points and turns.
    """
    T = robot.poses(data, threads=threads) if T is None else T
    points = T[:, :3, 3] - data.points
    numbers: dict[Kind, FloatArray] = {kind_named(POINTS): points[:, np.newaxis]}
    turns = None
    if data.rotation is not None:
        turned = np.array([_turn(R, wxyz) for R, wxyz in zip(T[:, :3, :3], data.rotation, strict=True)])
        turns = np.array([float(np.linalg.norm(turn)) for turn in turned])
        numbers[kind_named("orientation")] = turned.reshape(-1, 1, 3)
    others: dict[str, FloatArray] = {}
    lengths = None
    if any(field not in ("position", "rotation") for own in data.kinds.values() for field in own):
        measured = measurements(data, robot)
        beside = [of for of in measured.observations if not of.is_pose]
        model = robot.error_model
        own = {owner: iter(values) for owner, values in (unknowns or {}).items()}
        values = [float(next(own[p.owner])) if p.owner in own else np.nan for p in measured.parameters]
        r = np.asarray(
            _core.residuals(model, robot.samples(data), measured, np.array([*model.start, *values]), threads)
        )
        for of in beside:
            part = r[:, of.first_number : of.first_number + len(of.components)]
            others[of.name] = part
            readings = part.reshape(len(part), of.reading_count, -1)
            size, kind = sizes_of(part), of_observation(of)
            before = [numbers[kind]] if kind in numbers else []
            numbers[kind] = np.concatenate([*before, readings], axis=1)
            if of.unit == "m":
                lengths = size if lengths is None else np.where(np.isnan(lengths), size, lengths)
                if len(of.components) == 1 and len(others) == 1:
                    lengths = part[:, 0]
    return Compared(points, lengths, turns, others, numbers)


def _turn(R: FloatArray, wxyz: FloatArray) -> FloatArray:
    """(3,) from a measured orientation to the predicted one [rad]."""
    if np.isnan(wxyz).any():
        return np.full(3, np.nan)
    return np.asarray(_core.log_so3(_core.quaternion_to_rotation(wxyz).T @ R))


def distances(points: FloatArray, lengths: FloatArray | None = None) -> FloatArray:
    """(N,) length of each whole point's error, or |error| of the row's length where it has no point; else NaN."""
    out = np.linalg.norm(points, axis=1)
    return out if lengths is None else np.where(np.isnan(out), np.abs(lengths), out)


def evaluate(
    robot: RobotLike,
    data: DataLike,
    *,
    before: Robot | None = None,
    unknowns: Mapping[str, FloatArray] | None = None,
    unknowns_before: Mapping[str, FloatArray] | None = None,
    threads: int = 1,
) -> Evaluation:
    """Error statistics of a model on measured data, beside those of `before` where it is given.

    Unknowns of the observations (anchors, planes, mountings) are the ones that calibration found; without these, they
    are fitted to the data. Paths are read.
    """
    robot = as_robot(robot)
    data = as_data(data, robot)
    if unknowns is None:
        unknowns = fitted_unknowns(robot, data, threads)
    return judged(robot, data, before, unknowns, unknowns_before, threads)


def judged(
    robot: Robot,
    data: Dataset,
    before: Robot | None = None,
    unknowns: Mapping[str, FloatArray] | None = None,
    unknowns_before: Mapping[str, FloatArray] | None = None,
    threads: int = 1,
    samples: _core.Samples | None = None,
) -> Evaluation:
    """`evaluate` of a robot and a data set, with the samples of both robots where they are known."""
    T = robot.poses(data, threads=threads, samples=samples)
    found = compared(robot, data, unknowns, threads, T)
    first = None
    if before is not None:
        T_before = before.poses(data, threads=threads, samples=samples)
        first = compared(before, data, unknowns_before, threads, T_before)
    kinds = table(found.numbers, None if first is None else first.numbers)
    moved = realigned(T[:, :3, 3], found.points)
    return Evaluation(
        data,
        found.points,
        found.lengths,
        found.turns,
        ErrorStatistics.of(distances(found.points)),
        None if first is None else first.points,
        None if first is None else ErrorStatistics.of(distances(first.points)),
        repeatability(data, found.points, T[:, :3, :3] if data.rotation is not None else None),
        moved,
        found.others,
        kinds,
        remounted=remounted(T[:, :3, :3], found.points) if moved is None else None,
    )


def _is_hopeless(p: FloatArray, x: FloatArray, e: FloatArray) -> bool:
    """Do distances between neighbouring rows already say that no motion of p onto x = p - e fits ALIGNED_BETTER?

    A rigid motion keeps them: |x_i - x_k| and |p_i - p_k| differ by no more than the sum of the two errors that it
    leaves, so the sum of the squared differences over separate pairs is at most twice that of the squared errors.
    """
    apart = np.linalg.norm(x[1::2] - x[:-1:2], axis=1) - np.linalg.norm(p[1::2] - p[:-1:2], axis=1)
    return float(np.vdot(e, e)) < ALIGNED_BETTER**2 * float(apart @ apart) / 2


def realigned(predicted: FloatArray, error: FloatArray) -> Realigned | None:
    """The rigid motion of predicted points (N, 3) that leaves the least of `error` (N, 3), predicted less measured [m].

    None where it would not fit ALIGNED_BETTER times better, or where too few points were measured to say so.
    """
    whole = ~np.isnan(error).any(axis=1)
    if whole.sum() < ALIGNED_ROWS:
        return None
    p, e = predicted[whole], error[whole]
    x = p - e
    if _is_hopeless(p, x, e):
        return None
    motion = best_motion(p, x)
    left = _far_less(p @ motion[:3, :3].T + motion[:3, 3] - x, e)
    return None if left is None else Realigned(motion, left)


def _far_less(left: FloatArray, given: FloatArray) -> ErrorStatistics | None:
    """Statistics of the distances left (N, 3); None where those given (N, 3) are not ALIGNED_BETTER times as large."""
    after, before = (ErrorStatistics.of(np.linalg.norm(of, axis=1)) for of in (left, given))
    return None if after is None or before is None or before.rms < ALIGNED_BETTER * after.rms else after


def remounted(turned: FloatArray, error: FloatArray) -> Remounted | None:
    """The shift of the target on tools turned by (N, 3, 3) that leaves the least of errors (N, 3), p less measured.

    None where it would not fit ALIGNED_BETTER times better, or where too few points were measured to say so.
    """
    whole = ~np.isnan(error).any(axis=1)
    if whole.sum() < ALIGNED_ROWS:
        return None
    R, e = turned[whole], error[whole]
    shift = -np.mean(np.einsum("nji,nj->ni", R, e), axis=0)  # R^T R = 1: the mean in the tool's frame is least squares
    left = _far_less(R @ shift + e, e)
    return None if left is None else Remounted(shift, left)
