# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The arm that carries cameras and boards, and alternative interpretations of its rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from fastcal import _core
from fastcal.calibration.hand_eye import FEWEST, disagreement, length_ratio, with_lengths
from fastcal.calibration.moving_rig import frames_of
from fastcal.calibration.picture_readings import BETTER, SLIPS, Arm
from fastcal.measurements.dataset import Dataset
from fastcal.place import joint_name
from fastcal.robot.robot import Robot
from fastcal.units import factor, from_si

FloatArray = NDArray[np.float64]

_QUARTERS = (np.pi / 2, -np.pi / 2, np.pi)  # [rad] by which zeros of joints are counted from elsewhere
FAR_POSES = 0.03  # [m, rad] by which poses of no arm and camera disagree
_FEWEST = 3  # joints of a chain that has more frames than its flange


def arm_of(robot: Robot, data: Dataset) -> Arm:
    """The arm of a robot file in the rows of the data."""
    spec = robot.description
    ends = [entry["on"] for entry in (*spec.cameras.values(), *spec.boards.values())]
    name = next((on.partition(".")[0] for on in ends if on != "world"), "arm")
    links = [f"{name}.link{k}" for k in range(robot.core.joint_count - 1, 1, -1)]
    frames = [name] if robot.of_poses or len(links) < _FEWEST else [name, *links]
    otherwise = _poses_otherwise if robot.of_poses else _joints_otherwise
    return Arm(frames, partial(frames_of, robot, data.q), partial(otherwise, robot, data.q))


def _joints_otherwise(robot: Robot, q: FloatArray) -> Iterator[tuple[str, Callable[[str], FloatArray]]]:
    """Joint positions of another unit, sign, order or zero."""
    turning = np.array([kind == "revolute" for kind in robot.joint_types])
    degree = factor("deg")
    for words, times in (("in radians, read as degrees", 1 / degree), ("in degrees, read as radians", degree)):
        yield f"are the joint positions {words}?", partial(frames_of, robot, np.where(turning, q * times, q))
    for i in range(q.shape[1]):
        turned = q.copy()
        turned[:, i] *= -1
        yield f"does {joint_name(i)} count the other way round?", partial(frames_of, robot, turned)
    for i, j in combinations(range(q.shape[1]), 2):
        order = np.arange(q.shape[1])
        order[[i, j]] = j, i
        words = f"are the columns of {joint_name(i)} and {joint_name(j)} exchanged?"
        yield words, partial(frames_of, robot, np.ascontiguousarray(q[:, order]))
    for i in np.flatnonzero(turning).tolist():
        for quarter in _QUARTERS:
            zero = np.zeros(q.shape[1])
            zero[i] = quarter
            words = f"is the zero of {joint_name(i)} {-from_si(quarter, 'deg'):.0f} degrees away, as others count?"
            yield words, partial(frames_of, robot, q + zero)


def _poses_otherwise(robot: Robot, q: FloatArray) -> Iterator[tuple[str, Callable[[str], FloatArray]]]:
    """Poses of the flange that are inverse, or whose quaternions have another order."""
    frames = partial(frames_of, robot, q)
    for words, changed in OTHER_POSES:
        yield f"{words.format('the poses of the arm')}?", partial(_changed, frames, changed)


def _changed(frames: Callable[[str], FloatArray], changed: Callable[[FloatArray], FloatArray], on: str) -> FloatArray:
    return frames(on) if on == "world" else changed(frames(on))


def _kept(T: FloatArray) -> FloatArray:
    return T


def _inverse(T: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.inv(T), dtype=np.float64)


def _reordered(order: list[int], T: FloatArray) -> FloatArray:
    """Poses (N, 4, 4) whose quaternions w x y z are those of T in another order."""
    out = T.copy()
    for k, R in enumerate(T[:, :3, :3]):
        out[k, :3, :3] = _core.quaternion_to_rotation(_wxyz(R)[order])
    return out


def _wxyz(R: FloatArray) -> FloatArray:
    turn = np.asarray(_core.log_so3(np.ascontiguousarray(R)))
    angle = float(np.linalg.norm(turn))
    return np.array([np.cos(angle / 2), *(np.sinc(angle / (2 * np.pi)) / 2 * turn)])


# What poses may be beside what they were read as; "{}" is whose they are.
OTHER_POSES: tuple[tuple[str, Callable[[FloatArray], FloatArray]], ...] = (
    ("are {} inverse", _inverse),
    ("are the quaternions of {} x y z w, read as w x y z", partial(_reordered, [3, 0, 1, 2])),
    ("are the quaternions of {} w x y z, read as x y z w", partial(_reordered, [1, 2, 3, 0])),
)


def meant_by_poses(arm: FloatArray, S: FloatArray, *, in_room: bool = False) -> str | None:
    """What was meant where poses A, S (N, 4, 4) are far from A X S = Y: their order, unit or rows; None: nothing fits.

    Args:
        arm: Of the arm.
        S: Of the board, as the camera saw it.
        in_room: The camera stands in the room: A are the inverse poses of the arm.
    """
    turned = _inverse if in_room else _kept
    A = turned(arm)
    as_given = disagreement(A, S)
    if as_given < FAR_POSES:
        return None
    tried = [
        (words.format(whose), turned(arm_changed(arm)), board_changed(S))
        for words, changed in OTHER_POSES
        for whose, arm_changed, board_changed in (
            ("the arm's poses", changed, _kept),
            ("the board's poses", _kept, changed),
            ("both", changed, changed),
        )
    ]
    for slip in SLIPS[1:]:
        rows = np.arange(max(slip, 0), len(A) + min(slip, 0))
        if len(rows) > FEWEST:
            tried.append((f"are the board's poses shifted by {slip} rows", A[rows - slip], S[rows]))
    if (ratio := length_ratio(A, S)) is not None:
        words = f"are the board's lengths {1 / ratio:.4g} times those of the arm, one in another unit"
        tried.append((words, A, with_lengths(S, ratio)))
    found = [(disagreement(*poses), words) for words, *poses in tried]
    least, words = min(found)
    return f"{words}?" if least * BETTER < as_given else None
