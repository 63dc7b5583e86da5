# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Hand-eye samples of other programs, in the forms that their own repositories hold, through to a camera's place."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from fastcal import _core
from fastcal.calibration.hand_eye import hand_eye
from fastcal.cli import main
from fastcal.errors import InvalidInput
from fastcal.importers.pose_lists import read_pose_list
from fastcal.importers.pose_pairs import read_pose_pairs
from fastcal.robot.core_model import pose

FloatArray = NDArray[np.float64]

X = pose({"xyz_mm": [50.0, -70.0, 100.0], "rpy_deg": [170.0, 10.0, 40.0]})
Y = pose({"xyz_mm": [800.0, 100.0, 20.0], "rpy_deg": [5.0, -170.0, 20.0]})
COUNT = 12


def sessions(*, in_hand: bool = True) -> tuple[FloatArray, FloatArray]:
    """(N, 4, 4) of the flange in the base and of the board in the camera; X is the camera's place, Y the board's."""
    random = np.random.default_rng(5)
    places, turns = random.uniform(300, 900, (COUNT, 3)), random.uniform(-60, 60, (COUNT, 3))
    given = zip(places.tolist(), turns.tolist(), strict=True)
    flange = np.array([pose({"xyz_mm": p, "rpy_deg": rpy}) for p, rpy in given])
    A = flange if in_hand else np.linalg.inv(flange)
    noise = [np.eye(4) for _ in range(COUNT)]
    for each in noise:
        each[:3, 3] = random.normal(0, 2e-4, 3)
    return flange, np.array([np.linalg.inv(a @ X) @ Y @ e for a, e in zip(A, noise, strict=True)])


def ros(T: FloatArray) -> dict[str, Any]:
    """A geometry_msgs/Transform; its message takes the same fields."""
    types = get_typestore(Stores.ROS2_HUMBLE).types
    q = quaternion(T)
    vector = types["geometry_msgs/msg/Vector3"](*T[:3, 3].tolist())
    turn = types["geometry_msgs/msg/Quaternion"](q[1], q[2], q[3], q[0])
    return {
        "translation": {key: float(getattr(vector, key)) for key in "xyz"},
        "rotation": {key: float(getattr(turn, key)) for key in "xyzw"},
    }


def quaternion(T: FloatArray) -> list[float]:
    """w x y z by OpenCV's rotation vector."""
    turn = cv2.Rodrigues(T[:3, :3])[0].ravel()
    angle = float(np.linalg.norm(turn))
    return [float(np.cos(angle / 2)), *(np.sin(angle / 2) * turn / angle).tolist()]


def easy_handeye2(folder: Path, flange: FloatArray, seen: FloatArray, kind: str = "") -> list[Path]:
    parameters = {"name": "", "calibration_type": kind, "robot_base_frame": "", "move_group": "manipulator"}
    robot = np.linalg.inv(flange) if kind == "eye_on_base" else flange
    samples = [{"robot": ros(a), "tracking": ros(s)} for a, s in zip(robot, seen, strict=True)]
    (folder / "demo.samples").write_text(yaml.safe_dump({"parameters": parameters, "samples": samples}))
    return [folder / "demo.samples"]


def moveit(folder: Path, flange: FloatArray, seen: FloatArray) -> list[Path]:
    pairs = zip(flange, seen, strict=True)
    content = [{"effector_wrt_world": a.ravel().tolist(), "object_wrt_sensor": s.ravel().tolist()} for a, s in pairs]
    (folder / "pose_samples.json").write_text(json.dumps(content))
    return [folder / "pose_samples.json"]


def visp(folder: Path, flange: FloatArray, seen: FloatArray) -> list[Path]:
    for name, poses in (("rPe", flange), ("cPo", seen)):
        for k, T in enumerate(poses, start=1):
            numbers = [*T[:3, 3], *cv2.Rodrigues(T[:3, :3])[0].ravel()]
            lines = "".join(f"  - [{v:.9g}]\n" for v in numbers)
            (folder / f"franka_pose_{name}_{k}.yaml").write_text(f"rows: 6\ncols: 1\ndata:\n{lines}")
    return [folder]


def tum(folder: Path, flange: FloatArray, seen: FloatArray) -> list[Path]:
    for name, poses, late in (("arm", flange, 0.0), ("board", seen, 0.02)):
        lines = ["# timestamp tx ty tz qx qy qz qw"]
        for k, T in enumerate(poses):
            w, x, y, z = quaternion(T)
            lines.append(" ".join(f"{v:.9f}" for v in [1.7e9 + 2 * k + late, *T[:3, 3], x, y, z, w]))
        order = [lines[0], *(lines[1:] if name == "arm" else lines[:0:-1])]  # any order: times say it
        (folder / f"{name}.txt").write_text("\n".join(order) + "\n")
    return [folder / "arm.txt", folder / "board.txt"]


