# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Best fit of base and tool of the nominal arm, even if one of several kinds of reading is worthless.

The rigid fit weighs a radian like a metre: orientations that are worthless, or another kind, turn base and tool away
from good points. So where points alone fit them far better, base and tool are theirs, and the others come after.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.calibration.alignment import measurements
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.kinds import POINTS, POSE
from fastcal.measurements.observations import without_kinds
from fastcal.measurements.rotations import nearest_rotation, rotations
from fastcal.robot.identified_spec import moved
from fastcal.robot.robot import Robot

_FAR_BETTER = 0.5  # of the points' median error
_FEWEST = 12  # points that are believed against other kinds


@dataclass(frozen=True, eq=False)
class Placement:
    """Base, tool and what the observations do not know.

    Attributes:
        T_world_base, T_flange_tool: (4, 4).
        unknowns: Of the observations: anchors, planes, mountings.
        is_fitted: Did the fit converge?
    """

    T_world_base: FloatArray
    T_flange_tool: FloatArray
    unknowns: FloatArray
    is_fitted: bool = True

    @staticmethod
    def of(found: _core.Alignment) -> Placement:
        """The rigid fit."""
        return Placement(np.asarray(found.T_world_base), np.asarray(found.T_flange_tool), np.asarray(found.unknowns))


def by_points(robot: Robot, data: Dataset, of_all: Placement, threads: int = 1) -> Placement:
    """The rigid fit of all kinds, or that of the points alone where this fits them far better."""
    others = set(data.kinds) - {POINTS}
    if data.position is None or not others:
        return of_all
    whole = ~np.isnan(data.position).any(axis=1)
    if whole.sum() < _FEWEST:
        return of_all
    points = without_kinds(data, others)
    found = _core.align(robot.error_model, robot.samples(points), measurements(points, robot), threads)
    if not found.found:
        return of_all
    alone = Placement.of(found)
    error = [
        float(np.median(np.linalg.norm(arm.poses(data, threads=threads)[whole, :3, 3] - data.position[whole], axis=1)))
        for arm in (moved(robot, place.T_world_base, place.T_flange_tool) for place in (alone, of_all))
    ]
    if not error[0] < _FAR_BETTER * error[1]:
        return of_all
    T_tool = alone.T_flange_tool.copy()
    there = moved(robot, alone.T_world_base, T_tool)
    if data.rotation is not None:
        T_tool[:3, :3] = T_tool[:3, :3] @ _mean_turn(there.poses(data, threads=threads)[:, :3, :3], data.rotation)
        there = moved(robot, alone.T_world_base, T_tool)
    beside = without_kinds(data, set(data.kinds) & set(POSE))
    unknowns = np.zeros(0)
    if beside.kinds:
        of_others = _core.align(there.error_model, there.samples(beside), measurements(beside, there), threads)
        unknowns = np.asarray(of_others.unknowns) if of_others.found else of_all.unknowns
    return Placement(alone.T_world_base, T_tool, unknowns)


def _mean_turn(predicted: FloatArray, measured: FloatArray) -> FloatArray:
    """(3, 3) the turn about the tool's axes that brings predicted rotations (N, 3, 3) nearest to quaternions (N, 4)."""
    known = ~np.isnan(measured).any(axis=1)
    return nearest_rotation(np.einsum("nji,njk->ik", predicted[known], rotations(measured[known])))
