# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Lenses in XML, in lists of cameras, in numpy's archives and in MATLAB's JSON."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from fastcal.errors import ParseError
from fastcal.io.hand_eye_file import hand_eye_texts
from fastcal.io.hand_eye_read import read_hand_eye
from fastcal.io.lens_file import read_lens
from fastcal.robot.core_model import pose
from fastcal.robot.hand_eye import HandEye

K = [[1400.0, 0.0, 640.5], [0.0, 1402.0, 512.0], [0.0, 0.0, 1.0]]
D = [-0.11, 0.09, 2e-4, -3e-4, 0.03]
# The example of COLMAP's documentation (output format, cameras.txt).
COLMAP = """\
# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
# Number of cameras: 3
1 SIMPLE_PINHOLE 3072 2304 2559.81 1536 1152
2 PINHOLE 3072 2304 2560.56 2560.56 1536 1152
3 SIMPLE_RADIAL 3072 2304 2559.69 1536 1152 -0.0218531
"""
# As vpXmlParserCamera writes it: one camera, two models.
VISP = """\
<?xml version="1.0"?>
<root>
  <!--This file stores intrinsic camera parameters used in the vpCameraParameters Class of ViSP-->
  <camera>
    <name>myCamera</name>
    <image_width>640</image_width>
    <image_height>480</image_height>
    <model>
      <type>perspectiveProjWithoutDistortion</type>
      <px>1129.0</px><py>1130.6</py><u0>317.9</u0><v0>229.1</v0>
    </model>
    <model>
      <type>perspectiveProjWithDistortion</type>
      <px>1089.9</px><py>1090.1</py><u0>326.1</u0><v0>230.5</v0><kud>-0.196</kud><kdu>0.204</kdu>
    </model>
  </camera>
</root>
"""
# jsonencode(cameraParams.Intrinsics): the first pixel is (1, 1), sizes are rows and columns.
MATLAB = {
    "FocalLength": [714.18, 710.37],
    "PrincipalPoint": [564.49, 355.71],
    "ImageSize": [712, 1072],
    "RadialDistortion": [-0.3528, 0.1729],
    "TangentialDistortion": [1e-4, -2e-4],
    "Skew": 0,
}


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize("name", ["out_camera_data.xml", "lens.json", "lens.yml"])
def test_what_opencv_writes_is_read_in_each_of_its_forms(tmp_path: Path, name: str) -> None:
    file = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
    file.write("calibration_time", "Fri Nov 27 12:00:00 2026")
    file.write("nr_of_frames", 25)
    file.write("image_width", 1280)
    file.write("image_height", 1024)
    file.write("camera_matrix", np.array(K))
    file.write("distortion_coefficients", np.array([D]).T)
    file.write("avg_reprojection_error", 0.21)
    file.release()
    found = read_lens(tmp_path / name, "wrist")
    assert (found["focal_px"], found["centre_px"], found["size_px"]) == ([1400, 1402], [640.5, 512], [1280, 1024])
    assert found["distortion"] == D


@pytest.mark.parametrize("ending", ["wrist.xml", "wrist.json"])
def test_what_is_written_for_opencv_comes_back(tmp_path: Path, ending: str) -> None:
    T = pose({"xyz_mm": [-31.857, -51.4426, 18.6597], "rpy_deg": [25.0, -140.0, 80.0]})
    lens = {"focal_px": [1400.0, 1402.0], "centre_px": [640.5, 512.0], "size_px": [1280, 1024], "model": "pinhole"}
    found = HandEye("wrist", "flange", T, np.full(6, np.nan), True, lens=lens | {"distortion": D})
    (text,) = hand_eye_texts([found], tmp_path / ending).values()
    path = written(tmp_path, ending, text)
    read = read_lens(path, "wrist")
    assert {key: read[key] for key in lens} == lens
    assert read["distortion"] == D
    np.testing.assert_allclose(read_hand_eye(path), T, atol=1e-12)


