# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Are measured orientations those of the arm? Conventions, joints and frames that were meant otherwise.

Where points show how the base stands, orientations are held against that base: turned about another one, a conjugated
quaternion or a frame of its own could pass.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.measurements import orientation_readings as orientation
from fastcal.measurements.column_check import (
    BETTER_BY,
    NEGLIGIBLE_SHARE,
    SIMILAR,
    Found,
    Points,
    Suspicion,
    best,
    chosen_rows,
    in_deg,
    one_map,
)
from fastcal.measurements.column_readings import Reading
from fastcal.measurements.frame_fit import turn_bounds
from fastcal.measurements.joint_maps import Change, JointMap, JointMaps
from fastcal.units import from_si, to_si

NEGLIGIBLE_TURN = 3e-3  # [rad] what misses by less has been read as it was meant
SEVERAL_TURN = 0.05  # [rad] what misses by more is read with several things changed as well
FITS_TURN = to_si(5.0, "deg")  # a reading that leaves more explains nothing
_BASE_KNOWN = to_si(1.0, "deg")  # to which points must show how the base stands
_FITTED = 24
_AT_ONCE = 512


class Turns:
    """The orientations of a data set beside the nominal arm, whose points fit or were not measured."""

    def __init__(self, points: Points) -> None:
        self.points, self.data = points, points.dataset
        rows = None if self.data.rotation is None else chosen_rows(self.data.rotation, self.data.q)
        self.rows = np.zeros(0, dtype=np.int64) if rows is None else rows
        self.base = _base_of(points)

    def suspicion(self) -> Suspicion | None:
        """What was probably meant, where it is another reading."""
        if self.data.rotation is None or not len(self.rows):
            return None
        measured = orientation.of_quaternion(self.data.rotation[self.rows])
        R = self._arm(one_map(self.points.joints.as_read))[0]
        as_read = next(self._fitted([], R, measured)).misfit
        if as_read <= NEGLIGIBLE_TURN:
            return None
        to_beat = as_read / BETTER_BY
        found = [*self._conventions(R, to_beat), *self._other_joints(measured, as_read)]
        found += self._fitted([], R, measured)
        if as_read > SEVERAL_TURN and not any(each.share < to_beat for each in found):
            found += self._both(to_beat)
        found = [each for each in found if each.misfit < FITS_TURN]
        reach = self.points.robot.reach
        return best(found, to_beat, in_deg, as_read, reach, "orientations")

    def _arm(self, maps: JointMaps) -> FloatArray:
        """(S, N, 3, 3) orientations of the nominal arm by each reading of the joints."""
        there = maps.read(self.data.q[self.rows])
        T = self.points.poses(there.reshape(-1, there.shape[2]))
        return np.asarray(T[:, :3, :3].reshape(*there.shape[:2], 3, 3))

    def _written(self) -> list[tuple[Change, FloatArray]]:
        """Every other way to read the columns of the orientation."""
        if self.data.rotation is None:
            return []
        if self.data.rotation_angles is not None:
            found = orientation.angle_readings(self.data.rotation_angles[self.rows])
        else:
            found = orientation.quaternion_readings(self.data.rotation[self.rows])
        return [(Change(1.0 + rank, frozenset({("orientation", words)}), words), M) for rank, words, M in found]

    def _conventions(self, R: FloatArray, to_beat: float) -> Iterator[Found]:
        written = self._written()
        if not written:
            return
        readings = np.stack([M for _, M in written])
        bounds = turn_bounds(np.broadcast_to(R, readings.shape), readings)
        for k in np.flatnonzero(bounds < SIMILAR * to_beat).tolist():
            yield from self._fitted([written[k][0]], R, readings[k])

    def _other_joints(self, measured: FloatArray, as_read: float) -> Iterator[Found]:
        joints = self.points.joints
        maps = joints.simple if as_read <= SEVERAL_TURN else joints.several if self.base is None else joints.pairs
        bounds = np.concatenate([turn_bounds(self._arm(some), measured) for some in maps.parts(_AT_ONCE)])
        for k in np.argsort(bounds, kind="stable")[:_FITTED].tolist():
            if bounds[k] < SIMILAR * as_read / BETTER_BY and self._points_allow(maps[k]):
                write = tuple(joints.formulas(maps[k]))
                yield from self._fitted(joints.changes(maps[k]), self._arm(one_map(maps[k]))[0], measured, write)

    def _points_allow(self, joints: JointMap) -> bool:
        """Do the points fit as well with the joints read so?"""
        as_read = self.points.as_read
        if as_read is None:
            return True
        allowed = max(SIMILAR * as_read.rms, NEGLIGIBLE_SHARE * self.points.robot.reach)
        return self.points.frames(Reading(self.points.sources[0], joints)).rms <= allowed

    def _fitted(
        self, changes: list[Change], R: FloatArray, measured: FloatArray, write: tuple[str, ...] = ()
    ) -> Iterator[Found]:
        """A reading in the frame of the points, which is nearly known, and where it does not fit in one of its own."""
        A, _ = orientation.placed(R, measured)
        rms = orientation.misfit(R, measured)
        turn = 0.0 if self.base is None else orientation.angle(A @ self.base.T)
        if turn > FITS_TURN:
            fixed = orientation.misfit(R, measured, self.base)
            yield Found(changes, fixed, fixed, write)
            size = from_si(turn, "deg")
            words = f"the orientations in a frame of their own (turned by {size:.3g} deg from the points')"
            changes = [*changes, Change(1.5, frozenset({("frame",)}), words)]
        yield Found(changes, rms, rms, write)

    def _both(self, to_beat: float) -> Iterator[Found]:
        """Joints and orientations read otherwise."""
        maps, written = self.points.joints.simple, self._written()
        R = self._arm(maps)
        bounds = np.stack([turn_bounds(R, M) for _, M in written], axis=1).reshape(-1)
        for index in np.argsort(bounds, kind="stable")[:_FITTED].tolist():
            k, m = divmod(index, len(written))
            if bounds[index] < SIMILAR * to_beat and self._points_allow(maps[k]):
                joints = self.points.joints
                changes = [*joints.changes(maps[k]), written[m][0]]
                yield from self._fitted(changes, R[k], written[m][1], tuple(joints.formulas(maps[k])))


def _base_of(points: Points) -> FloatArray | None:
    """How the base stands, where points show it; their misfit beside the two greater extents of the points."""
    frames = points.as_read
    if frames is None:
        return None
    position = points.sources[0].position[frames.agree]
    extent = np.linalg.svd(position - position.mean(axis=0), compute_uv=False)[1] / np.sqrt(len(position))
    return frames.A if frames.rms < _BASE_KNOWN * float(extent) else None
