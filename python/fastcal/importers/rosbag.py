# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""ROS 2 bags (and ROS 1's): joint states and measured poses of one clock, a row a standstill; by rosbags, without ROS.

What a message is worth is decided by its type: sensor_msgs/JointState has the joints; poses, points, transforms and
odometry of geometry_msgs, tf2_msgs and nav_msgs are what a tracker or a camera publishes. Lengths are in m, angles in
rad and quaternions x y z w by the conventions of ROS.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fastcal.arrays import FloatArray
from fastcal.errors import InvalidInput, ParseError, TooLarge
from fastcal.importers.bag_clocks import delay, still_windows
from fastcal.importers.bag_joints import Devices, JointStates, Stream, joint_states, left_out_samples, sized
from fastcal.importers.dialect import Dialect, made
from fastcal.importers.export import Export
from fastcal.importers.grid import Grid, Row
from fastcal.importers.standstills import core, standstills
from fastcal.io.bounded import Limits, call

_MARK = "ROS bag"
_STILL = 3.5e-4  # [rad or m]: 0.02 degrees
_SHORTEST = 0.3  # [s] a standstill; a slow motion stands still for a few samples
_COMPUTED = (
    "tcp_pose",
    "ee_pose",
    "end_effector",
    "cartesian_pose",
    "current_pose",
)  # by a controller, from its joints
_SECOND = 1e9
MAX_MESSAGES = 5_000_000
MEMORY, SECONDS = 1_000_000_000, 600  # 5 million messages take two minutes
MAX_METADATA = 1_000_000  # bytes; a bag of a hundred topics has 50,000
LEAST_UNPACKED, MOST_UNPACKED = 100_000_000, 50  # bytes of an unpacked file, at least, and by bytes of the bag
MAX_SAMPLES = 200_000  # of a table that is not reduced to standstills


def bag_grids(
    path: str | os.PathLike[str],
    topic: str | None = None,
    *,
    joints_alone: bool = False,
    names: Sequence[str] = (),
    count: int | None = None,
) -> list[Grid]:
    """The one table of a bag: joints and measured poses by standstills, or whichever of the two it has, by samples.

    Args:
        path: The bag.
        topic: Which poses were measured, where several topics hold poses; TOPIC:CHILD_FRAME of transforms.
        joints_alone: The poses were measured elsewhere.
        names: Of the robot's joints, where it has names.
        count: Of the robot's joints, where one is given.

    Raises:
        ParseError: It is no bag that can be read, or holds neither.
        InvalidInput: Several topics could be it; the sentence lists them.
    """
    name = os.fspath(path)
    devices, poses = _read_bounded(name)
    joints = joint_states(name, devices, names, count)
    measured = None if joints_alone else _chosen(name, poses, topic)
    if not len(joints.times) and measured is None:
        raise ParseError("the bag holds neither joint states nor poses", name)
    if measured is None:
        return [_table(name, _joint_titles(joints.names), joints.times, joints.q, notes=joints.notes)]
    seen, x, notes = _finite_poses(measured, poses[measured])
    titles = ["x [m]", "y [m]", "z [m]", "qx", "qy", "qz", "qw"][: x.shape[1]]
    if not len(joints.times):
        return [_table(name, titles, seen, x, sheet=measured, notes=notes)]
    times, rows, more = _by_standstill(name, joints, seen, x, tried=count is not None)
    notes = [*joints.notes, *notes, *more]
    return [_table(name, [*_joint_titles(joints.names), *titles], times, rows, sheet=measured, notes=notes)]


def _finite_poses(source: str, stream: Stream) -> tuple[FloatArray, FloatArray, list[str]]:
    """Times and poses that are numbers, and where they come from."""
    times, x = stream.arrays()
    kept = np.asarray(sized(x).all(axis=1))
    notes = [f"measured poses read from the topic {source}"]
    if not kept.all():
        notes.append(left_out_samples(int((~kept).sum()), len(kept), "measured poses"))
    return times[kept], x[kept], notes


_Streams = tuple[Devices, dict[str, Stream]]