def test_the_arrays_of_a_tutorial_are_a_lens(tmp_path: Path) -> None:
    rest = {"rvecs": np.zeros((9, 3, 1)), "image_size": np.array([1280, 1024])}
    np.savez(tmp_path / "B.npz", mtx=np.array(K), dist=np.array([D]), **rest)
    found = read_lens(tmp_path / "B.npz", "wrist")
    assert (found["focal_px"], found["distortion"], found["size_px"]) == ([1400, 1402], D, [1280, 1024])
    np.savez(tmp_path / "C.npz", mtx=np.array([{"a": 1}], dtype=object))
    with pytest.raises(ParseError, match="no archive of arrays"):
        read_lens(tmp_path / "C.npz", "wrist")


def test_colmap_counts_from_a_corner_of_its_first_pixel(tmp_path: Path) -> None:
    path = written(tmp_path, "cameras.txt", COLMAP)
    found = read_lens(path, "3")
    assert (found["focal_px"], found["centre_px"]) == ([2559.69] * 2, [1535.5, 1151.5])
    assert (found["distortion"], found["size_px"], found["model"]) == ([-0.0218531], [3072, 2304], "pinhole")
    with pytest.raises(ParseError, match="holds cameras 1, 2, 3"):
        read_lens(path, "wrist")
    path = written(tmp_path, "one.txt", "7 OPENCV_FISHEYE 640 480 300 301 320 240 0.01 0.02 0.03 0.04\n")
    found = read_lens(path, "wrist")
    assert (found["model"], found["distortion"]) == ("fisheye", [0.01, 0.02, 0.03, 0.04])


def test_visps_lens_is_that_with_distortion(tmp_path: Path) -> None:
    found = read_lens(written(tmp_path, "camera.xml", VISP), "wrist")
    assert (found["focal_px"], found["centre_px"]) == ([1089.9, 1090.1], [326.1, 230.5])
    assert (found["distortion"], found["size_px"]) == ([-0.196], [640, 480])


def test_matlab_counts_pixels_from_one(tmp_path: Path) -> None:
    found = read_lens(written(tmp_path, "camera.json", json.dumps(MATLAB)), "wrist")
    assert found["centre_px"] == pytest.approx([563.49, 354.71])
    assert (found["size_px"], found["distortion"]) == ([1072, 712], [-0.3528, 0.1729, 1e-4, -2e-4])
    older = {key: MATLAB[key] for key in ("RadialDistortion", "TangentialDistortion", "ImageSize")}
    older["IntrinsicMatrix"] = [[714.18, 0, 0], [0, 710.37, 0], [564.49, 355.71, 1]]  # of row vectors
    assert read_lens(written(tmp_path, "older.json", json.dumps(older)), "wrist") == found


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.xml", "<opencv_storage><a>1</a>", "not valid XML"),
        ("a.xml", "<!DOCTYPE x><opencv_storage/>", "DOCTYPE"),
        ("a.xml", "<robot name='a'/>", "XML of <robot>"),
        ("a.xml", "<opencv_storage><a>1</a></opencv_storage>", "no camera matrix"),
        ("a.xml", "<root><camera><model><type>ProjWithKannalaBrandt</type></model></camera></root>", "Kannala"),
        ("a.xml", VISP.replace("<px>1089.9</px>", ""), "number in <px>"),
        ("a.txt", "1 THIN_PRISM_FISHEYE 640 480 1 2 3 4", "THIN_PRISM_FISHEYE"),
        ("a.txt", "1 PINHOLE 640 480 300 300 320", "fx, fy, cx, cy of PINHOLE"),
        ("a.json", json.dumps({"RadialDistortion": [0.1, 0.2]}), "'K' is amiss"),
        ("a.yaml", "K: [1000, 20, 500, 0, 1000, 400, 0, 0, 1]", "a skew of 20 px"),
        ("a.npz", "no archive", "no archive of arrays"),
    ],
)
def test_what_is_no_lens_is_refused(tmp_path: Path, name: str, text: str, said: str) -> None:
    with pytest.raises(ParseError, match=said):
        read_lens(written(tmp_path, name, text), "wrist")
