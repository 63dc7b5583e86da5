# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Hand-eye from flange poses, and a camera's place in the files of other programs, read by these programs' readers."""

import json
import sys
import types
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pinocchio
import pytest
import yaml
from numpy.typing import NDArray

from fastcal.calibration.hand_eye import gross, hand_eye
from fastcal.cells.pose_arm import pose_joints
from fastcal.cli import main
from fastcal.errors import InvalidInput
from fastcal.io.hand_eye_file import hand_eye_texts
from fastcal.io.tree_file import cell_text, load_cell
from fastcal.robot.hand_eye import HandEye, hand_eyes
from fastcal.robot.robot_spec import RobotSpec, structured

from . import camera_scene as scene
from .camera_scene import pose
from .test_calibrate import csv_of, simulated, written

FloatArray = NDArray[np.float64]

X = pose((50.0, -70.0, 100.0), (170.0, 10.0, 40.0))  # mm: the camera on the flange, and the board in the room
Y = pose((800.0, 100.0, 20.0), (5.0, -170.0, 20.0))
# The keys of easy_handeye2's own file tests/data/easy_handeye2_demo_eih.calib.
CALIB_PARAMETERS = [
    "name",
    "calibration_type",
    "robot_base_frame",
    "robot_effector_frame",
    "tracking_base_frame",
    "tracking_marker_frame",
    "freehand_robot_movement",
    "move_group_namespace",
    "move_group",
]


def flange_poses(count: int, seed: int, *, one_axis: bool = False) -> list[FloatArray]:
    random = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        turn = random.uniform(-50, 50, 3) * ([0, 0, 1] if one_axis else [1, 1, 1])
        place = random.uniform(-300, 300, 3) + np.array([600.0, 0.0, 600.0])
        out.append(pose(tuple(place), (180 + turn[0], turn[1], turn[2])))
    return out


def seen(A: FloatArray, random: np.random.Generator) -> FloatArray:
    noise = pose(tuple(random.normal(0, 0.3, 3)), tuple(random.normal(0, 0.05, 3)))
    return np.linalg.inv(A @ X) @ Y @ noise


def wxyz(T: FloatArray) -> FloatArray:
    q = np.zeros(4)
    pinocchio.Quaternion(T[:3, :3])
    q[1:], q[0] = pinocchio.Quaternion(T[:3, :3]).coeffs()[:3], pinocchio.Quaternion(T[:3, :3]).coeffs()[3]
    return q


def write_poses(folder: Path, count: int = 25, *, wrong: int = -1, one_axis: bool = False) -> tuple[str, str]:
    """cell.yaml and poses.csv of an arm of which only the flange is known."""
    random = np.random.default_rng(3)
    rows = []
    for k, A in enumerate(flange_poses(count, 2, one_axis=one_axis)):
        S = seen(A, random)
        if k == wrong:
            S = S @ pose((100.0, 0.0, 0.0), (17.0, 0.0, 0.0))
        rows.append(",".join(f"{v:.9f}" for v in [*A[:3, 3], *wxyz(A), *S[:3, 3], *wxyz(S)]))
    names = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"]
    titles = [f"arm.{name}" for name in names] + [f"{name}@board:camera" for name in names]
    (folder / "poses.csv").write_text("\n".join([",".join(titles), *rows]) + "\n")
    cell = {"arms": {"arm": {"robot": "pose"}}, "sensors": {"camera": {"on": "arm"}}, "targets": {"board": {}}}
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell))
    return str(folder / "cell.yaml"), str(folder / "poses.csv")


def test_the_closed_form_needs_no_guess_and_leaves_out_a_pose_that_is_wrong() -> None:
    A = np.array(flange_poses(12, 1))
    S = np.array([np.linalg.inv(a @ X) @ Y for a in A])
    found = hand_eye(A, S)
    assert found is not None
    np.testing.assert_allclose(found[0], X, atol=1e-7)
    np.testing.assert_allclose(found[1], Y, atol=1e-6)
    S[4] = S[4] @ pose((200.0, 0.0, 0.0), (40.0, 0.0, 0.0))
    found = hand_eye(A, S)
    assert found is not None
    np.testing.assert_allclose(found[0], X, atol=1e-7)
    assert hand_eye(A[:2], S[:2]) is None


