# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A calibrated model before instruments that were set up again: the base of each station fitted, all else as it is.

A set-up's motion: measured = motion * predicted in closed form (W. Kabsch 1976), over its rows with a whole point. What
has no points has the base, as far as it shows, and anchors, planes and mountings by a fit; the arm and its tool stay.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IndexArray
from fastcal.calibration.alignment import measurements
from fastcal.calibration.evaluation import Compared, compared
from fastcal.calibration.kind_errors import KindErrors, table
from fastcal.calibration.prediction import without_correction
from fastcal.calibration.unknowns import placed, unknowns_by_owner
from fastcal.effects.entries import traits_of
from fastcal.errors import Undetermined
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import Kind
from fastcal.measurements.rotations import best_motion
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import frame_spec
from fastcal.robot.se3 import inverse

FEWEST_POINTS = 3
_FLAT = 1e-3  # width of the points across their longest extent, as a share of it: below, they lie on a line
_ROUNDS = 2  # loads in a levelled measuring frame and a trained correction turn with the base


@dataclass(frozen=True, eq=False)
class SetUp:
    """One place of the instrument.

    Attributes:
        name: The station's label; "" where there is one set-up.
        rows: (k,) its rows of the data.
        motion: (4, 4) from where the model has the base to where it is now, in the measuring frame.
        robot: The model with its base there.
        data: Its rows; a trained correction's displacement is taken off the points.
        error: (k, 3) measured less predicted point [m], NaN where not measured.
        unknowns: Of the observations: anchors, planes, mountings.
        compared: Predicted less measured of everything.
    """

    name: str
    rows: IndexArray
    motion: FloatArray
    robot: Robot
    data: Dataset
    error: FloatArray
    unknowns: FloatArray
    compared: Compared

    def to_json_dict(self) -> dict[str, list[float]]:
        """{xyz_mm, rpy_deg} of the motion."""
        return frame_spec(self.motion)


def bare_arm(model: Robot, data: Dataset) -> tuple[Robot, list[str]]:
    """The model without what belongs to the set-ups that it was calibrated with, and notes.

    Offsets of stations, drifts of the base and errors of the instrument are not the arm's. Shifts of mounts stay where
    all labels of the data are known.
    """
    notes, kept = [], []
    mounts = set(data.mount_names)
    for entry in model.entries:
        traits = traits_of(entry["effect"])
        labels = [str(label) for label in entry.get(traits.labels, [])] if traits.place == "tool" else []
        if not traits.of_the_measurement or (mounts and mounts <= set(labels)):
            kept.append(entry)
        elif labels:
            notes.append(f"the target is taken to be that of mount {labels[0]}")
    return model.with_(effects=kept), notes


def set_ups(model: Robot, data: Dataset, *, threads: int = 1) -> list[SetUp]:
    """The base of each station of the data, fitted to its points.

    Raises:
        InvalidInput: Nothing was measured.
        Undetermined: The points of a station are too few, or lie on a line; too few lengths, touches or tilts.
    """
    if data.station is None:
        return [_set_up(model, data, "", np.arange(len(data)), threads)]
    return [
        _set_up(model, data, name, np.flatnonzero(data.station == code), threads)
        for code, name in enumerate(data.station_names)
        if (data.station == code).any()
    ]


def _set_up(model: Robot, data: Dataset, name: str, rows: IndexArray, threads: int) -> SetUp:
    part = replace(data.select(rows), station=None, station_names=())
    where = f"{data.source}, station {name}" if name else data.source
    measured = measurements(part, model)
    if part.position is None:
        robot, unknowns = _placed(model, part, measured, where, threads)
        motion = robot.T_world_base @ inverse(model.T_world_base)
        found = compared(robot, part, unknowns_by_owner(measured, unknowns), threads)
        return SetUp(name, rows, motion, robot, part, -found.points, unknowns, found)
    robot, motion = model, np.eye(4)
    for _ in range(_ROUNDS):
        predicted = robot.poses(part, threads=threads)[:, :3, 3]
        step = rigid(predicted, np.asarray(part.position), where)
        motion = step @ motion
        robot = with_base(robot, step @ robot.T_world_base)
    bare = without_correction(robot, part)
    unknowns = np.zeros(0)
    if measured.parameters:
        unknowns = placed(robot, part, measured, with_base=False, where=where, threads=threads)[1]
    found = compared(robot, part, unknowns_by_owner(measured, unknowns), threads)
    return SetUp(name, rows, motion, robot, bare, -found.points, unknowns, found)


def _placed(
    model: Robot, data: Dataset, measured: _core.Measurements, where: str, threads: int
) -> tuple[Robot, FloatArray]:
    """The robot with the base that readings without points show, and the observations' unknowns."""
    if data.rotation is not None:
        aligned = _core.align(model.error_model, model.samples(data), measured, threads)
        if not aligned.found:
            raise Undetermined(f"{where}: {aligned.message}")
        T = model.T_world_base
        T[:3, :3] = np.asarray(aligned.T_world_base)[:3, :3]  # where it stands, orientations do not say
        model = with_base(model, T)
    T, unknowns = placed(model, data, measured, with_base=measured.shows_base, where=where, threads=threads)
    return (with_base(model, T) if measured.shows_base else model), unknowns


def with_base(robot: Robot, T_world_base: FloatArray) -> Robot:
    """The robot with another base."""
    return robot.with_(base=frame_spec(T_world_base))


def rigid(p: FloatArray, x: FloatArray, where: str) -> FloatArray:
    """The motion (4, 4) of points p (N, 3) that comes nearest to x (N, 3), by the rows in which all of x was measured.

    Raises:
        Undetermined: Fewer than three such rows, or points on a line.
    """
    whole = ~np.isnan(x).any(axis=1)
    count = int(whole.sum())
    if count < FEWEST_POINTS:
        raise Undetermined(
            f"{where}: {count} whole points fix no base; expected at least {FEWEST_POINTS}, better eight"
        )
    p, x = p[whole], x[whole]
    width = np.linalg.svd(p - p.mean(axis=0), compute_uv=False)
    if not width[1] > _FLAT * width[0]:
        raise Undetermined(f"{where}: the points lie on a line and fix no base; measure poses around it")
    return best_motion(p, x)


def kind_errors(places: list[SetUp]) -> dict[str, KindErrors]:
    """What all rows are off of the model, by kind of reading."""
    count = sum(len(place.rows) for place in places)
    numbers: dict[Kind, FloatArray] = {}
    for place in places:
        for kind, own in place.compared.numbers.items():
            all_rows = numbers.setdefault(kind, np.full((count, *own.shape[1:]), np.nan))
            all_rows[place.rows] = own
    return table(numbers, None)
