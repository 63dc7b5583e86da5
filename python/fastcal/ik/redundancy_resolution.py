# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Of the postures in which a redundant arm reaches a target, the one that a criterion prefers.

From a solution the arm moves in the null space of its Jacobian, J v = 0, by Newton's step on the criterion along v, and
inverse kinematics brings the tool back; steps that do not help are halved (A. Liegeois, "Automatic supervisory control
of the configuration and behavior of multibody mechanisms", 1977).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput
from fastcal.ik.inverse_kinematics import InverseKinematics, inverse_kinematics, refuse_mimic_joints
from fastcal.robot.robot import Robot

Criterion = Callable[[FloatArray], FloatArray]

CRITERIA = ("limits", "manipulability", "deflection", "motion", "arm_angle")
_DIFFERENCE = 1e-4  # [rad] or of the reach: step of the differences along the null space
_LARGEST = 0.3  # [rad] or of the reach: the first steps are no longer
_SMALLEST = 1e-4  # steps that become smaller end the search
_ROUNDS = 60
_FAR = 1e9  # a step that is cut to the largest


def choose_posture(
    model: Robot,
    targets: ArrayLike,
    seed: ArrayLike | None = None,
    *,
    prefer: str = "limits",
    arm_angle: float = 0.0,
    tolerance_m: float = 1e-9,
    tolerance_rad: float = 1e-9,
    threads: int = 1,
    **conditions: Any,
) -> InverseKinematics:
    """Inverse kinematics of a redundant arm, in the posture nearby that a criterion likes best.

    Args:
        model: A robot with more joints than 6, with its effects.
        targets: (N, 4, 4) poses of the tool in the measuring frame.
        seed: As `inverse_kinematics`; for "motion" also the posture to stay near.
        prefer: "limits": far from the limits, least sum of squares of (q - middle) / half range; "manipulability":
            greatest product of the singular values of the Jacobian, lengths over the reach; "deflection": least
            displacement of the tool by the model's effects; "motion": least squares of q - seed; "arm_angle".
        arm_angle: What "arm_angle" brings the angle of a 7R arm to [rad], see `arm_angles`.
        tolerance_m: As `inverse_kinematics`.
        tolerance_rad: As `inverse_kinematics`.
        threads: Cores to use; the result does not depend on it.
        **conditions: payload [kg] ... as `Robot.forward` takes them.

    Raises:
        InvalidInput: The arm is not redundant, or the criterion is not known or can't be formed.
    """
    if model.joint_count <= 6:
        raise InvalidInput(f"{model.name} has {model.joint_count} joints: a pose leaves it no posture to choose")
    refuse_mimic_joints(model, "choosing a posture")
    if prefer not in CRITERIA:
        raise InvalidInput(f"prefer takes {', '.join(CRITERIA)}, got '{prefer}'")
    T = np.asarray(targets, dtype=float)
    T = T[np.newaxis] if T.shape == (4, 4) else T
    accuracy: dict[str, Any] = {"tolerance_m": tolerance_m, "tolerance_rad": tolerance_rad, "threads": threads}
    best = inverse_kinematics(model, T, seed, **accuracy, **conditions)
    start = best.q if seed is None else np.broadcast_to(np.asarray(seed, dtype=float), best.q.shape)
    cost = _criterion(model, prefer, start, arm_angle, conditions)
    q, value = best.q.copy(), cost(best.q)
    largest = np.where(best.reached, _LARGEST, 0.0)
    iterations = best.iterations.copy()
    bare = _without_effects(model)
    units = np.array([model.reach if kind == "prismatic" else 1.0 for kind in model.joint_types])
    for _ in range(_ROUNDS):
        rows = np.flatnonzero(largest > _SMALLEST)
        if not len(rows):
            break
        step = _null_step(bare, q, units, cost, largest)
        tried = np.clip(q + step, model.limits[:, 0], model.limits[:, 1])
        found = inverse_kinematics(model, T, tried, restarts=0, **accuracy, **conditions)
        iterations[rows] += found.iterations[rows]
        new = cost(found.q)
        better = found.reached & (new < value) & (largest > _SMALLEST)
        q[better], value[better] = found.q[better], new[better]
        largest[~better] /= 2
    end = inverse_kinematics(model, T, q, restarts=0, **accuracy, **conditions)
    return replace(end, iterations=iterations)


def arm_angles(robot: Robot, q: ArrayLike) -> FloatArray:
    """(N,) angle [rad] by which the elbow of a 7R arm is turned about the line from shoulder to wrist.

    Shoulder, elbow and wrist are the origins of joints 2, 4 and 6; 0 is where the elbow lies in the plane of that line
    and axis 1, on the side to which axis 1 points (K. Kreutz-Delgado, M. Long, H. Seraji, "Kinematic analysis of 7-DOF
    manipulators", 1992). Not defined where the line is parallel to axis 1, or the arm straight.
    """
    if robot.joint_types != ["revolute"] * 7:
        raise InvalidInput(f"the arm angle is that of seven revolute joints, {robot.name} has other joints")
    rows = np.atleast_2d(np.asarray(q, dtype=float))
    frames = np.asarray(robot.core.frame_origins(rows))
    shoulder, elbow, wrist = (frames[:, 2 * joint - 1] for joint in (2, 4, 6))
    line = wrist - shoulder
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    up = _without_effects(robot).joint_jacobian(rows)[:, 3:, 0]
    reference = up - np.einsum("ni,ni->n", line, up)[:, None] * line
    lever = elbow - shoulder
    lever -= np.einsum("ni,ni->n", lever, line)[:, None] * line
    across = np.einsum("ni,ni->n", line, np.cross(reference, lever))
    return np.asarray(np.arctan2(across, np.einsum("ni,ni->n", reference, lever)))


def _without_effects(robot: Robot) -> Robot:
    return robot.with_(effects=[])


def _criterion(model: Robot, prefer: str, start: FloatArray, arm_angle: float, conditions: dict[str, Any]) -> Criterion:
    """What is to become small: q (N, n) -> (N,)."""
    bare = _without_effects(model)
    if prefer == "limits":
        bounded = np.isfinite(model.limits).all(axis=1)
        low, high = model.limits[bounded].T
        return lambda q: np.asarray((((2 * q[:, bounded] - low - high) / (high - low)) ** 2).sum(axis=1))
    if prefer == "motion":
        return lambda q: np.asarray(((q - start) ** 2).sum(axis=1))
    if prefer == "manipulability":
        return lambda q: np.asarray(-np.log(np.linalg.svd(_scaled(bare, q), compute_uv=False) + 1e-12).sum(axis=1))
    if prefer == "deflection":
        return lambda q: np.asarray(
            np.linalg.norm((model.forward(q, **conditions) - bare.forward(q))[:, :3, 3], axis=1)
        )
    arm_angles(bare, start[:1])
    return lambda q: np.asarray(((arm_angles(bare, q) - arm_angle + np.pi) % (2 * np.pi) - np.pi) ** 2)


def _scaled(robot: Robot, q: FloatArray) -> FloatArray:
    """(N, 6, n) Jacobian, lengths over the reach."""
    J = robot.joint_jacobian(q)
    J[:, :3] /= robot.reach
    J[:, :, [kind == "prismatic" for kind in robot.joint_types]] *= robot.reach
    return J


def _null_step(bare: Robot, q: FloatArray, units: FloatArray, cost: Criterion, largest: FloatArray) -> FloatArray:
    """(N, n) Newton's step along each direction of the null space, downhill where the criterion bends the other way."""
    null = np.linalg.svd(_scaled(bare, q))[2][:, 6:] * units
    middle, step = cost(q), np.zeros_like(q)
    for v in null.transpose(1, 0, 2):
        ahead, behind = cost(q + _DIFFERENCE * v), cost(q - _DIFFERENCE * v)
        slope, bend = (ahead - behind) / (2 * _DIFFERENCE), (ahead + behind - 2 * middle) / _DIFFERENCE**2
        newton = np.where(bend > 0, -slope / np.where(bend > 0, bend, 1.0), -np.sign(slope) * _FAR)
        step += np.clip(newton, -largest, largest)[:, None] * v
    return step
