# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The SR210D way: the predicted pose error, mapped to joint errors by the nominal Jacobian, taken off in one step.

q = q_n + J(q_n)^+ e, with q_n the nominal robot's joints for the target, e = [p - p_m; log(R R_m^T)] what the model
says that the tool then misses, and J the nominal robot's Jacobian (Siasun SR210D paper, section 5 and figure 2, where e
is a network's and a position alone).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.robot.robot import Robot

_RANK = 1e-6  # of the largest singular value: below it a direction is singular and left alone


def one_step(
    model: Robot, nominal: Robot, poses: FloatArray, q: FloatArray, *, hold: Sequence[int] = (), **conditions: Any
) -> FloatArray:
    """Commands (N, n) for poses (N, 4, 4) that the nominal robot reaches at q (N, n); joints in `hold` (from 1) stay.

    The other arguments are the conditions of `Robot.forward`.
    """
    e = pose_errors(poses, model.forward(q, **conditions))
    J = nominal.joint_jacobian(q)
    J[:, :, [joint - 1 for joint in hold]] = 0
    scale = np.array([1.0, 1.0, 1.0, *[nominal.reach] * 3])  # radians count as they move a point at the reach
    step = np.einsum("nij,nj->ni", np.linalg.pinv(scale[:, None] * J, rcond=_RANK), scale * e)
    return nominal.follow(np.asarray(q + step))


def pose_errors(wanted: FloatArray, got: FloatArray) -> FloatArray:
    """(N, 6) twists [v; w] in the measuring frame's axes that bring poses `got` (N, 4, 4) to those wanted."""
    turns = wanted[:, :3, :3] @ got[:, :3, :3].transpose(0, 2, 1)
    w = np.array([_core.log_so3(np.ascontiguousarray(R)) for R in turns]).reshape(-1, 3)
    return np.hstack([wanted[:, :3, 3] - got[:, :3, 3], w])
