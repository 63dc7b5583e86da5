# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Tool poses predicted by a model, and their uncertainty."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.display.shown import Shown
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.rotations import quaternions, rotations
from fastcal.robot.given import DataLike, RobotLike, as_data, as_robot
from fastcal.robot.robot import Robot
from fastcal.robot.se3 import rotations_by
from fastcal.units import from_si


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Shown):
    """Poses of the tool in the measuring frame.

    Attributes:
        position: (N, 3) [m].
        rotation: (N, 4) unit quaternion w, x, y, z, w at least 0.
        sigma_position: (N, 3) standard deviation that comes from the identified parameters alone [m]; NaN for a robot
            that was not calibrated. A new measurement adds its own noise.
        correction_weight: (N,) share of the trained correction that the guard lets pass: 1 inside the trained joints
            and loads, 0 far from them; None for a model without one. With a correction, `sigma_position` also holds
            how far measured points lay from corrected ones on held-out rows, their noise included.
        sigma_rotation: (N, 3) likewise of the turn, along the axes of the measuring frame [rad]; None without a
            correction that was trained on orientations.
        notes: What a reader should know, a sentence each.
    """

    position: FloatArray
    rotation: FloatArray
    sigma_position: FloatArray
    correction_weight: FloatArray | None = None
    sigma_rotation: FloatArray | None = None
    notes: tuple[str, ...] = ()

    def columns(self) -> dict[str, FloatArray]:
        """Of a table of all poses: x_mm, qw ..., and as far as they are known the deviations and the weight."""
        out = dict(zip(("x_mm", "y_mm", "z_mm"), from_si(self.position, "mm").T, strict=True))
        out |= zip(("qw", "qx", "qy", "qz"), self.rotation.T, strict=True)
        out |= zip(("sigma_x_mm", "sigma_y_mm", "sigma_z_mm"), from_si(self.sigma_position, "mm").T, strict=True)
        if self.sigma_rotation is not None:
            turning = from_si(self.sigma_rotation, "deg").T
            out |= zip(("sigma_rx_deg", "sigma_ry_deg", "sigma_rz_deg"), turning, strict=True)
        if self.correction_weight is not None:
            out["correction_weight"] = self.correction_weight
        return out


def predict(robot: RobotLike, data: DataLike, *, threads: int = 1) -> Prediction:
    """The tool's pose in every row of `data`, of which only q and the conditions are read. Paths are read."""
    robot = as_robot(robot)
    data = as_data(data, robot, require_measured=False)
    T = robot.poses(data, threads=threads)
    deviation = robot.deviation_at(robot.samples(data), threads)
    notes = (*range_notes(robot, data), *correction_notes(robot, data))
    weight = turning = None
    if robot.correction is not None:
        corrected = robot.correct(data.q, data.payload)
        weight = corrected.weight
        deviation = np.hypot(np.nan_to_num(deviation), corrected.sigma)
        turning = None if np.isnan(corrected.sigma_turn).any() else corrected.sigma_turn
    return Prediction(T[:, :3, 3].copy(), quaternions(T[:, :3, :3]), deviation, weight, turning, notes)


def correction_notes(robot: Robot, data: Dataset) -> list[str]:
    """A sentence where the trained correction is held back in some row; none otherwise."""
    if robot.correction is None:
        return []
    weight = robot.correct(data.q, data.payload).weight
    partly, off = int(np.sum(weight < 1)), int(np.sum(weight == 0))
    if not partly:
        return []
    return [
        f"{partly} of {len(data)} rows lie outside the joints and loads that the correction was trained on: there it "
        f"fades, in {off} of them to zero"
    ]


def without_correction(robot: Robot, data: Dataset) -> Dataset:
    """The measured poses as they would be without what a trained correction moves and turns."""
    if robot.correction is None:
        return data
    said = robot.correct(data.q, data.payload)
    position = None if data.position is None else data.position - said.displacement
    rotation = None if data.rotation is None else data.rotation.copy()
    if rotation is not None:
        seen = np.isfinite(rotation).all(axis=1)
        rotation[seen] = quaternions(rotations_by(-said.turn[seen]) @ rotations(rotation[seen]))
    return replace(data, position=position, rotation=rotation)
