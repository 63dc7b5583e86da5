# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Targets reached in the configuration of their seeds, so that a program keeps its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fastcal.arrays import BoolArray, FloatArray
from fastcal.errors import InvalidInput
from fastcal.ik.posture import SphericalWristArm, unwound
from fastcal.robot.robot import Robot

if TYPE_CHECKING:
    from fastcal.ik.inverse_kinematics import InverseKinematics


_NEAR = 0.2  # rad: a command that lies so near to where it was followed from is in the same branch
_STARTS = 2048  # quasi-random postures, about one in eight of which is in a given configuration
_FIRST = 4  # of them are tried first, then twice as many, as long as no solution is found


def in_its_configuration(
    model: Robot,
    T: FloatArray,
    seed: FloatArray,
    box: FloatArray,
    *,
    restarts: int,
    solve: Callable[..., InverseKinematics],
    **conditions: Any,
) -> InverseKinematics:
    """Each target (N, 4, 4) in the configuration of its seed (N, 6), within the limits `box` (6, 2).

    What the seed itself does not lead to is sought on the arm without effects, and followed from there to the model.
    `solve(robot, T, q, restarts=..., **conditions)` is inverse kinematics in any configuration.

    Raises:
        InvalidInput: The arm has no configurations.
    """
    arm = SphericalWristArm(model)
    if not arm.has_configurations:
        raise InvalidInput(f"{model.name} has no shoulder, elbow and wrist whose configuration could be kept")
    asked = arm.sides(seed)

    def kept(found: InverseKinematics, start: FloatArray) -> BoolArray:
        same = (arm.sides(found.q) == asked).all(axis=1)
        return np.asarray(found.reached & (same | (np.abs(found.q - start).max(axis=1) < _NEAR)))

    found = solve(model, T, seed, restarts=0, **conditions)
    lost = ~kept(found, seed) & (found.status != "bad_target")
    if lost.any():
        start = found.q.copy()
        start[lost] = _chain_solutions(arm, T[lost], seed[lost], asked[lost], box, solve)
        again = solve(model, T, start, restarts=0, **conditions)
        better = lost & kept(again, start)
        found, lost = _taken(found, again, better), lost & ~better
    if lost.any():
        anywhere = solve(model, T, seed, restarts=restarts, **conditions)
        status = np.where(anywhere.reached, "configuration", anywhere.status)
        found = _taken(found, replace(anywhere, status=status), lost)
    return found


def _chain_solutions(
    arm: SphericalWristArm,
    T: FloatArray,
    seed: FloatArray,
    asked: BoolArray,
    box: FloatArray,
    solve: Callable[..., InverseKinematics],
) -> FloatArray:
    """(N, 6) solutions of the chain without effects in the asked configurations; the seed where none is found.

    In a configuration there is one solution, but for whole turns: those that bring it nearest to the seed are taken.
    """
    low, high = np.clip(box, -np.pi, np.pi).T
    from scipy.stats import qmc  # takes long to import

    starts = low + (high - low) * qmc.Sobol(6, seed=np.random.default_rng(0)).random(_STARTS)
    sides = arm.sides(starts)
    out = seed.copy()
    for one in np.unique(asked, axis=0):
        rows = np.flatnonzero((asked == one).all(axis=1))
        own = starts[(sides == one).all(axis=1)]
        begin, count = 0, _FIRST
        while rows.size and begin < len(own):
            some = own[begin : begin + count]
            poses, near = np.repeat(T[rows], len(some), axis=0), np.repeat(seed[rows], len(some), axis=0)
            found = solve(arm.robot, poses, np.tile(some, (len(rows), 1)), restarts=0)
            q = unwound(found.q, near, box)
            good = (found.reached & (arm.sides(q) == one).all(axis=1)).reshape(len(rows), -1)
            there, first = good.any(axis=1), good.argmax(axis=1)
            out[rows[there]] = q.reshape(len(rows), -1, 6)[there, first[there]]
            rows, begin, count = rows[~there], begin + count, 2 * count
    return out


def _taken(found: InverseKinematics, other: InverseKinematics, rows: BoolArray) -> InverseKinematics:
    """`found`, in some rows what the other has; the evaluations of both."""
    wide = rows[:, np.newaxis]
    return replace(
        found,
        q=np.where(wide, other.q, found.q),
        status=np.where(rows, other.status, found.status),
        iterations=found.iterations + other.iterations,
        position_error=np.where(rows, other.position_error, found.position_error),
        rotation_error=np.where(rows, other.rotation_error, found.rotation_error),
    )
