# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Joint angles that a controller gives modulo a turn, brought back to where the joint can be.

An angle less a whole turn is the same posture, but not the same turn of the motor: a ratio that is off by k moves the
joint by k q, and a column that jumps by 360 deg makes a wave of it.
"""

from __future__ import annotations

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.measurements.checks import RobotFacts
from fastcal.units import to_si

TURN = to_si(360.0, "deg")
_WRITTEN = to_si(0.05, "deg")  # to which an end of a turn or a limit is written
_FEWEST = 5  # angles on each side of half a turn that show a column to be modulo a turn


def unwrapped(q: FloatArray, robot: RobotFacts) -> tuple[FloatArray, list[str]]:
    """Joint positions (N, n) [rad or m] within the limits where whole turns bring them there, and what was done.

    A column is changed where it lies within one turn, 0 to 360 or -180 to 180 deg, some of it beyond the joint's
    limits, and whole turns bring all of that within them. Where the limits allow both, it stays, and is named if it
    looks as if it was taken modulo a turn.
    """
    out, notes = q.copy(), []
    changed: dict[str, list[int]] = {}
    doubtful = []
    driven = {mimic[0] for mimic in robot.mimics} | set(robot.passive)
    for joint, (kind, (low, high)) in enumerate(zip(robot.joint_types, np.asarray(robot.limits), strict=True)):
        if kind != "revolute" or joint in driven or not np.isfinite((low, high)).all():
            continue
        column = q[:, joint]
        positive = column.min() >= -_WRITTEN and column.max() <= TURN + _WRITTEN
        if not (positive or np.abs(column).max() <= TURN / 2 + _WRITTEN):
            continue
        beyond = (column > high + _WRITTEN) | (column < low - _WRITTEN)
        moved = column + np.where(column > high, -TURN, TURN)
        if beyond.any() and ((moved >= low - _WRITTEN) & (moved <= high + _WRITTEN))[beyond].all():
            out[beyond, joint] = moved[beyond]
            changed.setdefault("less" if column[beyond][0] > high else "more", []).append(joint + 1)
        elif positive and not beyond.any() and low <= -TURN / 2 + _WRITTEN:
            far = int(np.sum(column > TURN / 2))
            if min(far, len(column) - far) >= _FEWEST:
                doubtful.append(joint + 1)
    for joint, driver, multiplier, offset in robot.mimics:
        out[:, joint] = multiplier * out[:, driver] + offset
    for sign, joints in changed.items():
        notes.append(
            f"{_joints(joints)}: angles beyond the limits are read with a whole turn {sign} (360 deg), which brings "
            f"all rows within them; the controller seems to give angles modulo a turn"
        )
    if len(doubtful) > 1:
        notes.append(
            f"{_joints(doubtful)}: all angles lie from 0 to 360 deg, though the limits allow less than 0: were they "
            f"taken modulo a turn? A wrong ratio would then look like a wave; give them as the controller counts"
        )
    return out, notes


def _joints(joints: list[int]) -> str:
    *first, last = map(str, joints)
    return f"joints {', '.join(first)} and {last}" if first else f"joint {last}"
