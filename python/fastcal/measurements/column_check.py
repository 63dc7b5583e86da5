# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Finds columns that were meant otherwise: a wrong unit, joints swapped or turned, another convention of orientation.

The nominal robot, laid onto the data by the best rigid base and tool, misses them by its own errors. Every single other
reading of the columns is tried. One that explains the data at least five times better is what was probably meant; it is
given with both figures, and nothing is changed. Points are judged first; orientations where the points fit.

Readings of points are compared by RMS misfit / RMS spread of the points, which units of length leave as it is, so that
shrinking the points explains nothing; a ratio above 1 counts as 1, for the mean of the points does as well. Bounds that
cost little (`_least_misfits`) leave few readings to be fitted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fastcal.measurements import orientation_readings as orientation
from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.column_readings import Reading, other_readings
from fastcal.measurements.dataset import Dataset
from fastcal.units import from_si

FloatArray = NDArray[np.float64]
Misfit = Callable[[FloatArray, FloatArray], float]
Poses = Callable[[FloatArray], FloatArray]

NEGLIGIBLE_SHARE = 1e-4  # of the reach; what misses by less has been read as it was meant
NEGLIGIBLE_TURN = 3e-3  # [rad] the same for orientations
BETTER_BY = 5.0
SIMILAR = 1.5  # readings this close to the best one can't be distinguished from it
SCALE_BAND = 2.0  # a unit slip is fitted where the points are this near to its ratio
FEWEST_ROWS = 8  # base and tool alone adapt to 9 numbers, three rows
MOST_ROWS = 60


@dataclass(frozen=True)
class Suspicion:
    """What the columns were probably meant to be.

    Attributes:
        meant: The reading that explains the data.
        others: Further readings that explain them about as well.
        read: RMS misfit between nominal robot and data as read, with its unit in words.
        better: The same with the columns as they were probably meant.
        reach: The robot's reach [m].
        what: What was held against the robot: points or orientations.
    """

    meant: str
    others: tuple[str, ...]
    read: str
    better: str
    reach: float
    what: str = "points"

    @property
    def message(self) -> str:
        """The suspicion and its evidence in one sentence."""
        reach = f", with a reach of {from_si(self.reach, 'mm'):.4g} mm" if self.what == "points" else ""
        either = f" (or: {'; '.join(self.others)})" if self.others else ""
        return (
            f"the {self.what} do not fit this robot: as read, it misses them by {self.read} RMS after the best fit of "
            f"base and tool{reach}; with {self.meant} it would be {self.better}{either}; nothing was changed"
        )


def plausible(dataset: Dataset, robot: RobotFacts, misfit: Misfit, poses: Poses) -> Suspicion | None:
    """Holds measurements against the nominal robot; None where they fit it, or where no other reading fits better.

    Args:
        dataset: Up to 60 of its rows with a whole point, or else with an orientation, are looked at.
        robot: The nominal arm's joint types and reach.
        misfit: RMS distance [m] between the nominal robot at q (N, n) and points (N, 3) after the best rigid fit of
            base and tool.
        poses: Poses (N, 4, 4) of the nominal robot at q (N, n), in any base and with any tool.
    """
    return _points(dataset, robot, misfit, poses) or _orientations(dataset, robot, poses)


def _points(dataset: Dataset, robot: RobotFacts, misfit: Misfit, poses: Poses) -> Suspicion | None:
    if dataset.position is None or (rows := _chosen(dataset.position)) is None:
        return None
    q, position = dataset.q[rows], dataset.position[rows]
    as_read = misfit(q, position)
    if as_read <= NEGLIGIBLE_SHARE * robot.reach:
        return None
    to_beat = min(1.0, as_read / _spread(position)) / BETTER_BY
    scale = _scale(poses(q), position)
    readings = [each for each in other_readings(dataset, rows, list(robot.joint_types)) if len(each.q) >= FEWEST_ROWS]
    found = []
    for reading in _worth_fitting(readings, scale, to_beat, poses):
        rms = misfit(reading.q, reading.position)
        found.append((reading.rank, rms / _spread(reading.position), rms, reading.words))
    return _best(found, to_beat, robot, lambda rms: f"{from_si(rms, 'mm'):.4g} mm", as_read, "points")


def _worth_fitting(readings: list[Reading], scale: float, to_beat: float, poses: Poses) -> list[Reading]:
    """Those of which bounds leave it possible that they beat, or are similar to, one that beats what is read.

    `scale` is that of the points as read: a slip of the unit shows in it, and the bound can't see it.
    """
    worth = [each for each in readings if each.scale != 1.0 and _may_have_scale(each, scale)]
    unscaled = [each for each in readings if each.scale == 1.0]
    for count in sorted({len(each.q) for each in unscaled}):  # all of one length at once
        alike = [each for each in unscaled if len(each.q) == count]
        T = poses(np.concatenate([each.q for each in alike])).reshape(len(alike), count, 4, 4)
        least = _least_misfits(T, np.stack([each.position for each in alike]))
        worth += [
            each for each, bound in zip(alike, least, strict=True) if bound < SIMILAR * to_beat * _spread(each.position)
        ]
    return worth


