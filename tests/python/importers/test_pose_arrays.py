# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Poses of a flange and of a board in one .npz, by the names that scripts about calibrateHandEye give them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fastcal.cli.app import main
from fastcal.errors import ParseError
from fastcal.importers.pose_arrays import read_pose_arrays
from fastcal.importers.pose_pairs import read_pose_pairs

COUNT = 8


def poses(seed: int) -> np.ndarray:
    T = np.tile(np.eye(4), (COUNT, 1, 1))
    random = np.random.default_rng(seed)
    T[:, :3, :3] = Rotation.random(COUNT, random_state=seed).as_matrix()
    T[:, :3, 3] = random.uniform(-0.5, 0.5, (COUNT, 3))
    return T


def pairs() -> tuple[np.ndarray, np.ndarray]:
    """Of a camera on the arm: A X S = Y."""
    A, X, Y = poses(1), poses(2)[0], poses(3)[0]
    return A, np.linalg.inv(A @ X) @ Y


A, S = pairs()
VECTORS = Rotation.from_matrix(S[:, :3, :3]).as_rotvec()[..., np.newaxis]
WAYS = {
    "matrices": {"T_base_ee": A, "T_cam_board": S, "num_samples": np.array(COUNT), "timestamp": np.array("now")},
    "OpenCV's names": {
        "R_gripper2base": A[:, :3, :3],
        "t_gripper2base": A[:, :3, 3:],
        "R_target2cam": VECTORS,
        "t_target2cam": S[:, :3, 3],
    },
    "the other way round": {"T_ee_base": np.linalg.inv(A), "cam2target": np.linalg.inv(S)},
    "words": {"robot_poses": A[:, :3], "boardPoses": S, "cam2gripper": poses(4)},
}


@pytest.mark.parametrize("way", WAYS)
def test_both_poses_are_found_by_their_names(tmp_path: Path, way: str) -> None:
    np.savez(tmp_path / "samples.npz", **WAYS[way])
    found = read_pose_pairs([tmp_path / "samples.npz"])
    assert found is not None
    assert found.in_hand is True
    np.testing.assert_allclose(found.flange, A, atol=1e-12)
    np.testing.assert_allclose(found.seen, S, atol=1e-12)


def test_the_command_writes_a_cell_and_poses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    np.savez(tmp_path / "samples.npz", **WAYS["matrices"])
    assert main(["import", str(tmp_path / "samples.npz"), "-o", str(tmp_path / "poses.csv")]) == 0
    assert f"{COUNT} pairs of poses; read as numpy's arrays of poses" in capsys.readouterr().out
    files = [str(tmp_path / "poses_cell.yaml"), str(tmp_path / "poses.csv")]
    assert main(["calibrate", *files, "-o", str(tmp_path / "out")]) == 0


def test_other_arrays_are_none_of_poses(tmp_path: Path) -> None:
    np.savez(tmp_path / "lens.npz", mtx=np.eye(3), dist=np.zeros(5), rvecs=np.zeros((4, 3, 1)), tvecs=np.zeros((4, 3)))
    assert read_pose_arrays(tmp_path / "lens.npz") is None
    assert read_pose_arrays(tmp_path / "samples.csv") is None


def test_what_is_wrong_is_said(tmp_path: Path) -> None:
    file = tmp_path / "samples.npz"
    np.savez(file, T_base_ee=A, T_cam_board=S[:-1])
    with pytest.raises(ParseError, match="holds 8 poses of the arm and 7 of the board"):
        read_pose_arrays(file)
    file.write_bytes(b"PK nonsense")
    with pytest.raises(ParseError, match="is no file of numpy's arrays"):
        read_pose_arrays(file)


def labelled(flange: np.ndarray, seen: np.ndarray, angles: str = "xyz") -> str:
    """Lines of a place [m] and angles [deg], hand and eye by turns."""
    lines = []
    for of in zip(flange, seen, strict=True):
        for label, T in zip(("hand", "eye"), of, strict=True):
            six = [*T[:3, 3], *Rotation.from_matrix(T[:3, :3]).as_euler(angles, degrees=True)]
            lines.append(",".join([label, *(f"{number:.12g}" for number in six)]))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("convention", "angles"), [("rpy", "xyz"), ("abc", "ZYX"), ("zyz", "ZYZ")])
def test_lines_that_begin_with_hand_or_eye(tmp_path: Path, convention: str, angles: str) -> None:
    file = tmp_path / "samples.csv"
    file.write_text(labelled(A, S, angles))
    found = read_pose_pairs([file], orientation=convention)
    assert found is not None
    np.testing.assert_allclose(found.flange, A, atol=1e-9)
    np.testing.assert_allclose(found.seen, S, atol=1e-9)
    with pytest.raises(ParseError, match="six numbers a pose, and nothing says what its angles are: give --orient"):
        read_pose_pairs([file])
    file.write_text(file.read_text() + "[[0, 1, 2, 3]]\n")
    with pytest.raises(
        ParseError, match=rf"line {2 * COUNT + 1} begins with '\[\[0', and those before with hand or eye"
    ):
        read_pose_pairs([file], orientation=convention)


def test_two_lists_of_six_numbers(tmp_path: Path) -> None:
    for name, T in (("arm", A), ("board", S)):
        vectors = Rotation.from_matrix(T[:, :3, :3]).as_rotvec()
        np.savetxt(tmp_path / f"{name}.txt", np.column_stack([T[:, :3, 3], vectors]))
    files = [tmp_path / "arm.txt", tmp_path / "board.txt"]
    found = read_pose_pairs(files, asked=True, orientation="rotation_vector")
    assert found is not None
    np.testing.assert_allclose(found.seen, S, atol=1e-9)
    with pytest.raises(ParseError, match="wxyz does not say what its angles are"):
        read_pose_pairs(files, asked=True, orientation="wxyz")


def test_a_table_that_begins_with_a_tool_is_no_such_list(tmp_path: Path) -> None:
    file = tmp_path / "table.csv"
    file.write_text("Tool,X,Y,Z\n1,2,3,4\n")
    assert read_pose_pairs([file]) is None
    assert read_pose_pairs([tmp_path / "no.csv"]) is None
