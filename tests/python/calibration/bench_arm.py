# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm with levels and planes in numpy, written from the docs alone."""

import numpy as np
from numpy.typing import NDArray

from fastcal.robot.given import as_robot
from fastcal.robot.robot import Robot

FloatArray = NDArray[np.float64]

# theta, d, a, alpha of the docs' classic DH, in rad and m: an arm with a spherical wrist that is not quite one.
ROWS = np.array(
    [
        [0.0, 0.40, 0.15, -np.pi / 2],
        [-0.3, 0.05, 0.45, 0.1],
        [0.2, 0.02, 0.08, -np.pi / 2],
        [0.0, 0.42, 0.01, np.pi / 2],
        [0.1, 0.02, 0.03, -np.pi / 2],
        [0.0, 0.08, 0.00, 0.0],
    ]
)
TOOL = np.array([0.05, 0.02, 0.12])


def spec(rows: FloatArray) -> dict[str, object]:
    """The robot file of DH rows."""
    joints = [
        {
            "type": "revolute",
            "theta_deg": float(np.degrees(theta)),
            "d_mm": 1e3 * float(d),
            "a_mm": 1e3 * float(a),
            "alpha_deg": float(np.degrees(alpha)),
            "min_deg": -170,
            "max_deg": 170,
        }
        for theta, d, a, alpha in rows
    ]
    return {
        "name": "bench",
        "kinematics": "dh",
        "joints": joints,
        "tool": {"xyz_mm": (1e3 * TOOL).tolist(), "rpy_deg": [0, 0, 0]},
        "gravity_frame": "measuring",
    }


def robot(rows: FloatArray = ROWS, **changes: object) -> Robot:
    return as_robot({**spec(rows), **changes})


def turn(axis: int, angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


def frames(rows: FloatArray, q: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """(R, p) of the end of each link, T_i = Rz(theta + q) Tz(d) Tx(a) Rx(alpha), base in the measuring frame."""
    R, p = np.eye(3), np.zeros(3)
    out = []
    for (theta, d, a, alpha), angle in zip(rows, q, strict=True):
        R = R @ turn(2, theta + angle)
        p = p + R @ np.array([a, 0.0, d])
        R = R @ turn(0, alpha)
        out.append((R, p))
    return out


def tool_points(rows: FloatArray, q: FloatArray) -> FloatArray:
    return np.array([p + R @ TOOL for R, p in (frames(rows, row)[-1] for row in q)])


def tilts(rows: FloatArray, q: FloatArray, link: int, mount: FloatArray) -> FloatArray:
    """Elevation of the sensor's x and y axes over the horizon."""
    up = np.array([0.0, 0.0, 1.0])
    return np.array([np.arcsin((mount.T @ frames(rows, row)[link - 1][0].T @ up)[:2]) for row in q])


def disturbed(seed: int) -> FloatArray:
    return ROWS + 5e-4 * np.random.default_rng(seed).standard_normal(ROWS.shape)


def postures(count: int, seed: int) -> FloatArray:
    return np.random.default_rng(seed).uniform(-1.3, 1.3, (count, 6))


MOUNT = turn(0, 0.3) @ turn(1, -0.5) @ turn(2, 1.1)


def on_plane(rows: FloatArray, q: FloatArray, normal: FloatArray, offset: float) -> FloatArray:
    """Postures moved to where the tool lies on the plane normal . p = offset."""
    q = q.copy()
    for _ in range(30):
        height = tool_points(rows, q) @ normal - offset
        slope = np.empty_like(q)
        for j in range(6):
            there = q.copy()
            there[:, j] += 1e-7
            slope[:, j] = (tool_points(rows, there) @ normal - offset - height) / 1e-7
        q -= (height / (slope**2).sum(axis=1))[:, np.newaxis] * slope
    return q