def _may_have_scale(reading: Reading, scale: float) -> bool:
    if reading.scale < 0.0:
        return scale <= 0.0 or abs(scale) < 1.0 / SCALE_BAND
    return not SCALE_BAND**-1 < abs(scale) < SCALE_BAND


def _least_misfits(T: FloatArray, position: FloatArray) -> FloatArray:
    """(S,) bounds [m] that the misfits of S readings are not below, of poses (S, N, 4, 4) and points (S, N, 3)."""
    system, origin = _linear_in_frames(T, position)
    Q = np.linalg.qr(system)[0]
    left = origin - (Q @ (Q.transpose(0, 2, 1) @ origin[..., np.newaxis]))[..., 0]
    return np.asarray(np.sqrt(np.sum(left**2, axis=1) / T.shape[1]))


def _scale(T: FloatArray, position: FloatArray) -> float:
    """How many times larger the arm (N, 4, 4) is than the points (N, 3); negative where these are mirrored."""
    system, origin = _linear_in_frames(T[np.newaxis], position[np.newaxis])
    solution = np.linalg.lstsq(system[0], origin[0], rcond=None)[0]
    volume = float(np.linalg.det(solution[:9].reshape(3, 3)))
    return float(np.sign(volume) * np.abs(volume) ** (1 / 3))


def _linear_in_frames(T: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Equations (S, 3 N, 15) and right sides (S, 3 N) of a base that may be any matrix G (3, 3), and a tool.

    p = A (t + R x) + b is t = G p - c - R x with G = A'; any G in place of a rotation makes it linear in G, c and x.
    """
    S, N = T.shape[:2]
    system = np.zeros((S, N, 3, 15))
    for axis in range(3):
        system[:, :, axis, 3 * axis : 3 * axis + 3] = position - position.mean(axis=1, keepdims=True)
        system[:, :, axis, 9 + axis] = 1.0
    system[..., 12:] = T[..., :3, :3]
    return system.reshape(S, 3 * N, 15), np.ascontiguousarray(T[..., :3, 3]).reshape(S, 3 * N)


def _orientations(dataset: Dataset, robot: RobotFacts, poses: Poses) -> Suspicion | None:
    if dataset.rotation is None or (rows := _chosen(dataset.rotation)) is None:
        return None
    R = poses(dataset.q[rows])[:, :3, :3]
    measured = orientation.of_quaternion(dataset.rotation[rows])
    as_read = orientation.misfit(R, measured)
    if as_read <= NEGLIGIBLE_TURN:
        return None
    readings = [(rank, words, R, M) for rank, words, M in _orientation_readings(dataset, rows)]
    readings += [
        (each.rank, each.words, poses(each.q)[:, :3, :3], orientation.of_quaternion(dataset.rotation[each.rows]))
        for each in other_readings(dataset.without_points(), rows, list(robot.joint_types))
    ]
    to_beat = as_read / BETTER_BY
    found = []
    for rank, words, mine, theirs in readings:
        if len(theirs) >= FEWEST_ROWS and orientation.least_misfit(mine, theirs) < SIMILAR * to_beat:
            rms = orientation.misfit(mine, theirs)
            found.append((rank, rms, rms, words))
    return _best(found, to_beat, robot, lambda rms: f"{from_si(rms, 'deg'):.4g} deg", as_read, "orientations")


def _orientation_readings(dataset: Dataset, rows: NDArray[np.int64]) -> list[tuple[int, str, FloatArray]]:
    if dataset.rotation is None:
        return []
    if dataset.rotation_angles is not None:
        return list(orientation.angle_readings(dataset.rotation_angles[rows]))
    return list(orientation.quaternion_readings(dataset.rotation[rows]))


def _best(
    found: list[tuple[int, float, float, str]],
    to_beat: float,
    robot: RobotFacts,
    text: Callable[[float], str],
    as_read: float,
    what: str,
) -> Suspicion | None:
    """The best of (rank, share, misfit, words), where its share beats `to_beat`, with the simplest of those like it."""
    best = min((share for _, share, _, _ in found), default=np.inf)
    if not best < to_beat:
        return None
    # Where base or tool take up a shift of a joint, its sign turned and any shift do as well as the sign alone.
    (simplest, _, meant_rms, meant), *rest = sorted(entry for entry in found if entry[1] <= SIMILAR * best)
    others = tuple(words for rank, _, _, words in rest if rank == simplest)
    return Suspicion(meant, others, text(as_read), text(meant_rms), robot.reach, what)


def _chosen(values: FloatArray) -> NDArray[np.int64] | None:
    """Up to 60 rows that are whole; None where there are too few to judge by."""
    rows = np.flatnonzero(~np.isnan(values).any(axis=1))
    if len(rows) < FEWEST_ROWS:
        return None
    # Scattered and not at equal steps, which may fall in with the steps of a grid.
    return np.random.default_rng(0).permutation(rows)[:MOST_ROWS]


def _spread(position: FloatArray) -> float:
    """RMS distance of points (N, 3) from their mean [m]."""
    distances = np.linalg.norm(position - position.mean(axis=0), axis=1)
    return max(float(np.sqrt(np.mean(distances**2))), np.finfo(np.float64).tiny)
