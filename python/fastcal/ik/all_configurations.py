# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""All configurations of an arm of six joints at a pose, each followed from the nominal arm to the model."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import InverseKinematics, inverse_kinematics
from fastcal.ik.posture import unwound
from fastcal.robot.robot import Robot

_SAME = 1e-4  # [rad or m] two solutions that are one
_TURN = 2 * np.pi


def branches(
    model: Robot,
    target: ArrayLike,
    *,
    near: ArrayLike | None = None,
    starts: int = 256,
    random_seed: int = 0,
    threads: int = 1,
    **conditions: Any,
) -> InverseKinematics:
    """The solutions of one target, a row each: those of the chain without effects, followed to the whole model.

    A row's status is the outcome of its branch on the model; a branch that the effects push over a limit has
    "limit". Whole turns are taken out of every joint as far as that brings it nearer to `near`.

    Args:
        model: A robot of at most six joints, with its effects.
        target: (4, 4) pose of the tool in the measuring frame.
        near: (n,) posture by whose distance the rows are ordered; None: the middle of the limits.
        starts: Scrambled Sobol postures from which the chain is solved; those of an arm of six joints lead to all of at
            most sixteen solutions unless a limit leaves one hardly any room.
        random_seed: The same gives the same postures.
        threads: Cores to use; the result does not depend on it.
        **conditions: payload [kg] ... as `Robot.forward` takes them.

    Raises:
        InvalidInput: The arm is redundant, so that its solutions are not a list, or a shape does not fit.
    """
    if model.joint_count > 6:
        raise InvalidInput(f"{model.name} has {model.joint_count} joints: a pose has infinitely many solutions")
    T = np.asarray(target, dtype=float)
    if T.shape != (4, 4):
        raise InvalidInput(f"target must have shape (4, 4), got {T.shape}")
    low, high = np.clip(model.limits, -np.pi, np.pi).T
    middle = (low + high) / 2 if near is None else np.asarray(near, dtype=float)
    if middle.shape != (model.joint_count,):
        raise InvalidInput(f"near must have shape ({model.joint_count},), got {middle.shape}")
    generator = np.random.default_rng(random_seed)
    from scipy.stats import qmc  # takes long to import

    seeds = low + (high - low) * qmc.Sobol(model.joint_count, seed=generator).random(max(int(starts), 1))
    nominal = model.with_(effects=[])
    found = inverse_kinematics(nominal, np.broadcast_to(T, (len(seeds), 4, 4)), seeds, restarts=0, threads=threads)
    turns = np.array([kind == "revolute" for kind in model.joint_types])
    ways: list[FloatArray] = []
    for q in found.q[found.reached]:
        if all(_apart(q, way, turns) > _SAME for way in ways):
            ways.append(unwound(q, middle, model.limits, turns))
    ways.sort(key=lambda q: float(np.abs(q - middle).max()))
    start = np.array(ways).reshape(-1, model.joint_count)
    poses = np.broadcast_to(T, (len(start), 4, 4))
    return inverse_kinematics(model, poses, start, restarts=0, threads=threads, **conditions)


def _apart(a: FloatArray, b: FloatArray, turns: NDArray[np.bool_]) -> float:
    """The largest distance of a joint, whole turns left out."""
    apart = np.abs(a - b)
    return float(np.where(turns, np.abs((a - b + np.pi) % _TURN - np.pi), apart).max())
