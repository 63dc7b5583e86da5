# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Simulated measurements: poses, a true arm that deviates from the nominal one, noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal import _core
from fastcal.calibration.motor_currents import motor_currents
from fastcal.calibration.other_readings import other_readings, touching
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.observations import kinds_of
from fastcal.measurements.rotations import quaternions
from fastcal.robot.core_model import pose
from fastcal.robot.loops import closed_within
from fastcal.robot.robot import Robot, Spec
from fastcal.robot.robot_spec import content, frame_spec
from fastcal.robot.se3 import pose_of_six
from fastcal.units import from_si

FloatArray = NDArray[np.float64]

_FEWEST_HITS = 1e-4  # of random postures that must lie in the region, or it is as good as out of reach


def simulate(
    robot: Robot,
    poses: ArrayLike | Dataset,
    *,
    noise: float = 0.0,
    noise_rotation: float | None = None,
    repeatability: ArrayLike = 0.0,
    seed: int = 0,
    unknowns: Mapping[str, ArrayLike] | None = None,
    points: bool = True,
    torque_per_ampere: ArrayLike | None = None,
    friction: ArrayLike = 0.0,
    threads: int = 1,
    **conditions: ArrayLike,
) -> Dataset:
    """Measures a robot: point = p(q + e) + n, e ~ N(0, repeatability^2), n ~ N(0, noise^2); its effects are in p.

    Args:
        robot: The arm as it is, with its effects.
        poses: Commanded joint positions (N, n) [rad or m], or a data set whose conditions count and whose measured
            columns are replaced.
        noise: Standard deviation of each measured coordinate [m].
        noise_rotation: Of the measured orientation about each axis [rad]; None: no orientation is measured.
        repeatability: Standard deviation of each joint about where it is sent, one number or (n,) [rad or m].
        seed: The same seed gives the same numbers.
        unknowns: Of other observations that `poses` has columns of, by what they are of: the mounting of "level on
            link2", the plane of "plane top"; 0 where not given. Their numbers are replaced by what the instrument would
            read, with noise of their sigma column; postures that touch a plane are moved onto it.
        points: Measure points; without them only what `poses` has columns of.
        torque_per_ampere: Measure the motors' currents too: see `motor_currents`.
        friction: Of the joints, which currents carry: likewise.
        threads: Cores to use; the result does not depend on it.
        **conditions: payload [kg] and other fields of a `Dataset`, where `poses` is an array.

    Returns:
        The poses with what an instrument would have read; q is as commanded.

    Raises:
        InvalidInput: A shape or a number is invalid, or the closed loops of a row do not close.
    """
    if isinstance(poses, Dataset):
        if conditions:
            raise InvalidInput(f"conditions are in the data set already, got also {', '.join(conditions)}")
        sent = poses
    else:
        given: dict[str, Any] = dict(conditions)
        sent = Dataset.from_arrays(poses, robot=robot, source="simulated", **given)
    spread = _deviations(robot, noise, noise_rotation, repeatability)

    random = np.random.default_rng(seed)
    sent = touching(robot, sent, unknowns or {}, threads)
    shape = sent.q.shape
    reached = replace(sent, q=sent.q + spread * random.standard_normal(shape))
    if robot.passive:
        reached = replace(reached, q=_closed(robot, reached.q, threads))
    T = robot.poses(reached, threads=threads)
    position = T[:, :3, 3] + noise * random.standard_normal((len(sent), 3))
    rotation = None
    if noise_rotation is not None:
        turns = noise_rotation * random.standard_normal((len(sent), 3))
        rotation = quaternions(np.array([R @ _core.exp_so3(turn) for R, turn in zip(T[:, :3, :3], turns, strict=True)]))
    read = other_readings(robot, reached, unknowns or {}, random, threads)
    if torque_per_ampere is not None:
        held = motor_currents(robot, reached, torque_per_ampere, friction=friction, seed=seed, threads=threads)
        read = replace(read, current=held)
    if not points:
        return replace(read, q=sent.q, q_read=None)
    if not kinds_of(read):
        read = replace(read, sigma_position=None, instrument=None, sigma_rotation=None)
    return replace(read, q=sent.q, position=position, rotation=rotation, q_read=None)


def _deviations(robot: Robot, noise: float, noise_rotation: float | None, repeatability: ArrayLike) -> FloatArray:
    """The repeatability as an array, all standard deviations checked."""
    spread = np.asarray(repeatability, dtype=float)
    if spread.shape not in ((), (robot.joint_count,)):
        raise InvalidInput(f"repeatability must be one number or {robot.joint_count}, got shape {spread.shape}")
    for name, size in (("noise", noise), ("noise_rotation", noise_rotation or 0.0), ("repeatability", spread.min())):
        if not (np.isfinite(size) and size >= 0):
            raise InvalidInput(f"{name} must be a standard deviation of at least 0, got {size}")
    return spread