@pytest.mark.parametrize("seed", range(5))
def test_half_of_the_poses_may_be_wrong(seed: int, tmp_path: Path) -> None:
    random = np.random.default_rng(seed)
    A = np.array(flange_poses(24, 40 + seed))
    S = np.array([seen(a, random) for a in A])
    A[:, :3, 3], S[:, :3, 3] = 1e-3 * A[:, :3, 3], 1e-3 * S[:, :3, 3]
    wrong = random.choice(24, 12, replace=False)
    for k in wrong:
        S[k] = pose(tuple(random.uniform(-1, 1, 3)), tuple(random.uniform(-180, 180, 3)))
    found = hand_eye(A, S)
    assert found is not None
    assert np.linalg.norm(1e3 * found[0][:3, 3] - X[:3, 3]) < 3.0
    assert set(np.flatnonzero(gross(A, S, *found))) == set(wrong)


def test_a_command_with_half_of_the_rows_wrong_names_them(tmp_path: Path) -> None:
    cell, poses = write_poses(tmp_path, 24)
    lines = Path(poses).read_text().splitlines()
    wrong = list(range(0, 24, 2))
    for k in wrong:
        own, other = lines[1 + k].split(","), lines[1 + (k + 7) % 24].split(",")
        lines[1 + k] = ",".join([*own[:7], *other[7:]])
    Path(poses).write_text("\n".join(lines) + "\n")
    assert main(["calibrate", cell, poses, "-o", str(tmp_path / "out")]) == 0
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert set(wrong) <= set(result["outliers"])
    model = yaml.safe_load((tmp_path / "out" / "model.yaml").read_text())
    assert np.linalg.norm(np.array(model["sensors"]["camera"]["xyz_mm"]) - X[:3, 3]) < 2.0


def test_three_poses_are_enough(tmp_path: Path) -> None:
    cell, poses = write_poses(tmp_path, 3)
    assert main(["calibrate", cell, poses, "-o", str(tmp_path / "out")]) == 0


def test_joints_of_a_pose_give_the_pose_back(tmp_path: Path) -> None:
    """The slides and turns that stand for an arm of poses, also where its second turn is 90 degrees."""
    cell = load_cell(write_poses(tmp_path)[0])
    arm = cell.arms[0].robot
    T = np.array([*flange_poses(5, 7), pose((1.0, 2.0, 3.0), (20.0, 90.0, 30.0))])
    q = pose_joints(T[:, :3, 3] / 1000, np.array([wxyz(each) for each in T]))
    there = arm.forward(q)
    there[:, :3, 3] *= 1000
    np.testing.assert_allclose(there, T, atol=1e-6)


def test_poses_alone_calibrate_a_camera_and_name_the_wrong_row(tmp_path: Path) -> None:
    cell, poses = write_poses(tmp_path, wrong=7)
    out, calib = tmp_path / "out", tmp_path / "camera.calib"
    assert main(["calibrate", cell, poses, "-o", str(out), "--hand-eye", str(calib)]) == 0
    result = json.loads((out / "result.json").read_text())
    assert result["outliers"] == [7]
    # No parameter of the arm itself.
    assert {parameter["owner"] for parameter in result["parameters"]} == {"camera", "board"}
    model = yaml.safe_load((out / "model.yaml").read_text())
    assert model["arms"]["arm"]["robot"] == "pose"
    std = np.array([parameter["std"] for parameter in result["parameters"][:3]])
    assert (np.abs(np.array(model["sensors"]["camera"]["xyz_mm"]) - X[:3, 3]) < 4 * std).all()
    written = yaml.safe_load(calib.read_text())
    np.testing.assert_allclose([written["transform"]["translation"][k] * 1000 for k in "xyz"], X[:3, 3], atol=0.6)
    assert load_cell(out / "model.yaml").arms[0].of_poses


def test_what_turns_about_one_axis_do_not_show_is_said(tmp_path: Path) -> None:
    cell, poses = write_poses(tmp_path, one_axis=True)
    assert main(["calibrate", cell, poses, "-o", str(tmp_path / "out")]) in (0, 3)
    assert json.loads((tmp_path / "out" / "result.json").read_text())["unidentifiable"]


