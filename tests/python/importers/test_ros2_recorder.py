# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The ROS 2 node of contrib/ros2: its rows, and its wiring to an rclpy that stands in for ROS."""

import importlib.util
import sys
import types
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import fastcal

NODE = Path(__file__).parents[3] / "contrib" / "ros2" / "fastcal_recorder.py"


@pytest.fixture
def recorder() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fastcal_recorder", NODE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


NAMES = ["pan", "lift", "elbow", "roll", "bend", "turn"]


def stand(record, q, x, start: float, xyzw=(0.0, 0.0, 0.0, 1.0)) -> None:
    """Two seconds at a posture; the tracker publishes q and -q in turn, and the joints come by the alphabet."""
    order = np.argsort(NAMES)
    for k in range(40):
        time = start + 0.05 * k
        record.add_joints(time, [NAMES[i] for i in order], [q[i] for i in order])
        record.add_joints(time, ["finger"], [time])
        record.add_pose(time, [value + 1e-5 * (-1) ** k for value in x], [part * (-1) ** k for part in xyzw])


def test_a_row_a_call_makes_a_measurement_file(recorder, tmp_path) -> None:
    robot = fastcal.load_robot("ur5")
    q = np.random.default_rng(0).uniform(-2, 2, (3, 6))
    record = recorder.Recorder(str(tmp_path / "out.csv"), NAMES)
    half = np.sqrt(0.5)
    for row, (joints, x) in enumerate(zip(q, robot.forward(q)[:, :3, 3], strict=True)):
        stand(record, joints, x, 100.0 * row, (half, 0.0, 0.0, half))
        done, said = record.capture()
        assert done, said
    data = fastcal.load_measurements(tmp_path / "out.csv", robot)
    np.testing.assert_allclose(data.q, q, atol=1e-12)
    np.testing.assert_allclose(data.position, robot.forward(q)[:, :3, 3], atol=2e-6)
    np.testing.assert_allclose(np.abs(data.rotation), [[half, half, 0, 0]] * 3, atol=1e-12)
    np.testing.assert_allclose(data.time, [1.95, 101.95, 201.95], atol=1e-9)


def test_a_moving_arm_and_a_silent_tracker_are_not_written(recorder, tmp_path) -> None:
    record = recorder.Recorder(str(tmp_path / "out.csv"), NAMES)
    assert record.capture() == (False, "no joint states within the last 1 s")
    stand(record, np.zeros(6), [1, 0, 0], 0.0)
    record.add_joints(2.0, NAMES, [0, 0, 0.01, 0, 0, 0])
    assert record.capture() == (False, "elbow moved within the last 1 s: wait, and call again")
    for k in range(40):
        record.add_joints(10 + 0.05 * k, NAMES, np.zeros(6))
    assert record.capture() == (False, "no poses within the last 1 s")
    assert not (tmp_path / "out.csv").exists()


def test_the_node_is_wired(recorder, tmp_path, monkeypatch) -> None:
    subscriptions, services = {}, {}
    given = {"output": str(tmp_path / "out.csv"), "window_s": 0.5, "joint_names": ["a", "b"]}

    class Node:
        def declare_parameter(self, name, default):
            return SimpleNamespace(value=given.get(name, default))

        def create_subscription(self, kind, topic, callback, depth):
            subscriptions[topic] = (kind, callback)

        def create_service(self, kind, name, callback):
            services[name] = callback

        def get_logger(self):
            return SimpleNamespace(info=lambda text: None)

    def spin(node) -> None:
        stamp = SimpleNamespace(sec=5, nanosec=500_000_000)
        position, turn = SimpleNamespace(x=1.0, y=2.0, z=3.0), SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0)
        head = SimpleNamespace(stamp=stamp)
        for _ in range(2):
            subscriptions["/joint_states"][1](SimpleNamespace(header=head, name=["b", "a"], position=[0.2, 0.1]))
        subscriptions["/tracker/pose"][1](
            SimpleNamespace(header=head, pose=SimpleNamespace(position=position, orientation=turn))
        )
        answer = services["~/capture"](None, SimpleNamespace())
        assert answer.success, answer.message

    fakes = {
        "rclpy": {"init": lambda: None, "create_node": lambda name: Node(), "spin": spin},
        "geometry_msgs.msg": {"PoseStamped": object},
        "sensor_msgs.msg": {"JointState": object},
        "std_srvs.srv": {"Trigger": object},
    }
    for name, members in fakes.items():
        module = types.ModuleType(name)
        module.__dict__.update(members)
        monkeypatch.setitem(sys.modules, name, module)
        monkeypatch.setitem(sys.modules, name.partition(".")[0], types.ModuleType(name) if "." in name else module)
    recorder.main()
    assert (tmp_path / "out.csv").read_text() == (
        "q1_rad,q2_rad,x_m,y_m,z_m,qw,qx,qy,qz,time_s\n0.1,0.2,1.0,2.0,3.0,1.0,0.0,0.0,0.0,5.5\n"
    )
