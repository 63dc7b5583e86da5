# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lenses and targets of ROS, OpenCV and Kalibr in a cell file."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

from fastcal.errors import ParseError
from fastcal.io.hand_eye_file import hand_eye_texts
from fastcal.io.robot_file import load_robot
from fastcal.robot.hand_eye import HandEye

K = [[1400.0, 0.0, 640.5], [0.0, 1402.0, 512.0], [0.0, 0.0, 1.0]]
D = [-0.11, 0.09, 2e-4, -3e-4, 0.0]
CAMCHAIN = """
cam0:
  camera_model: pinhole
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  distortion_model: radtan
  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  camera_model: pinhole
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  distortion_model: equidistant
  distortion_coeffs: [0.01, 0.02, 0.03, 0.04]
  resolution: [752, 480]
"""
TARGET = "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 5\ntagSize: 0.088 # m\ntagSpacing: 0.3\ncodeOffset: 0\n"


def cell(folder: Path, camera: dict[str, Any], board: dict[str, Any] | None = None, name: str = "wrist") -> Any:
    """The spec of a cell with this camera."""
    plate = board or {"kind": "checkerboard", "columns": 8, "rows": 6, "square_mm": 20}
    content = {
        "arms": {"arm": "ur5"},
        "cameras": {name: {"on": "arm", **camera}},
        "boards": {"plate": {"on": "world", **plate}},
    }
    (folder / "cell.yaml").write_text(yaml.safe_dump(content))
    return load_robot(folder / "cell.yaml").spec


def test_what_opencv_wrote_is_read(tmp_path: Path) -> None:
    for name in ("intrinsics.yml", "intrinsics.yaml"):
        file = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
        file.write("image_width", 1280)
        file.write("image_height", 1024)
        file.write("camera_matrix", np.array(K))
        file.write("distortion_coefficients", np.array([D]))
        file.release()
        found = cell(tmp_path, {"lens": name})["cameras"]["wrist"]
        assert (found["focal_px"], found["centre_px"], found["size_px"]) == ([1400, 1402], [640.5, 512], [1280, 1024])
        assert found["distortion"] == D


@pytest.mark.parametrize("ending", ["camera_info.yaml", "lens.yaml"])
def test_what_is_written_for_ros_and_opencv_comes_back(tmp_path: Path, ending: str) -> None:
    lens = {"focal_px": [1400.0, 1402.0], "centre_px": [640.5, 512.0], "size_px": [1280, 1024], "model": "pinhole"}
    written = HandEye("wrist", "flange", np.eye(4), np.full(6, np.nan), True, lens=lens | {"distortion": D})
    for path, text in hand_eye_texts([written], tmp_path / ending).items():
        path.write_text(text)
    found = cell(tmp_path, {"lens": ending})["cameras"]["wrist"]
    assert {key: found[key] for key in lens} == lens
    assert found["distortion"] == D


def test_a_camchain_gives_the_camera_of_its_name(tmp_path: Path) -> None:
    (tmp_path / "camchain.yaml").write_text(CAMCHAIN)
    found = cell(tmp_path, {"lens": "camchain.yaml"}, name="cam1")["cameras"]["cam1"]
    assert (found["model"], found["focal_px"], found["size_px"]) == ("fisheye", [457.587, 456.134], [752, 480])
    with pytest.raises(ParseError, match="holds cameras cam0, cam1"):
        cell(tmp_path, {"lens": "camchain.yaml"})


def test_keys_of_the_cell_come_before_those_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "lens.yaml").write_text(yaml.safe_dump({"K": K, "D": D}))
    found = cell(tmp_path, {"lens": "lens.yaml", "size_px": [1280, 1024], "focal_px": [1300, 1300]})
    assert found["cameras"]["wrist"]["focal_px"] == [1300, 1300]
    with pytest.raises(ParseError, match="size_px is missing"):
        cell(tmp_path, {"lens": "lens.yaml"})


def test_a_target_of_kalibr_is_a_board(tmp_path: Path) -> None:
    (tmp_path / "target.yaml").write_text(TARGET)
    camera = {"size_px": [1280, 1024], "focal_px": [1400, 1400], "centre_px": [640, 512]}
    board = cell(tmp_path, camera, {"target": "target.yaml"})["boards"]["plate"]
    assert (board["kind"], board["columns"], board["rows"]) == ("april_grid", 6, 5)
    assert (board["tag_mm"], board["gap_mm"]) == (pytest.approx(88.0), pytest.approx(26.4))
    text = "target_type: 'checkerboard'\ntargetCols: 6\ntargetRows: 7\nrowSpacingMeters: 0.06\ncolSpacingMeters: 0.06\n"
    (tmp_path / "target.yaml").write_text(text)
    board = cell(tmp_path, camera, {"target": "target.yaml"})["boards"]["plate"]
    assert (board["columns"], board["rows"], board["square_mm"]) == (7, 8, pytest.approx(60.0))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: 1", "no camera matrix"),
        ("K: [1, 2]", "no camera matrix"),
        ("K: {rows: 3}", "lists of numbers"),
        ("[1, 2]", "a YAML mapping"),
        ("K: [1000, 0, 500, 0, 1000, 400, 0, 0, 1]\ndistortion_model: thin_prism", "model 'thin_prism'"),
        ("cam0: {camera_model: omni, intrinsics: [1, 2, 3, 4, 5]}", "pinhole, got 'omni'"),
    ],
)
def test_what_is_no_lens_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "lens.yaml").write_text(text)
    with pytest.raises(ParseError, match=said):
        cell(tmp_path, {"lens": "lens.yaml"}, name="cam0")


@pytest.mark.parametrize(("text", "said"), [("target_type: star", "'star'"), ("target_type: aprilgrid", "tagSize")])
def test_what_is_no_target_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "target.yaml").write_text(text)
    with pytest.raises(ParseError, match=said):
        cell(
            tmp_path,
            {"size_px": [1280, 1024], "focal_px": [1400, 1400], "centre_px": [640, 512]},
            {"target": "target.yaml"},
        )
