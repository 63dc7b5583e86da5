# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Bags of robot_calibration (M. Ferguson): CalibrationData, that is joints, and one set of points seen by two sensors.

A camera with depth gives the points of a board in its own frame, the arm's chain gives them in the board's. Their best
rigid fit is the board's pose in the camera: with the joints what a hand-eye calibration needs, and an arm's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.calibration.moving_rig import frames_of
from fastcal.errors import ParseError, TooLarge
from fastcal.importers.pose_pairs import PosePairs, agreeing
from fastcal.io.bounded import Limits, call
from fastcal.measurements.rotations import best_motion
from fastcal.robot.robot import Robot

_TYPE = "robot_calibration_msgs/msg/CalibrationData"
_MOST, _MEMORY, _SECONDS, _BYTES = 100_000, 1_000_000_000, 300, 1_000_000_000
_BAGS = (".bag", ".mcap", ".db3")
_FEWEST = 4  # points of a board
_FLAT = 1e-4  # of a board's size: its second extent, where the points are on a line

_Sample = tuple[list[str], list[float], dict[str, tuple[FloatArray, bool]]]


def read_calibration_data(files: Sequence[Path], robot: Robot | None) -> PosePairs | None:
    """The board's poses in the camera with the arm's joints; None: no bag of robot_calibration.

    Args:
        files: One bag.
        robot: The arm, with the joints' names of the bag.

    Raises:
        ParseError: There is no arm to read it with, a joint of it is not in the bag, or no points that show a board.
    """
    if len(files) != 1 or files[0].suffix.lower() not in _BAGS:
        return None
    path = str(files[0])
    samples: list[_Sample] = call(
        "fastcal.importers.robot_calibration:_read",
        (path,),
        path,
        Limits(_MEMORY, _SECONDS, _BYTES, "its messages take"),
    )
    if not samples:
        return None
    if robot is None:
        raise ParseError("is a bag of robot_calibration; give the arm that was calibrated (--robot)", path)
    names = [str(joint.name) for joint in robot.joints if joint.name is not None]
    if len(names) < robot.joint_count:
        raise ParseError(f"names its joints, and {robot.name} does not; give its URDF (--robot)", path)
    q, seen = [], []
    for joints, positions, observed in samples:
        at = dict(zip(joints, positions, strict=True))
        missing = [name for name in names if name not in at]
        if missing:
            raise ParseError(f"names no joint '{missing[0]}' of {robot.name}; it has {', '.join(at)}", path)
        if (T := _board_in_camera(observed)) is not None:
            q.append([at[name] for name in names])
            seen.append(T)
    if not seen:
        raise ParseError("holds no points that a camera with depth and a chain saw both, four or more of a board", path)
    counts = np.array(q)
    left = len(samples) - len(seen)
    notes = (f"{left} samples show no board by depth and were left out",) if left else ()
    found = PosePairs(
        frames_of(robot, counts, "arm"), np.array(seen), None, "robot_calibration's data", notes, joints=counts
    )
    return agreeing(found, files)


def _read(path: str) -> list[_Sample]:
    """Names, positions and observed points (k, 3) by sensor, and whether it is a camera, of each sample."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise ParseError("reading a ROS bag needs the package rosbags: pip install fastcal[ros]", path) from None
    out: list[_Sample] = []
    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.LATEST)) as reader:
            wanted = [c for c in reader.connections if c.msgtype == _TYPE]
            for connection, _, raw in reader.messages(connections=wanted) if wanted else ():
                if len(out) == _MOST:
                    raise TooLarge(f"expected a bag of at most {_MOST} samples", path)
                message: Any = reader.deserialize(raw, connection.msgtype)
                state = message.joint_states
                observed = {str(of.sensor_name): _points(of) for of in message.observations}
                out.append((list(state.name), [float(v) for v in state.position], observed))
    except ParseError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged bag makes its reader raise what it happens to meet
        raise ParseError(f"is no ROS bag that can be read: {' '.join(str(error).split()):.200}", path) from None
    return out


def _points(observation: Any) -> tuple[FloatArray, bool]:
    at = [[of.point.x, of.point.y, of.point.z] for of in observation.features]
    info = observation.ext_camera_info.camera_info
    matrix = getattr(info, "K", None) if hasattr(info, "K") else info.k
    return np.array(at, dtype=np.float64).reshape(-1, 3), bool(np.any(np.asarray(matrix)))


def _board_in_camera(observed: Mapping[str, tuple[FloatArray, bool]]) -> FloatArray | None:
    """(4, 4) [m] by the best rigid fit of the chain's points to the camera's; None where they do not show it."""
    cameras = [points for points, is_camera in observed.values() if is_camera]
    chains = [points for points, is_camera in observed.values() if not is_camera]
    if len(cameras) != 1 or len(chains) != 1 or cameras[0].shape != chains[0].shape:
        return None
    known = np.isfinite(cameras[0]).all(axis=1) & np.isfinite(chains[0]).all(axis=1)
    b, a = cameras[0][known], chains[0][known]
    if len(a) < _FEWEST or not np.any(b[:, 2]):
        return None
    size = np.linalg.svd((b - b.mean(axis=0)).T @ (a - a.mean(axis=0)), compute_uv=False)
    return None if size[1] < _FLAT * size[0] else best_motion(a, b)
