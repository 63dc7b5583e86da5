# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A camera's place to the files of easy_handeye, Zivid, ViSP and Kalibr, and theirs into a cell."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

from fastcal.errors import InvalidInput, ParseError
from fastcal.io.hand_eye_file import hand_eye_texts
from fastcal.io.hand_eye_read import read_hand_eye
from fastcal.io.lens_file import read_lens
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose
from fastcal.robot.hand_eye import HandEye

T = pose({"xyz_mm": [-31.857, -51.4426, 18.6597], "rpy_deg": [25.0, -140.0, 80.0]})
LENS: dict[str, Any] = {
    "model": "pinhole",
    "size_px": [1280, 720],
    "focal_px": [912.5, 911.0],
    "centre_px": [640, 362.0],
}
LENS |= {"distortion": [0.1, -0.2, 0.001, -0.002]}
# A file of easy_handeye, as it keeps one in ~/.ros/easy_handeye.
EASY_HANDEYE = """\
parameters:
  eye_on_hand: true
  freehand_robot_movement: false
  move_group: manipulator
  move_group_namespace: /
  namespace: /arm_camera_eye_on_hand/
  robot_base_frame: base_link
  robot_effector_frame: tool0
  tracking_base_frame: camera_color_optical_frame
  tracking_marker_frame: aruco_marker_frame
transformation:
  qw: 0.5
  qx: -0.5
  qy: -0.5
  qz: -0.5
  x: 0.0125
  y: 0.125
  z: 0.025
"""
ZIVID = """\
__version__: 1
FloatMatrix:
  Data: [
    [ 0, -1, 0, -52.25 ],
    [ 1, 0, 0, -93.5 ],
    [ 0, 0, 1, 54.75 ],
    [ 0, 0, 0, 1 ]]
"""


def text_of(name: str, found: HandEye) -> str:
    (text,) = hand_eye_texts([found], Path(name)).values()
    return text


def hand_eye(**more: Any) -> HandEye:
    return HandEye("wrist", "tool0", T, np.full(6, 1e-4), in_hand=True, lens=LENS, **more)


@pytest.mark.parametrize(
    "name", ["wrist_eye_on_hand.yaml", "handEyeTransform.yaml", "wrist_eMc.yaml", "wrist.calib", "wrist.yaml"]
)
def test_a_place_comes_back(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text(text_of(name, hand_eye()))
    np.testing.assert_allclose(read_hand_eye(tmp_path / name), T, atol=1e-12)


def test_easy_handeyes_file_has_its_keys(tmp_path: Path) -> None:
    theirs, ours = yaml.safe_load(EASY_HANDEYE), yaml.safe_load(text_of("a_eye_on_hand.yaml", hand_eye()))
    for part in ("parameters", "transformation"):
        assert ours[part].keys() == theirs[part].keys()
        assert {key: type(value) for key, value in ours[part].items()} == {
            key: type(value) for key, value in theirs[part].items()
        }
    assert ours["parameters"]["robot_effector_frame"] == "tool0"
    (tmp_path / "theirs.yaml").write_text(EASY_HANDEYE)
    found = read_hand_eye(tmp_path / "theirs.yaml")
    np.testing.assert_allclose(found[:3, 3], [0.0125, 0.125, 0.025])
    np.testing.assert_allclose(found[:3, :3], [[0, 1, 0], [0, 0, 1], [1, 0, 0]], atol=1e-12)


def test_zivids_matrices_are_in_millimetres(tmp_path: Path) -> None:
    (tmp_path / "handEyeTransform.yaml").write_text(ZIVID)
    np.testing.assert_allclose(read_hand_eye(tmp_path / "handEyeTransform.yaml")[:3, 3], [-0.05225, -0.0935, 0.05475])
    storage = cv2.FileStorage(str(tmp_path / "old.yaml"), cv2.FILE_STORAGE_WRITE)
    storage.write("PoseState", np.array(yaml.safe_load(ZIVID)["FloatMatrix"]["Data"], dtype=np.float64))
    storage.release()
    np.testing.assert_allclose(read_hand_eye(tmp_path / "old.yaml"), read_hand_eye(tmp_path / "handEyeTransform.yaml"))
    assert yaml.safe_load(text_of("transform.yaml", hand_eye()))["FloatMatrix"]["Data"][0][3] == pytest.approx(-31.857)


def test_visps_vector_is_a_place_and_a_rotation_vector() -> None:
    v = np.array(yaml.safe_load(text_of("eMc.yaml", hand_eye()))["data"]).ravel()
    np.testing.assert_allclose(v[:3], T[:3, 3])
    np.testing.assert_allclose(cv2.Rodrigues(v[3:])[0], T[:3, :3], atol=1e-12)


def test_kalibrs_camchain_is_the_lens(tmp_path: Path) -> None:
    (tmp_path / "camchain.yaml").write_text(text_of("camchain.yaml", hand_eye()))
    assert read_lens(tmp_path / "camchain.yaml", "wrist") == LENS
    more = {**LENS, "distortion": [0.1, -0.2, 0, 0, 0.3]}
    found = HandEye("wrist", "tool0", T, np.full(6, 1e-4), in_hand=True, lens=more)
    with pytest.raises(InvalidInput, match="Kalibr's radtan has k1, k2, p1, p2, and this lens more"):
        text_of("camchain.yaml", found)
    with pytest.raises(InvalidInput, match="has no lens here"):
        text_of("camchain.yaml", HandEye("wrist", "tool0", T, np.full(6, 1e-4), in_hand=True))


def test_a_cell_takes_a_cameras_place_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "old_eye_on_hand.yaml").write_text(EASY_HANDEYE)
    board = {"on": "world", "kind": "checkerboard", "columns": 8, "rows": 6, "square_mm": 20}
    cell = {"arms": {"arm": {"robot": "ur5e"}}, "boards": {"b": board}}
    cell["cameras"] = {"wrist": {"on": "arm", "place": "old_eye_on_hand.yaml", "size_px": [640, 480]}}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    camera = load_robot(tmp_path / "cell.yaml").description.cameras["wrist"]
    np.testing.assert_allclose(pose(camera), read_hand_eye(tmp_path / "old_eye_on_hand.yaml"), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: 1\n", "holds no place of a camera"),
        ("transformation: {x: 1, y: 2}\n", "expected numbers x y z"),
        ("transformation: {x: 1, y: 2, z: 3, qx: 1, qy: 1, qz: 0, qw: 0}\n", "quaternion of length 1"),
        ("FloatMatrix: {Data: [1, 2]}\n", "expected 16 numbers"),
        ("PoseState: {data: [2,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n", "is no pose"),
    ],
)
def test_what_is_none_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "x.yaml").write_text(text)
    with pytest.raises(ParseError, match=said):
        read_hand_eye(tmp_path / "x.yaml")
