# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Commands near a singular posture, such as an arm's home with joint 5 at 0.

There the tool cannot be turned about some axis by small moves of the joints: an exact command does not exist, or it
swings two joints of the wrist against each other by tens of degrees for a hundredth of a degree at the tool. Such
targets are corrected in the directions that small moves reach.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.compensation.one_step import pose_errors
from fastcal.ik.inverse_kinematics import InverseKinematics
from fastcal.robot.robot import Robot
from fastcal.units import from_si

# Of the largest singular value: about 4 degrees from a singular wrist; the others are left alone.
SINGULAR_SHARE = 0.03
_ROUNDS = 20
_FREEDOMS = 6  # of a pose
_OF_A_POINT = 3
_DONE = 1e-9  # rad or m
_SAME_PLACE = 1e-8  # [m]
_MOST_MOVE = 0.35  # [rad or m] of a joint: more is no small move


def command_by_small_moves(
    model: Robot, nominal: Robot, pose: FloatArray, q: FloatArray, **conditions: Any
) -> tuple[FloatArray, FloatArray] | None:
    """The command near q (1, n) that brings the tool nearest to a pose (1, 4, 4), where the posture is singular.

    Gauss-Newton with the nominal Jacobian [J_p; J_w] at q, position before orientation: dq = J_p^+ e_p + (J_w N)^+
    (e_w - J_w J_p^+ e_p), N = I - J_p^+ J_p, both without singular values below SINGULAR_SHARE of the largest
    (Siciliano et al., Robotics, 2009, section 3.5.1). A posture is singular where J has one, radians counting as they
    move a point at the arm's reach.

    Args:
        model: The identified robot.
        nominal: The controller's, whose Jacobian is taken.
        pose: Where the tool should be.
        q: The nominal joints for it [rad or m].
        **conditions: Those of `Robot.forward`.

    Returns:
        The command (1, n) and what is left, (6,) [m, rad]; None where the posture is not singular.
    """
    J = nominal.joint_jacobian(q)[0]
    scale = np.array([1.0, 1.0, 1.0, *[nominal.reach] * 3])
    motors = [joint for joint in range(nominal.joint_count) if joint not in {mimic[0] for mimic in nominal.mimics}]
    sizes = np.linalg.svd(scale[:, None] * J[:, motors], compute_uv=False)
    if sizes[-1] >= SINGULAR_SHARE * sizes[0]:
        return None
    inverse, limits = _position_first(J), np.transpose(model.limits)
    command = np.array(q, dtype=float)
    left = pose_errors(pose, model.forward(command, **conditions))[0]
    step = inverse @ left
    for _ in range(_ROUNDS):
        there = model.follow(np.clip(command + step, *limits))
        then = pose_errors(pose, model.forward(there, **conditions))[0]
        if np.abs(there - q).max() <= _MOST_MOVE and _is_nearer(then, left):
            command, left = there, then
            step = inverse @ left
        else:
            step = step / 2
        if np.abs(step).max() < _DONE:
            break
    return command, left


def left_to_the_bars(robot: Robot, found: InverseKinematics) -> list[str]:
    """What an arm whose bars keep its wrist level leaves of orientations, in a sentence; nothing of others."""
    motors = robot.joint_count - len(robot.passive)
    if not robot.passive or motors >= _FREEDOMS or not found.reached.any():
        return []
    most = from_si(float(found.rotation_error[found.reached].max()), "deg")
    if motors < _OF_A_POINT:
        off = from_si(float(found.position_error[found.reached].max()), "mm")
        return [f"with {motors} motors the tool stays on a surface: up to {off:.3f} mm and {most:.3f} deg are left"]
    return [
        f"with {motors} motors the position is reached, and the loops set the orientation: "
        f"up to {most:.3f} deg are left"
    ]


def _is_nearer(then: FloatArray, left: FloatArray) -> bool:
    """Whether a step has brought the tool nearer, or turned it towards its pose where it is there.

    Where the arm is stretched, steps of the nominal Jacobian grow and lead away.
    """
    position = np.linalg.norm(then[:3]) - np.linalg.norm(left[:3])
    if abs(position) > _SAME_PLACE:
        return bool(position < 0)
    return bool(np.linalg.norm(then[3:]) <= np.linalg.norm(left[3:]))


def _position_first(J: FloatArray) -> FloatArray:
    """(n, 6) the joint moves for a pose error: those for its position, then what else turns the tool towards it."""
    place = np.linalg.pinv(J[:3], rcond=SINGULAR_SHARE)
    free = np.eye(J.shape[1]) - place @ J[:3]
    turn = np.linalg.pinv(J[3:] @ free, rcond=SINGULAR_SHARE)
    return np.hstack([place - turn @ J[3:] @ place, turn])