def random_poses(robot: Robot, count: int, *, region: ArrayLike | None = None, seed: int = 0) -> FloatArray:
    """Joint positions (count, n) [rad or m], even within the limits, whose tool lies in a region.

    Args:
        robot: Its limits and where its tool gets.
        count: How many.
        region: (2, 3) lower and upper corner of the box to keep in, in the measuring frame [m]; None: anywhere.
        seed: The same seed gives the same poses.

    Raises:
        InvalidInput: The arm has a joint without limits, or hardly ever gets into the region.
    """
    low, high = robot.limits.T
    if not np.isfinite(robot.limits).all():
        joint = int(np.argmin(np.isfinite(robot.limits).all(axis=1)))
        raise InvalidInput(f"random poses need limits, and joint {joint + 1} has none")
    box = np.array([[-np.inf] * 3, [np.inf] * 3]) if region is None else np.asarray(region, dtype=float)
    if box.shape != (2, 3) or not (box[0] < box[1]).all():
        raise InvalidInput(f"region must hold a lower and an upper corner, shape (2, 3), got {np.asarray(region)}")
    bare = robot.with_(effects=[])
    random = np.random.default_rng(seed)
    kept: list[FloatArray] = []
    found, tried = 0, 0
    while found < count:
        drawn = random.uniform(low, high, (max(count, 100), len(low)))
        q = robot.follow(drawn) if not robot.passive else closed_within(robot.core, drawn, robot.limits)
        point = bare.forward(q)[:, :3, 3]
        hits = q[((point >= box[0]) & (point <= box[1])).all(axis=1)]
        kept.append(hits)
        found, tried = found + len(hits), tried + len(drawn)
        if tried > 1 / _FEWEST_HITS and found < _FEWEST_HITS * tried:
            raise InvalidInput(f"the tool gets into the region in {found} of {tried} random postures; is it in reach?")
    return np.concatenate(kept)[:count] if kept else np.zeros((0, len(low)))


def _closed(robot: Robot, q: FloatArray, threads: int) -> FloatArray:
    """Postures (N, n) with the passive joints where the loops close; what cannot be assembled cannot be measured."""
    assembly = robot.assemble(q, threads=threads)
    assembly.check()
    return assembly.q


def perturbed(robot: Robot, *, length: float = 5e-4, angle: float = 5e-4, seed: int = 0) -> Robot:
    """The arm as a workshop might have built it: all sizes of joints and loops have normal errors; base and tool stay.

    Args:
        robot: The nominal arm.
        length: Standard deviation of the errors of lengths and points [m].
        angle: Of angles, and of directions about each axis [rad].
        seed: The same seed gives the same arm.
    """
    random = np.random.default_rng(seed)
    joints = content(robot.joints)
    for joint in joints:
        shift, turn = length * random.standard_normal(3), angle * random.standard_normal(3)
        if robot.kinematics in ("dh", "mdh"):
            keys = ("a_mm", "d_mm", "theta_deg", "alpha_deg", "beta_deg")
            for key, error in zip(keys, (*shift[:2], *turn), strict=True):
                joint[key] += from_si(float(error), key.rpartition("_")[2])
        elif robot.kinematics == "urdf":
            joint["origin"] = _moved(pose(joint["origin"]), shift, turn)
        else:
            _move_screw(joint, shift, turn)
    changes: dict[str, Any] = {"joints": joints}
    if robot.description.loops:
        changes["loops"] = [_moved_loop(loop, length, angle, random) for loop in robot.description.loops]
    return robot.with_(**changes)


def _moved_loop(loop: Spec, length: float, angle: float, random: np.random.Generator) -> Spec:
    """A loop whose lengths and places are off by normal errors [m], and its offset by an angle [rad]."""
    out = dict(loop)
    for key in ("from_xyz_mm", "to_xyz_mm", "length_mm", "offset_mm", "offset_deg"):
        if key in loop:
            spread, unit = (angle, "deg") if key == "offset_deg" else (length, "mm")
            errors = from_si(spread * random.standard_normal(np.shape(loop[key])), unit)
            out[key] = (np.asarray(loop[key], dtype=float) + errors).tolist()
    return out


def _moved(T: FloatArray, shift: FloatArray, turn: FloatArray) -> Spec:
    """{xyz_mm, rpy_deg} of T moved by a shift [m] and a turn [rad] along and about its own axes."""
    return frame_spec(T @ pose_of_six(np.concatenate([shift, turn])))


def _move_screw(joint: Spec, shift: FloatArray, turn: FloatArray) -> None:
    """Moves the axis of a POE joint by a shift [m] and a turn [rad] in the base frame."""
    R = np.asarray(_core.exp_so3(turn))
    for key in ("omega", "v", "v_mm"):
        if key in joint:
            joint[key] = (R @ np.asarray(joint[key], dtype=float)).tolist()
    if joint["type"] == "revolute":
        # v = -omega x point: a moved axis adds -omega x shift.
        moment = "v_mm" in joint
        change = -np.cross(joint["omega"], shift) if moment else shift
        key = "v_mm" if moment else "point_mm"
        joint[key] = [old + from_si(float(new), "mm") for old, new in zip(joint[key], change, strict=True)]