def matrices(folder: Path, flange: FloatArray, seen: FloatArray) -> list[Path]:
    np.save(folder / "arm.npy", flange)
    np.savetxt(folder / "board.txt", seen.reshape(-1, 4))
    return [folder / "arm.npy", folder / "board.txt"]


def vectors(folder: Path, flange: FloatArray, seen: FloatArray) -> list[Path]:
    (folder / "arm.json").write_text(json.dumps(flange.tolist()))
    rows = [[*T[:3, 3] * 1000, *cv2.Rodrigues(T[:3, :3])[0].ravel()] for T in seen]
    title = "tvec_x_mm,tvec_y_mm,tvec_z_mm,rvec_x,rvec_y,rvec_z"
    (folder / "board.csv").write_text("\n".join([title, *(",".join(f"{v:.9f}" for v in row) for row in rows)]) + "\n")
    return [folder / "arm.json", folder / "board.csv"]


Writer = Callable[[Path, FloatArray, FloatArray], list[Path]]


@pytest.mark.parametrize("write", [easy_handeye2, moveit, visp, tum, matrices, vectors], ids=lambda f: f.__name__)
def test_samples_become_a_cameras_place(tmp_path: Path, write: Writer, capsys: pytest.CaptureFixture[str]) -> None:
    given = tmp_path / "given"
    given.mkdir()
    files = write(given, *sessions())
    asked = ["--hand-eye"] if len(files) == 2 else []
    table, calib = tmp_path / "poses.csv", tmp_path / "camera.calib"
    assert main(["import", *map(str, files), *asked, "-o", str(table)]) == 0
    cell = tmp_path / "poses_cell.yaml"
    assert f"next: fastcal calibrate {cell}" in capsys.readouterr().out
    assert main(["calibrate", str(cell), str(table), "-o", str(tmp_path / "out"), "--hand-eye", str(calib)]) == 0
    content = yaml.safe_load(calib.read_text())
    found = content["transform"]
    assert content["parameters"]["calibration_type"] == "eye_in_hand"
    np.testing.assert_allclose([found["translation"][key] for key in "xyz"], X[:3, 3], atol=5e-4)
    R = np.asarray(_core.quaternion_to_rotation(np.array([found["rotation"][key] for key in "wxyz"])))
    np.testing.assert_allclose(R, X[:3, :3], atol=1e-3)


@pytest.mark.parametrize("kind", ["eye_on_base", ""])
def test_a_camera_in_the_room_is_known_by_its_poses(tmp_path: Path, kind: str) -> None:
    flange, seen = sessions(in_hand=False)
    found = read_pose_pairs(easy_handeye2(tmp_path, flange, seen, kind))
    assert found is not None
    assert found.in_hand is False
    np.testing.assert_allclose(found.flange, flange, atol=1e-9)
    np.testing.assert_allclose(found.seen, seen, atol=1e-9)


@pytest.mark.parametrize(("count", "doubtful"), [(3, True), (4, False)])
def test_three_pairs_cannot_say_where_the_camera_is(tmp_path: Path, count: int, doubtful: bool) -> None:
    """The motions between three poses, and between their inverses, are alike."""
    flange, seen = sessions(in_hand=False)
    found = read_pose_pairs(easy_handeye2(tmp_path, flange[:count], seen[:count]))
    assert found is not None
    assert found.in_hand is doubtful
    assert doubtful is any("about as well with a camera on the arm as with one in the room" in n for n in found.notes)


def test_poses_that_agree_the_other_way_are_refused_where_the_file_says_which(tmp_path: Path) -> None:
    flange, seen = sessions()
    with pytest.raises(InvalidInput, match="as eye_in_hand the poses do not agree"):
        read_pose_pairs(easy_handeye2(tmp_path, np.linalg.inv(flange), seen, "eye_in_hand"))
    with pytest.raises(InvalidInput, match="are inverse"):
        read_pose_pairs(easy_handeye2(tmp_path, flange, seen, "eye_on_base"))