def test_a_pose_without_a_part_or_a_unit_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell, poses = write_poses(tmp_path, 5)
    text = Path(poses).read_text()
    for old, new, said in (
        ("arm.qz,", "other,", "no column arm.qz"),
        ("arm.x_mm", "arm.x", "needs a unit of length"),
        ("arm.qy", "arm.qx", "comes twice"),
    ):
        Path(poses).write_text(text.replace(old, new))
        assert main(["calibrate", cell, poses, "-o", str(tmp_path / "out")]) == 2
        assert said in capsys.readouterr().err
    lines = text.splitlines()
    cells = lines[2].split(",")
    Path(poses).write_text("\n".join([*lines[:2], ",".join([*cells[:3], "3", *cells[4:]]), *lines[3:]]) + "\n")
    assert main(["calibrate", cell, poses, "-o", str(tmp_path / "out")]) == 2
    assert "quaternion of length 1" in capsys.readouterr().err


def camera(*, in_hand: bool = True, lens: bool = True) -> HandEye:
    T = X.copy()
    T[:3, 3] /= 1000
    given: dict[str, Any] = {"focal_px": [1400.0, 1402.0], "centre_px": [640.5, 512.0], "size_px": [1280, 1024]}
    given |= {"distortion": [-0.11, 0.09, 2e-4, -3e-4, 0.0], "model": "pinhole"}
    std = np.array([1e-5, 2e-5, 3e-5, 1e-4, 2e-4, 3e-4])
    return HandEye("wrist", "tool0" if in_hand else "base", T, std, in_hand, lens=given if lens else None)


def text_of(name: str, **more: bool) -> str:
    (text,) = hand_eye_texts([camera(**more)], Path(name)).values()
    return text


