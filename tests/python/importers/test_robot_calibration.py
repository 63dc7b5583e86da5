# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Bags of robot_calibration, written by rosbags with its message definitions, through to a camera's place."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from fastcal.calibration.moving_rig import frames_of
from fastcal.cli import main
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose

FloatArray = NDArray[np.float64]

# robot_calibration_msgs of mikeferguson/robot_calibration (Apache-2.0), by their fields.
MESSAGES = {
    "CameraParameter": "string name\nfloat64 value\n",
    "ExtendedCameraInfo": "sensor_msgs/CameraInfo camera_info\nCameraParameter[] parameters\n",
    "Observation": "string sensor_name\ngeometry_msgs/PointStamped[] features\nExtendedCameraInfo ext_camera_info\n"
    "sensor_msgs/PointCloud2 cloud\nsensor_msgs/Image image\n",
    "CalibrationData": "sensor_msgs/JointState joint_states\nObservation[] observations\n",
}
NAMES = [f"joint_{k}" for k in range(1, 7)]
X = pose({"xyz_mm": [900.0, 100.0, 700.0], "rpy_deg": [-110.0, 5.0, 80.0]})  # the camera, in the room
Y = pose({"xyz_mm": [20.0, -10.0, 90.0], "rpy_deg": [10.0, 20.0, 30.0]})  # the board, on the flange
COUNT = 15


def urdf() -> str:
    """Six joints with the names that the bag has."""
    out, parent = ['<robot name="six"><link name="base"/>'], "base"
    axes = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
    for name, axis, z in zip(NAMES, axes, (0.2, 0.1, 0.4, 0.3, 0.1, 0.1), strict=True):
        out.append(
            f'<link name="{name}_link"/><joint name="{name}" type="revolute"><origin xyz="0.02 0 {z}"/>'
            f'<parent link="{parent}"/><child link="{name}_link"/><axis xyz="{axis}"/>'
            '<limit lower="-3" upper="3" effort="9" velocity="9"/></joint>'
        )
        parent = f"{name}_link"
    return "".join([*out, "</robot>"])


def observation(types: Any, name: str, points: FloatArray, *, is_camera: bool) -> Any:
    header = types["std_msgs/msg/Header"](0, types["builtin_interfaces/msg/Time"](1, 0), f"{name}_frame")
    features = [
        types["geometry_msgs/msg/PointStamped"](header, types["geometry_msgs/msg/Point"](*map(float, p)))
        for p in points
    ]
    K = np.array([500.0, 0, 320, 0, 500, 240, 0, 0, 1]) if is_camera else np.zeros(9)
    roi = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    info = types["sensor_msgs/msg/CameraInfo"](
        header, 480, 640, "plumb_bob", np.zeros(5), K, np.zeros(9), np.zeros(12), 0, 0, roi
    )
    empty = np.zeros(0, dtype=np.uint8)
    return types["robot_calibration_msgs/msg/Observation"](
        name,
        features,
        types["robot_calibration_msgs/msg/ExtendedCameraInfo"](info, []),
        types["sensor_msgs/msg/PointCloud2"](header, 0, 0, [], False, 0, 0, empty, False),
        types["sensor_msgs/msg/Image"](header, 0, 0, "", 0, 0, empty),
    )


def written(folder: Path, *, depth: bool = True) -> tuple[Path, FloatArray]:
    """The arm, and a bag in which the last sample has lost its points."""
    (folder / "six.urdf").write_text(urdf())
    store = get_typestore(Stores.ROS1_NOETIC)
    for name, text in MESSAGES.items():
        store.register(get_types_from_msg(text, f"robot_calibration_msgs/msg/{name}"))
    random, types = np.random.default_rng(8), store.types
    q = random.uniform(-1.2, 1.2, (COUNT, 6))
    flange = frames_of(load_robot(folder / "six.urdf"), q, "arm")
    board = np.array([[0.03 * i, 0.03 * j, 0.0] for i in range(5) for j in range(4)])
    path = folder / "calibration_data.bag"
    with Writer(path) as bag:
        kind = "robot_calibration_msgs/msg/CalibrationData"
        connection = bag.add_connection("/calibration_data", kind, typestore=store)
        for k, (joints, F) in enumerate(zip(q, flange, strict=True)):
            S = np.linalg.inv(X) @ F @ Y
            seen = board @ S[:3, :3].T + S[:3, 3] + 2e-4 * random.standard_normal(board.shape)
            seen[:, 2] *= depth
            header = types["std_msgs/msg/Header"](k, types["builtin_interfaces/msg/Time"](k, 0), "")
            names, order = [*NAMES[::-1], "gripper"], np.append(joints[::-1], 0.02)
            state = types["sensor_msgs/msg/JointState"](header, names, order, np.zeros(7), np.zeros(7))
            last = k == COUNT - 1
            pair = [
                observation(types, "camera", seen[: 2 if last else None], is_camera=True),
                observation(types, "arm", board, is_camera=False),
            ]
            message = types[kind](state, pair)
            bag.write(connection, k * 10**9, store.serialize_ros1(message, kind))
    return path, q


def test_from_the_bag_to_the_camera(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, q = written(tmp_path)
    table = tmp_path / "poses.csv"
    assert main(["import", str(bag), "--robot", str(tmp_path / "six.urdf"), "-o", str(table)]) == 0
    said = capsys.readouterr().out
    assert "1 samples show no board by depth and were left out" in said
    assert "14 pairs of poses; read as robot_calibration's data" in said
    first = [float(v) for v in table.read_text().splitlines()[1].split(",")[:6]]
    np.testing.assert_allclose(first, np.degrees(q[0]), atol=1e-6)
    cell = yaml.safe_load((tmp_path / "poses_cell.yaml").read_text())
    assert cell["arms"] == {"arm": {"robot": "six.urdf"}}
    assert cell["sensors"]["camera"]["on"] == "world"
    out = tmp_path / "out"
    words = [str(tmp_path / "poses_cell.yaml"), str(table), "-o", str(out), "--hand-eye", str(tmp_path / "c.calib")]
    assert main(["calibrate", *words]) == 0
    place = yaml.safe_load((tmp_path / "c.calib").read_text())["transform"]["translation"]
    np.testing.assert_allclose([place[axis] for axis in "xyz"], X[:3, 3], atol=2e-2)


def test_what_cannot_be_read_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag, _ = written(tmp_path, depth=False)
    words = ["import", str(bag), "-o", str(tmp_path / "poses.csv")]
    for more, said in (
        ([], "give the arm that was calibrated (--robot)"),
        (["--robot", "ur5e"], "names its joints, and"),
        (["--robot", str(tmp_path / "six.urdf")], "a camera with depth and a chain saw both"),
    ):
        assert main([*words, *more]) == 2
        assert said in capsys.readouterr().err