def _read_bounded(path: str) -> _Streams:
    """`_read` in a process with limits: 100 kB of a bag can unpack to gigabytes, and its metadata can take minutes."""
    place = Path(path)
    metadata = place / "metadata.yaml"
    if metadata.is_file() and metadata.stat().st_size > MAX_METADATA:
        raise TooLarge(f"expected metadata of at most {MAX_METADATA / 1e6:.0f} MB", metadata)
    packed = sum(each.stat().st_size for each in (place.iterdir() if place.is_dir() else [place]) if each.is_file())
    limits = Limits(MEMORY, SECONDS, max(LEAST_UNPACKED, MOST_UNPACKED * packed), "its messages take")
    found: _Streams = call("fastcal.importers.rosbag:_read", (path, MAX_MESSAGES), path, limits)
    return found


def _read(path: str, most: int) -> _Streams:
    """The joint states by the joints that they name, and the poses by topic; at most `most` messages."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise ParseError("reading a ROS bag needs the package rosbags: pip install fastcal[ros]", path) from None
    devices, poses = dict[tuple[str, ...], Stream](), dict[str, Stream]()
    try:
        with AnyReader([Path(path)], default_typestore=get_typestore(Stores.LATEST)) as reader:
            wanted = [c for c in reader.connections if c.msgtype in _POSES or c.msgtype == _JOINTS]
            for count, (connection, received, raw) in enumerate(reader.messages(connections=wanted)):
                if count == most:
                    raise TooLarge(f"expected a bag of at most {most} joint states and poses", path)
                message: Any = reader.deserialize(raw, connection.msgtype)
                if connection.msgtype == _JOINTS:
                    _add_joints(connection.topic, message, received, devices)
                    continue
                for source, header, values in _POSES[connection.msgtype](connection.topic, message):
                    stream = poses.setdefault(source, Stream(source))
                    stream.times.append(_time(header, received))
                    stream.values.append(values)
    except ParseError:
        raise
    except MemoryError:  # what is damaged may ask for any size
        raise ParseError(f"is no ROS bag that can be read within {MEMORY / 1e9:.0f} GB", path) from None
    except Exception as error:  # noqa: BLE001 - a damaged bag makes its reader raise what it happens to meet
        raise ParseError(f"is no ROS bag that can be read: {' '.join(str(error).split()):.200}", path) from None
    return devices, poses


def _add_joints(topic: str, message: Any, received: int, devices: dict[tuple[str, ...], Stream]) -> None:
    """A message of joint states, to the device all of whose joints it names, and no others."""
    listed = list(message.name)
    if len(listed) != len(message.position) or not listed:
        return
    place = {name: k for k, name in enumerate(listed)}
    names = next((known for known in devices if set(known) == set(place)), tuple(place))
    stream = devices.setdefault(names, Stream(topic))
    stream.times.append(_time(message.header, received))
    stream.values.append([float(message.position[place[name]]) for name in names])


def _time(header: Any, received: int) -> float:
    """[s] since 1970, by the header where it has a time, else when the message was recorded."""
    stamp = None if header is None else header.stamp
    seconds = 0.0 if stamp is None else stamp.sec + stamp.nanosec / _SECOND
    return seconds if seconds > 0 else received / _SECOND


_Found = list[tuple[str, Any, list[float]]]  # source, header, values


def _values(place: Any, turn: Any | None) -> list[float]:
    xyz = [float(place.x), float(place.y), float(place.z)]
    return xyz if turn is None else [*xyz, float(turn.x), float(turn.y), float(turn.z), float(turn.w)]


def _transforms(topic: str, messages: Any) -> _Found:
    return [
        (f"{topic}:{m.child_frame_id}", m.header, _values(m.transform.translation, m.transform.rotation))
        for m in messages
    ]


_JOINTS = "sensor_msgs/msg/JointState"
_POSES: Mapping[str, Callable[[str, Any], _Found]] = {
    "geometry_msgs/msg/PoseStamped": lambda t, m: [(t, m.header, _values(m.pose.position, m.pose.orientation))],
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda t, m: [
        (t, m.header, _values(m.pose.pose.position, m.pose.pose.orientation))
    ],
    "geometry_msgs/msg/PointStamped": lambda t, m: [(t, m.header, _values(m.point, None))],
    "geometry_msgs/msg/TransformStamped": lambda t, m: _transforms(t, [m]),
    "nav_msgs/msg/Odometry": lambda t, m: [(t, m.header, _values(m.pose.pose.position, m.pose.pose.orientation))],
    "tf2_msgs/msg/TFMessage": lambda t, m: _transforms(t, m.transforms),
}


def _chosen(path: str, poses: Mapping[str, Stream], topic: str | None) -> str | None:
    """The source of the measured poses; transforms only where asked for, as robot_state_publisher sends them too."""
    if topic is not None:
        if topic not in poses:
            listed = ", ".join(sorted(poses)) or "none"
            raise ParseError(f"the bag has no poses of '{topic}'; it has {listed}", path)
        return topic
    own = [name for name in poses if not any(word in name.lower() for word in _COMPUTED)]
    plain = [name for name in own if not name.startswith(("/tf:", "/tf_static:"))]
    if len(plain) == 1:
        return plain[0]
    if poses:
        listed = ", ".join(sorted(plain or poses))
        raise InvalidInput(f"{path}: which poses were measured? Say it with --sheet TOPIC: {listed}")
    return None


def _by_standstill(
    path: str, joints: JointStates, seen: FloatArray, x: FloatArray, *, tried: bool
) -> tuple[FloatArray, FloatArray, list[str]]:
    """A row of joints and the mean pose for each standstill of the joints in which poses were measured, and notes."""
    at, q = joints.times, joints.q
    still = [
        (start, end, core(start, end)) for start, end in standstills(q, _STILL) if at[end - 1] - at[start] >= _SHORTEST
    ]
    windows = np.array([(at[middle][0], at[middle][-1]) for _, _, middle in still]).reshape(len(still), 2)
    late, may_be_another = delay(windows, seen, x[:, :3])
    ask = may_be_another and not tried
    moving, largest = still_windows(windows + late, seen, x[:, :3])
    times, rows, restless = [], [], 0
    for (_, _, middle), (low, high), moves in zip(still, windows + late, moving, strict=True):
        within = (seen >= low) & (seen <= high)
        if within.any() and moves:
            restless += 1
        elif within.any():
            times.append(float(at[middle].mean()))
            rows.append([*q[middle].mean(axis=0), *_mean_pose(x[within])])
    notes = []
    if late:
        notes.append(
            f"the clock of the poses is {abs(late):.2f} s {'late' if late > 0 else 'early'} against that of the "
            "joints, which is taken into account: so the measured point stands still where the joints do"
            + "; one of a whole pose more would look alike, which --robot ROBOT tells apart"
            * ask
        )
    if restless:
        moved = f"in {restless} of {restless + len(rows)} standstills of the joints the measured point still moves, by "
        moved += f"{1000 * largest:.3g} mm at most"
        if restless > len(rows):
            raise ParseError(f"{moved}: are the clocks of joints and poses the same?", path)
        notes.append(f"{moved}, and these are left out")
    if not rows:
        raise ParseError("no pose was measured while the joints stood still for a third of a second", path)
    return np.array(times), np.array(rows), notes


def _mean_pose(x: FloatArray) -> FloatArray:
    """Mean of x y z, and of the quaternions as the direction nearest to all of them, whatever their signs."""
    if x.shape[1] == 3:
        return np.asarray(x.mean(axis=0))
    q = x[:, 3:]
    _, vectors = np.linalg.eigh(q.T @ q)
    return np.concatenate([x[:, :3].mean(axis=0), vectors[:, -1]])


def _joint_titles(names: Sequence[str]) -> list[str]:
    return [f"/joint_states/{name}/position" for name in names]


def _table(
    path: str,
    titles: list[str],
    times: FloatArray,
    rows: FloatArray,
    *,
    sheet: str | None = None,
    notes: Sequence[str],
) -> Grid:
    """Cells as a person would export them; a first row says what they are, and from which topics."""
    if len(times) > MAX_SAMPLES:
        raise TooLarge(f"expected joints or poses alone of at most {MAX_SAMPLES} samples, got {len(times)}", path)
    cells = [(f"{time:.6f}", *(repr(float(value)) for value in row)) for time, row in zip(times, rows, strict=True)]
    lines = (("# " + _MARK, *notes), ("time [s]", *titles), *cells)
    return Grid(path, tuple(Row(k, row, k == 1) for k, row in enumerate(lines, start=1)), sheet=sheet)


def _export(grid: Grid) -> Export:
    first, head, *body = grid.rows
    found = made(grid, head.cells, [row.cells for row in body], [row.line for row in body])
    return replace(found, notes=(*first.cells[1:], *found.notes))


DIALECT = Dialect(
    "ROS 2 bag",
    lambda grid: bool(grid.rows) and grid.rows[0].cells[:1] == ("# " + _MARK,),
    _export,
    units={"length": ("m", 1.0), "angle": ("rad", 1.0)},
)
