# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cameras and boards that are not where the joints say: late pictures, a mount that gives, something that was knocked.

With the joints' speeds dq/dt the frame F that a camera or board stands on moves by the body twist

    V = log(T_F(q - h dq/dt)^-1 T_F(q + h dq/dt)) / (2 h),

and its mount, which its own weight bends, by S g, g being the unit vector of gravity in the axes of F. What was knocked
stood elsewhere in the rows before.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray
from fastcal.measurements.dataset import Dataset
from fastcal.robot.rig import WORLD, core_rig, frame_of, has_rig
from fastcal.robot.robot import Robot
from fastcal.units import to_si

_STEP = 1e-3  # h [s]
_NEAR = 0.2  # [s] between rows of one motion


def rig_of(robot: Robot, data: Dataset) -> _core.Rig:
    """The cameras and boards of a robot, as they stand or move in each row of the data."""
    rig = core_rig(robot.description, partial(frame_of, joint_count=robot.core.joint_count))
    if not has_rig(robot.description):
        return rig
    cameras = robot.description.cameras
    standing = cameras | robot.description.boards
    for name, of in standing.items():
        if (shift := _shift(robot, data, of)) is not None:
            rig.set_shift(name, shift)
    late = {name for name, camera in cameras.items() if "time_offset_s" in camera or "readout_s" in camera}
    if not late or data.speed is None:
        return rig
    for name in late:
        camera = cameras[name]
        height = camera["size_px"][1]
        line = camera.get("readout_s", 0.0) / height
        rig.set_timing(name, camera.get("time_offset_s", 0.0), line, (height - 1) / 2)
    twists = {on: frame_speeds(robot, data, on) for on in {of["on"] for of in standing.values()}}
    for name, of in standing.items():
        if (twist := twists[of["on"]]) is not None:
            rig.set_motion(name, twist)
    return rig


def _shift(robot: Robot, data: Dataset, of: dict[str, Any]) -> FloatArray | None:
    """(N, 6) twist [m, rad] by which a camera or board is out of place in each row."""
    out = np.zeros((len(data), 6))
    if "sag_deg" in of:
        out += gravity_in(robot, data, of["on"]) @ sag_matrix(of).T
    if "knocked" in of and data.row is not None:
        step = of["knocked"]
        before = (data.row >= 0) & (data.row < step["at_row"])
        out[before] += np.concatenate([to_si(np.array(step[f"before_{unit}"]), unit) for unit in ("mm", "deg")])
    return out if out.any() else None


def frame_speeds(robot: Robot, data: Dataset, on: str) -> FloatArray | None:
    """(N, 6) twists [m/s, rad/s] of what stands on a frame; None where that does not move. Unknown speeds are 0."""
    if data.speed is None or frame_of(on, robot.core.joint_count) == WORLD:
        return None
    step = _STEP * np.nan_to_num(data.speed)
    before, after = (frames_of(robot, data.q + sign * step, on) for sign in (-1, 1))
    moved = np.linalg.solve(before, after)
    turn = np.array([_core.log_so3(T[:3, :3]) for T in moved])
    shift = moved[:, :3, 3] - np.cross(turn, moved[:, :3, 3]) / 2  # of the twist, up to the square of the turn
    return np.hstack([shift, turn]) / (2 * _STEP)


def speeds_of_times(q: FloatArray, time: FloatArray) -> FloatArray | None:
    """(N, n) speeds of joints by the rows before and after, where both are near in time; None where no arm moves so.

    Args:
        q: (N, n) joint positions, in the order of measuring.
        time: (N,) [s].
    """
    step = np.diff(time)
    near = (step > 0) & (step <= _NEAR)
    inner = np.flatnonzero(near[:-1] & near[1:]) + 1
    out = np.zeros_like(q)
    out[inner] = (q[inner + 1] - q[inner - 1]) / (time[inner + 1] - time[inner - 1])[:, np.newaxis]
    return out if out.any() else None


def gravity_in(robot: Robot, data: Dataset, on: str) -> FloatArray:
    """(N, 3) unit vectors of gravity in the axes of the frame that a camera stands on."""
    g = np.asarray(robot.description.gravity_m_s2, dtype=np.float64)
    R = frames_of(robot, data.q, on)[:, :3, :3]
    if robot.description.gravity_frame != "measuring":
        g = frames_of(robot, data.q[:1], "arm.base")[0, :3, :3] @ g
    return np.asarray(np.einsum("nij,i->nj", R, g / np.linalg.norm(g)))


def sag_matrix(camera: dict[str, Any]) -> FloatArray:
    """S (6, 3) [m, rad] of a camera's mount."""
    turn = to_si(np.asarray(camera["sag_deg"], dtype=np.float64), "deg")
    shift = to_si(np.asarray(camera.get("sag_mm", np.zeros((3, 3))), dtype=np.float64), "mm")
    return np.vstack([shift, turn])


def frames_of(robot: Robot, q: FloatArray, on: str) -> FloatArray:
    """(N, 4, 4) poses of a frame of the arm as its file has it, in the measuring frame."""
    frame = frame_of(on, robot.core.joint_count)
    if frame == WORLD:
        return np.broadcast_to(np.eye(4), (len(q), 4, 4))
    rigid = _core.ErrorModel(robot.core, [], np.zeros(0))
    name = robot.core.frame_name(frame)
    return np.asarray(rigid.predict(_core.Samples(np.ascontiguousarray(q)), rigid.start, of=name))