@pytest.mark.parametrize("name", ["c.yaml", "c.yml", "c.xml", "c.json"])
def test_opencv_reads_its_storage(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(text_of(name))
    file = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(file.getNode("T_gripper_camera").mat(), camera().T_parent_camera)
    np.testing.assert_array_equal(file.getNode("camera_matrix").mat(), [[1400, 0, 640.5], [0, 1402, 512], [0, 0, 1]])
    np.testing.assert_array_equal(file.getNode("distortion_coefficients").mat(), [[-0.11, 0.09, 2e-4, -3e-4, 0.0]])
    assert (file.getNode("camera").string(), file.getNode("image_width").real()) == ("wrist", 1280)


def test_easy_handeye2_finds_its_keys() -> None:
    for in_hand, kind in ((True, "eye_in_hand"), (False, "eye_on_base")):
        content = yaml.safe_load(text_of("c.calib", in_hand=in_hand))
        assert list(content) == ["parameters", "transform"]
        assert list(content["parameters"]) == CALIB_PARAMETERS
        assert content["parameters"]["calibration_type"] == kind
        q = content["transform"]["rotation"]
        R = pinocchio.Quaternion(q["w"], q["x"], q["y"], q["z"]).matrix()
        np.testing.assert_allclose(R, X[:3, :3], atol=1e-12)


def test_a_launch_file_publishes_the_transform(monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins for ROS' two classes, which keep what they are given."""
    launch, ros, actions = (types.ModuleType(name) for name in ("launch", "launch_ros", "launch_ros.actions"))
    launch.LaunchDescription = list  # type: ignore[attr-defined]
    actions.Node = dict  # type: ignore[attr-defined]
    for module in (launch, ros, actions):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    names: dict[str, Any] = {}
    exec(compile(text_of("c.launch.py"), "c.launch.py", "exec"), names)  # noqa: S102 - our own text
    (node,) = names["generate_launch_description"]()
    given = dict(zip(node["arguments"][::2], node["arguments"][1::2], strict=True))
    assert (node["executable"], given["--frame-id"], given["--child-frame-id"]) == (
        "static_transform_publisher",
        "tool0",
        "wrist",
    )
    q = [float(given[f"--q{axis}"]) for axis in "wxyz"]
    np.testing.assert_allclose(pinocchio.Quaternion(*q).matrix(), X[:3, :3], atol=1e-12)
    assert [float(given[f"--{axis}"]) for axis in "xyz"] == pytest.approx(list(X[:3, 3] / 1000))


def test_pinocchio_reads_the_urdf(tmp_path: Path) -> None:
    (tmp_path / "c.urdf").write_text(text_of("c.urdf"))
    model = pinocchio.buildModelFromUrdf(str(tmp_path / "c.urdf"))
    placed = model.frames[model.getFrameId("wrist")].placement
    np.testing.assert_allclose(placed.homogeneous, camera().T_parent_camera, atol=1e-12)


def test_camera_info_has_what_ros_asks_for() -> None:
    content = yaml.safe_load(text_of("wrist_camera_info.yaml"))
    keys = ["image_width", "image_height", "camera_name", "camera_matrix", "distortion_model"]
    keys += ["distortion_coefficients", "rectification_matrix", "projection_matrix"]
    assert list(content) == keys
    assert content["distortion_model"] == "plumb_bob"
    assert content["projection_matrix"] == {
        "rows": 3,
        "cols": 4,
        "data": [1400.0, 0.0, 640.5, 0.0, 0.0, 1402.0, 512.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
    with pytest.raises(InvalidInput, match="no lens here"):
        text_of("camera_info.yaml", lens=False)


def test_several_cameras_get_a_file_each_and_an_unknown_ending_is_refused() -> None:
    assert sorted(path.name for path in hand_eye_texts([camera(), camera()], Path("a/c.calib"))) == ["c_wrist.calib"]
    with pytest.raises(InvalidInput, match="easy_handeye2"):
        hand_eye_texts([camera()], Path("c.txt"))


def test_a_camera_in_the_room_is_given_in_the_base() -> None:
    spec = {"base": {"xyz_mm": [100.0, 0, 0], "rpy_deg": [0, 0, 90.0]}, "cameras": {}}
    spec["cameras"]["room"] = {"on": "world", "xyz_mm": [100.0, 500.0, 0], "rpy_deg": [0.0, 0, 0]}
    spec["cameras"]["elbow"] = {"on": "arm.link3", "xyz_mm": [1.0, 2, 3], "rpy_deg": [0.0, 0, 0]}
    joints = {"name": "arm", "kinematics": "dh", "joints": []}
    room, elbow = hand_eyes(structured(RobotSpec, spec | joints))
    np.testing.assert_allclose(room.T_parent_camera[:3, 3], [0.5, 0.0, 0.0], atol=1e-12)
    assert (room.parent, room.in_hand, elbow.parent, elbow.in_hand) == ("base_link", False, "link3", True)
    with pytest.raises(InvalidInput, match="no camera"):
        hand_eyes(structured(RobotSpec, joints))


def test_a_cell_of_poses_is_written_as_it_was_read(tmp_path: Path) -> None:
    cell = load_cell(write_poses(tmp_path)[0])
    (tmp_path / "again.yaml").write_text(cell_text(cell))
    assert cell_text(load_cell(tmp_path / "again.yaml")) == cell_text(cell)


def test_a_hand_eye_says_to_which_arm_it_belongs(tmp_path: Path) -> None:
    """Used with the controller's nominal arm, that of the identified one is off by what its last joint was wrong."""
    scene.write(tmp_path, 16, 1, error_mm=0.5)
    given = [str(tmp_path / "cell.yaml"), str(tmp_path / "poses.csv"), "--corners", str(tmp_path / "corners.csv")]
    for name, more in (("own", []), ("as_it_is", ["--effects", "none"])):
        out = ["-o", str(tmp_path / name), "--hand-eye", str(tmp_path / f"{name}.calib")]
        assert main(["calibrate", *given, *more, *out]) == 0
    note = "# Found with the arm of model.yaml; for the arm as its file says: calibrate --effects none"
    assert note in (tmp_path / "own.calib").read_text()
    assert note not in (tmp_path / "as_it_is.calib").read_text()
    found = json.loads((tmp_path / "as_it_is" / "result.json").read_text())
    assert found["parameters"]
    assert not any(of["owner"].startswith("joint") for of in found["parameters"])


def test_arms_of_a_cell_stay_as_they_are_where_that_is_asked_for(tmp_path: Path) -> None:
    arms = {"left": {"robot": "ur5"}, "right": {"robot": "ur5", "xyz_mm": [0, -900, 0]}}
    targets = {"a": {"on": "left"}, "b": {"on": "right"}}
    file = written(tmp_path, {"cell": "two", "arms": arms, "targets": targets})
    cell = load_cell(file)
    readings = simulated(cell, np.random.default_rng(1), 30, {"a": "point", "b": "point"})
    head = [f"{arm}.q{k}_rad" for arm in arms for k in range(1, 7)] + [f"{of}_m@{p}" for p in "ab" for of in "xyz"]
    rows = np.hstack([readings.q, readings.tables["position@a"], readings.tables["position@b"]])
    poses = csv_of(tmp_path, head, rows.tolist())
    assert main(["calibrate", str(file), str(poses), "--effects", "none", "-o", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    assert {of["owner"] for of in found["parameters"]} == {"left.base", "right.base", "a", "b"}
