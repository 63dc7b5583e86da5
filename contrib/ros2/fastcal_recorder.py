#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
r"""A ROS 2 node that writes a fastcal measurement file, a row each time its service is called.

It needs rclpy and the standard messages alone, neither fastcal nor a build:

    python3 fastcal_recorder.py --ros-args -p output:=session.csv -p pose_topic:=/tracker/pose \
        -p joint_names:="[joint_1, joint_2, joint_3, joint_4, joint_5, joint_6]"
    ros2 service call /fastcal_recorder/capture std_srvs/srv/Trigger

A row holds the means over the last `window_s` seconds, in which the arm must have stood still.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

STILL = 3.5e-4  # [rad or m] that a joint may stray within the window: 0.02 degrees


class Recorder:
    """What the node does, without ROS.

    Args:
        output: The CSV; rows are appended to one that is there.
        joint_names: Of the arm, from the base; empty: as the first message lists them.
        window: [s] over which a row is averaged.
        sliding: Joints, counted from 0, that slide; their columns are in m.
    """

    def __init__(
        self, output: str, joint_names: Sequence[str] = (), window: float = 1.0, sliding: Sequence[int] = ()
    ) -> None:
        self.output, self.joint_names, self.window = Path(output), list(joint_names), window
        self.sliding = set(sliding)
        self._joints: deque[tuple[float, list[float]]] = deque()
        self._poses: deque[tuple[float, list[float]]] = deque()

    def add_joints(self, time: float, names: Sequence[str], positions: Sequence[float]) -> None:
        """A message of joint states [s], [rad or m]; one that lacks a joint of the arm is another device's."""
        self.joint_names = self.joint_names or list(names)
        place = {name: k for k, name in enumerate(names)}
        if set(self.joint_names) <= set(place):
            self._keep(self._joints, time, [float(positions[place[name]]) for name in self.joint_names])

    def add_pose(self, time: float, xyz: Sequence[float], xyzw: Sequence[float] | None = None) -> None:
        """A measured pose [s], [m]; the quaternion in the order of ROS."""
        if xyzw is None:
            self._keep(self._poses, time, list(xyz))
            return
        q = [xyzw[3], *xyzw[:3]]
        last = self._poses[-1][1] if self._poses else None
        if last is not None and len(last) > 3 and sum(a * b for a, b in zip(q, last[3:], strict=True)) < 0:
            q = [-part for part in q]  # q and -q are one rotation, but their mean is none
        self._keep(self._poses, time, [*xyz, *q])

    def capture(self) -> tuple[bool, str]:
        """Appends a row; False and why where there is none to append."""
        if len(self._joints) < 2:
            return False, f"no joint states within the last {self.window:g} s"
        now = self._joints[-1][0]
        poses = [values for time, values in self._poses if abs(time - now) <= self.window]
        if not poses:
            return False, f"no poses within the last {self.window:g} s"
        columns = list(zip(*(values for _, values in self._joints), strict=True))
        worst = max(range(len(columns)), key=lambda k: max(columns[k]) - min(columns[k]))
        if max(columns[worst]) - min(columns[worst]) > STILL:
            return False, f"{self.joint_names[worst]} moved within the last {self.window:g} s: wait, and call again"
        row = [_mean(column) for column in columns]
        pose = [_mean(column) for column in zip(*poses, strict=True)]
        length = math.hypot(*pose[3:]) or 1.0
        row += [*pose[:3], *(part / length for part in pose[3:]), now]
        self._write(row, len(pose) > 3)
        return True, f"{self.output}: means of {len(self._joints)} samples of the joints and {len(poses)} of the pose"

    def _keep(self, samples: deque[tuple[float, list[float]]], time: float, values: list[float]) -> None:
        samples.append((time, values))
        while samples and samples[0][0] < time - self.window:
            samples.popleft()

    def _write(self, row: list[float], turned: bool) -> None:
        units = ["m" if k in self.sliding else "rad" for k in range(len(self.joint_names))]
        names = [f"q{k}_{unit}" for k, unit in enumerate(units, start=1)] + ["x_m", "y_m", "z_m"]
        names += [*(["qw", "qx", "qy", "qz"] if turned else []), "time_s"]
        is_new = not self.output.exists() or self.output.stat().st_size == 0
        with self.output.open("a", encoding="utf-8", newline="\n") as file:
            if is_new:
                file.write(",".join(names) + "\n")
            file.write(",".join(repr(value) for value in row) + "\n")


def _mean(values: Sequence[float]) -> float:
    return math.fsum(values) / len(values)


def main() -> None:
    """Runs the node until it is stopped."""
    import rclpy
    from geometry_msgs.msg import PoseStamped
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    rclpy.init()
    node = rclpy.create_node("fastcal_recorder")
    given = {
        "output": "measurements.csv",
        "joint_names": [""],
        "pose_topic": "/tracker/pose",
        "joint_topic": "/joint_states",
        "window_s": 1.0,
    }
    values: dict[str, Any] = {name: node.declare_parameter(name, default).value for name, default in given.items()}
    recorder = Recorder(values["output"], [name for name in values["joint_names"] if name], values["window_s"])

    def joints(message: Any) -> None:
        recorder.add_joints(_seconds(message.header.stamp), message.name, message.position)

    def pose(message: Any) -> None:
        at, turn = message.pose.position, message.pose.orientation
        recorder.add_pose(_seconds(message.header.stamp), (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w))

    def capture(_: Any, response: Any) -> Any:
        response.success, response.message = recorder.capture()
        return response

    node.create_subscription(JointState, values["joint_topic"], joints, 50)
    node.create_subscription(PoseStamped, values["pose_topic"], pose, 50)
    node.create_service(Trigger, "~/capture", capture)
    node.get_logger().info(f"writing {values['output']}; call ~/capture at each pose")
    rclpy.spin(node)


def _seconds(stamp: Any) -> float:
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


if __name__ == "__main__":
    main()