def test_what_is_no_pose_is_refused_by_its_row(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flange, seen = sessions()
    flange[3, :3, :3] *= 1.1
    (file,) = moveit(tmp_path, flange, seen)
    assert main(["import", str(file), "-o", str(tmp_path / "poses.csv")]) == 2
    assert "pose 3: is no pose" in capsys.readouterr().err
    (tmp_path / "few.txt").write_text("1 2 3\n4 5 6\n")
    assert main(["import", str(tmp_path / "few.txt"), "--hand-eye", "-o", str(tmp_path / "poses.csv")]) == 2
    assert "two lists of poses" in capsys.readouterr().err
    given = [str(tmp_path / "few.txt")] * 2
    assert main(["import", *given, "--hand-eye", "-o", str(tmp_path / "poses.csv")]) == 2
    assert "got 3 numbers a pose" in capsys.readouterr().err


def test_lines_of_twelve_numbers_are_matrices_without_their_last_row(tmp_path: Path) -> None:
    flange, _ = sessions()
    np.savetxt(tmp_path / "kitti.txt", flange[:, :3].reshape(-1, 12))
    np.testing.assert_allclose(read_pose_list(tmp_path / "kitti.txt").T, flange, atol=1e-12)


def test_seven_pairs_that_turn_about_few_axes_are_read_the_right_way(tmp_path: Path) -> None:
    """Half turns about axes in a plane, as a hand that looks down has them: some agree the other way round too."""
    turns = [(180, 0, -45), (140, 0, -45), (220, 0, -45), (180, 25, -45), (180, -25, -45), (180, 0, 8), (180, 0, -46)]
    flange = np.array([pose({"xyz_mm": [307.0, 0.0, 590.0], "rpy_deg": [float(v) for v in turn]}) for turn in turns])
    mount = pose({"xyz_mm": [120.0, 210.0, 140.0], "rpy_deg": [0.0, 0.0, 0.0]})
    board = pose({"xyz_mm": [1000.0, 0.0, 500.0], "rpy_deg": [0.0, 0.0, 0.0]})
    seen = np.array([np.linalg.inv(A @ mount) @ board for A in flange])
    found = read_pose_pairs(easy_handeye2(tmp_path, flange, seen))
    assert found is not None
    assert found.in_hand
    solved = hand_eye(found.flange, found.seen)
    assert solved is not None
    np.testing.assert_allclose(solved[0], mount, atol=1e-6)


WXYZ, METRES = (3, 0, 1, 2), 1.0
MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "the board's quaternions": ({"board": WXYZ}, "are the quaternions of the board's poses w x y z, read as x y z w?"),
    "the arm's quaternions": ({"arm": WXYZ}, "are the quaternions of the arm's poses w x y z, read as x y z w?"),
    "both quaternions": ({"arm": WXYZ, "board": WXYZ}, "are the quaternions of both w x y z"),
    "the arm in mm": ({"arm_size": 1e3}, "are the lengths in mm?"),
    "the board in mm": ({"board_size": 1e3}, "times those of the arm, one in another unit?"),
    "slipped": ({"slip": 1}, "are the board's poses shifted by 1 rows?"),
}


def lists(
    folder: Path,
    seed: int,
    *,
    arm: Sequence[int] = (0, 1, 2, 3),
    board: Sequence[int] = (0, 1, 2, 3),
    arm_size: float = METRES,
    board_size: float = METRES,
    slip: int = 0,
    exchanged: Sequence[int] = (),
) -> list[str]:
    """Two lists of x y z qx qy qz qw of pairs, with a mistake; `slip` of the board's poses."""
    random = np.random.default_rng(seed)
    pairs = sessions(in_hand=bool(seed % 2))
    flange, seen = (T.copy() for T in pairs)
    for T in (flange, seen):
        T[:, :3, 3] += 3e-4 * random.standard_normal((len(T), 3))
    seen[list(exchanged)] = seen[list(exchanged)[::-1]]
    flange, seen = flange[slip:], seen[: len(seen) - slip]
    out = []
    for name, T, order, size in (("arm", flange, arm, arm_size), ("board", seen, board, board_size)):
        wxyz = np.array([quaternion(each) for each in T])
        values = np.hstack([size * T[:, :3, 3], wxyz[:, [1, 2, 3, 0]][:, list(order)]])
        path = folder / f"{name}.txt"
        path.write_text("\n".join(" ".join(f"{v:.9f}" for v in row) for row in values) + "\n")
        out.append(str(path))
    return out


@pytest.mark.parametrize("name", MISTAKES)
@pytest.mark.parametrize("seed", [1, 2])
def test_lists_that_were_meant_otherwise_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, seed: int
) -> None:
    mistake, says = MISTAKES[name]
    files = lists(tmp_path, seed, **mistake)
    assert main(["import", *files, "--hand-eye", "-o", str(tmp_path / "poses.csv")]) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "poses.csv").exists()


def test_exchanged_pairs_are_named_and_right_ones_are_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for seed, exchanged in ((1, [2, 7]), (2, []), (3, [])):
        files = lists(tmp_path, seed, exchanged=exchanged)
        assert main(["import", *files, "--hand-eye", "-o", str(tmp_path / "poses.csv")]) == 0
        text = capsys.readouterr()
        named = "the board's poses fit other rows, 2 that of 7, 7 that of 2" in text.out + text.err
        assert named is bool(exchanged)
        assert ("do not agree" in text.out + text.err) is bool(exchanged)
