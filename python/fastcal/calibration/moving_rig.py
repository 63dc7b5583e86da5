# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cameras and boards that deviate from the commanded pose: delayed pictures, a compliant mount, a knock.

With the joints' speeds dq/dt the frame F that a camera or board stands on moves by the body twist

    V = log(T_F(q - h dq/dt)^-1 T_F(q + h dq/dt)) / (2 h),

and its mount, which its own weight bends, by S g, g being the unit vector of gravity in the axes of F. What was knocked
stood elsewhere in the rows before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fastcal import _core
from fastcal.arrays import FloatArray, IntArray
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.rig import WORLD, Seeing, core_rig, frame_of, has_rig
from fastcal.robot.robot import Robot
from fastcal.robot.robot_spec import RobotSpec
from fastcal.units import to_si

_STEP = 1e-3  # h [s]
_NEAR = 0.2  # [s] between rows of one motion


@dataclass(frozen=True, eq=False)
class Postures:
    """N postures of an arm or of a tree of frames.

    Attributes:
        q: (N, n) joint positions [rad, m].
        gravity: (3,) in the axes of the measuring frame, of any length.
        frames: (N, 4, 4) poses in the measuring frame, at other positions (N, n), of what `on` names in a file.
        speed: (N, n) speeds of the joints [rad/s, m/s], where they are known.
        row: (N,) place in the order of measuring, -1 where unknown.
    """

    q: FloatArray
    gravity: FloatArray
    frames: Callable[[FloatArray, str], FloatArray]
    speed: FloatArray | None = None
    row: IntArray | None = None

    def __len__(self) -> int:
        return len(self.q)


def rig_of(robot: Robot, data: Dataset) -> _core.Rig:
    """The cameras and boards of a robot, as they stand or move in each row of the data."""
    spec = robot.description
    rig = core_rig(spec, partial(frame_of, joint_count=robot.core.joint_count))
    if not has_rig(spec):
        return rig
    return moving_rig(rig, spec, Postures(data.q, gravity_of(spec), partial(frames_of, robot), data.speed, data.row))


def moving_rig(rig: _core.Rig, spec: Seeing, postures: Postures) -> _core.Rig:
    """The same rig, its cameras and boards as they stand or move in each posture.

    Args:
        rig: As `core_rig` has it; it is changed.
        spec: Of which arm or cell.
        postures: Which.
    """
    cameras = spec.cameras
    standing = {**cameras, **spec.boards}
    for name, of in standing.items():
        if (shift := _shift(postures, of)) is not None:
            rig.set_shift(name, shift)
    late = {name for name, camera in cameras.items() if "time_offset_s" in camera or "readout_s" in camera}
    if not late or postures.speed is None:
        return rig
    for name in late:
        camera = cameras[name]
        height = camera["size_px"][1]
        line = camera.get("readout_s", 0.0) / height
        rig.set_timing(name, camera.get("time_offset_s", 0.0), line, (height - 1) / 2)
    twists = {on: frame_speeds(postures, on) for on in {of["on"] for of in standing.values()}}
    for name, of in standing.items():
        if (twist := twists[of["on"]]) is not None:
            rig.set_motion(name, twist)
    return rig


def _shift(postures: Postures, of: dict[str, Any]) -> FloatArray | None:
    """(N, 6) twist [m, rad] by which a camera or board is out of place in each posture."""
    out = np.zeros((len(postures), 6))
    if "sag_deg" in of:
        out += gravity_in(postures, of["on"]) @ sag_matrix(of).T
    if "knocked" in of and postures.row is not None:
        step = of["knocked"]
        before = (postures.row >= 0) & (postures.row < step["at_row"])
        out[before] += np.concatenate([to_si(np.array(step[f"before_{unit}"]), unit) for unit in ("mm", "deg")])
    return out if out.any() else None


def frame_speeds(postures: Postures, on: str) -> FloatArray | None:
    """(N, 6) twists [m/s, rad/s] of what stands on a frame; None where that does not move. Unknown speeds are 0."""
    if postures.speed is None or on == "world":
        return None
    step = _STEP * np.nan_to_num(postures.speed)
    before, after = (postures.frames(postures.q + sign * step, on) for sign in (-1, 1))
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


def gravity_of(arm: RobotSpec) -> FloatArray:
    """(3,) in the axes of the frame that the arm's base stands on [m/s^2]."""
    g = np.asarray(arm.gravity_m_s2, dtype=np.float64)
    return g if arm.gravity_frame == "measuring" else np.asarray(pose(vars(arm.base))[:3, :3] @ g)


def gravity_in(postures: Postures, on: str) -> FloatArray:
    """(N, 3) unit vectors of gravity in the axes of the frame that a camera stands on."""
    R, g = postures.frames(postures.q, on)[:, :3, :3], postures.gravity
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
