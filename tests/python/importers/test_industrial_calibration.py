# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Data folders of industrial_calibration, as those of its repository are laid out, through to a camera's place."""

import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

from fastcal import _core
from fastcal.cli import main
from fastcal.importers.industrial_calibration import picture_size, read_industrial_set
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners

CHARUCO = {"type": "CharucoGridTargetFinder", "rows": 7, "cols": 5, "chessboard_dim": 0.036}
CHARUCO |= {"aruco_marker_dim": 0.018, "dictionary": 10}
DOTS = {"type": "industrial_calibration::ModifiedCircleGridTargetFinderPlugin", "rows": 6, "cols": 5, "spacing": 0.03}
SIZE, LENS = (640, 480), {"fx": 800.0, "fy": 801.0, "cx": 321.0, "cy": 239.0}
X = pose({"xyz_mm": [40.0, -50.0, 80.0], "rpy_deg": [5.0, -4.0, 30.0]})
Y = pose({"xyz_mm": [600.0, 50.0, 10.0], "rpy_deg": [3.0, -2.0, 20.0]})
COUNT = 12


def png(size: tuple[int, int]) -> bytes:
    """A grey picture."""

    def part(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", *size, 8, 0, 0, 0, 0)
    rows = zlib.compress((b"\0" + b"\x80" * size[0]) * size[1])
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", rows) + part(b"IEND", b"")


def written(folder: Path, finder: dict[str, Any], *, beside: bool = False, **more: Any) -> Path:
    """A folder with cal_data.yaml, pictures and poses, in which the camera is on the flange."""
    random = np.random.default_rng(4)
    for name in ("images", "poses"):
        (folder / name).mkdir(parents=True)
    for k in range(COUNT):
        view = pose({"xyz_mm": [0, 0, 500], "rpy_deg": (random.uniform(-25, 25, 3) * [1, 1, 4]).tolist()})
        T = Y @ np.linalg.inv(view) @ np.linalg.inv(X)
        turn = np.asarray(_core.log_so3(T[:3, :3]))
        angle = float(np.linalg.norm(turn))
        parts = [*T[:3, 3], *(np.sin(angle / 2) / angle * turn), np.cos(angle / 2)]
        content = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), map(float, parts), strict=True))
        (folder / f"poses/{k}.yaml").write_text(yaml.safe_dump(content))
        (folder / f"images/{k}.png").write_bytes(png(SIZE))
    data: dict[str, Any] = {"data": [{"image": f"images/{k}.png", "pose": f"poses/{k}.yaml"} for k in range(COUNT)]}
    if beside:
        (folder / "target_finder.yaml").write_text(yaml.safe_dump(finder))
        (folder / "camera_intr.yaml").write_text(yaml.safe_dump({"intrinsics": LENS}))
    else:
        data |= {"target_finder": finder, "intrinsics": LENS}
    (folder / "cal_data.yaml").write_text(yaml.safe_dump(data | more))
    return folder


def test_from_the_folder_to_the_camera(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, table = written(tmp_path / "set", DOTS, beside=True), tmp_path / "poses.csv"
    assert main(["import", str(folder), "-o", str(table)]) == 0
    said = capsys.readouterr().out
    assert "next: fastcal detect" in said
    cell = tmp_path / "poses_cell.yaml"
    arm = load_robot(cell)
    assert arm.description.boards["board"]["kind"] == "circles"
    # What `detect` finds is drawn here: the pictures of this set are grey.
    lines = ["row,camera,board,corner,u_px,v_px"]
    corners = board_corners(arm.description.boards["board"])
    K = np.array([[LENS["fx"], 0, LENS["cx"]], [0, LENS["fy"], LENS["cy"]], [0, 0, 1]])
    for k in range(COUNT):
        T = np.linalg.inv(read_industrial_set([folder]).flange[k] @ X) @ Y  # type: ignore[union-attr]
        p = (corners @ T[:3, :3].T + T[:3, 3]) @ K.T
        uv = p[:, :2] / p[:, 2:]
        lines += [f"{k},camera,board,{i},{u:.6f},{v:.6f}" for i, (u, v) in enumerate(uv)]
    (tmp_path / "corners.csv").write_text("\n".join(lines) + "\n")
    words = [str(cell), str(table), "--corners", str(tmp_path / "corners.csv"), "-o", str(tmp_path / "out")]
    assert main(["calibrate", *words]) == 0
    found = pose(load_robot(tmp_path / "out/model.yaml").description.cameras["camera"])
    np.testing.assert_allclose(found, X, atol=1e-6)


def test_pictures_are_joined_by_their_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, table = written(tmp_path / "set", CHARUCO), tmp_path / "poses.csv"
    assert main(["import", str(folder / "cal_data.yaml"), "-o", str(table)]) == 0
    cell = str(tmp_path / "poses_cell.yaml")
    main(["detect", str(folder / "images"), "--cell", cell, "--joints", str(table), "-o", str(tmp_path / "c.csv")])
    assert "of no row" not in capsys.readouterr().out


def test_what_the_board_is(tmp_path: Path) -> None:
    board = read_industrial_set([written(tmp_path / "a", CHARUCO)]).cell["boards"]["board"]  # type: ignore[union-attr]
    assert board == {"on": "world", "kind": "charuco", "columns": 5, "rows": 7, "square_mm": 36.0} | {
        "marker_mm": 18.0,
        "dictionary": "6X6_250",
    }
    number = getattr(cv2.aruco, f"DICT_{board['dictionary']}")
    assert number == CHARUCO["dictionary"]
    in_room = read_industrial_set([written(tmp_path / "b", CHARUCO, static_camera=True)])
    assert in_room is not None
    assert in_room.cell["cameras"]["camera"]["on"] == "world"
    assert in_room.cell["boards"]["board"]["on"] == "arm"


@pytest.mark.parametrize("ending", [".png", ".bmp", ".jpg"])
def test_the_size_of_a_picture(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"picture{ending}"
    cv2.imwrite(str(file), np.full((123, 457, 3), 99, dtype=np.uint8))
    assert picture_size(file) == (457, 123)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"target_finder": {"type": "ArucoGridTargetFinder"}}, "finds no board that is known here"),
        ({"target_finder": {**CHARUCO, "dictionary": 99}}, "is missing or no number"),
        ({"intrinsics": {"fx": 1}}, "expected numbers fx, fy, cx, cy"),
        ({"intrinsics": None}, "has no intrinsics"),
        ({"data": [{"image": "images/0.png"}]}, "a picture and no pose"),
        ({"data": [{"image": "images/none.png", "pose": "poses/0.yaml"}]}, "there is no such picture"),
    ],
)
def test_what_is_missing_is_named(
    change: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = written(tmp_path / "set", CHARUCO, **change)
    assert main(["import", str(folder), "-o", str(tmp_path / "poses.csv")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
