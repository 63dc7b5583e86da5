# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm of which only the controller's flange pose is known: three slides and three turns, all exact.

T = Trans(x, y, z) Rz(c) Ry(b) Rx(a), with x ... a as joint positions. It has no geometry to identify: a posture is a
pose, however the arm came there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.units import from_si

POSE = "pose"  # in place of a robot file
PARTS = ("x", "y", "z", "qw", "qx", "qy", "qz")  # columns of an arm's pose, after its name and a dot
_HALF_TURN = float(from_si(np.pi, "deg"))
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def pose_arm(name: str) -> dict[str, Any]:
    """The robot file of such an arm."""
    joints: list[dict[str, Any]] = [
        {"type": "prismatic", "omega": [0.0, 0.0, 0.0], "v": list(axis), "min_mm": -1e6, "max_mm": 1e6}
        for axis in _AXES
    ]
    joints += [
        {
            "type": "revolute",
            "omega": list(axis),
            "point_mm": [0.0, 0.0, 0.0],
            "min_deg": -_HALF_TURN,
            "max_deg": _HALF_TURN,
        }
        for axis in _AXES[::-1]
    ]
    home = {"xyz_mm": [0.0] * 3, "rpy_deg": [0.0] * 3}
    return {"name": name, "kinematics": "poe", "joints": joints, "home": home}


def pose_joints(p: FloatArray, wxyz: FloatArray) -> FloatArray:
    """(N, 6) joint positions of flange poses: places (N, 3) [m] and unit quaternions (N, 4)."""
    rpy = np.array([_core.rotation_to_rpy(np.asarray(_core.quaternion_to_rotation(q))) for q in wxyz]).reshape(-1, 3)
    return np.column_stack([p, rpy[:, ::-1]])


def turned_joints(q: FloatArray, by: FloatArray) -> FloatArray:
    """(N, 6) joint positions of flange poses that are turned by a rotation vector (3,) [rad] in the flange's axes."""
    turn = np.asarray(_core.exp_so3(by))
    rotations = [np.asarray(_core.rpy_to_rotation(rpy)) @ turn for rpy in q[:, :2:-1]]
    return np.column_stack([q[:, :3], [np.asarray(_core.rotation_to_rpy(R))[::-1] for R in rotations]])
