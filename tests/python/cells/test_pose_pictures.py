# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Pictures of a board beside the poses that a controller gives, without joints: from the files to page and exports."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.cli.app import main
from fastcal.io.hand_eye_file import hand_eye_texts
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose
from fastcal.robot.hand_eye import hand_eyes

from . import camera_scene as scene

COUNT = 16


def quaternion(R: scene.FloatArray) -> list[float]:
    """w, x, y, z of a rotation, by the eigenvector of K. Shepperd's and I. Bar-Itzhack's matrix."""
    a, b, c = R
    K = np.array(
        [
            [a[0] + b[1] + c[2], c[1] - b[2], a[2] - c[0], b[0] - a[1]],
            [c[1] - b[2], a[0] - b[1] - c[2], a[1] + b[0], a[2] + c[0]],
            [a[2] - c[0], a[1] + b[0], b[1] - a[0] - c[2], b[2] + c[1]],
            [b[0] - a[1], a[2] + c[0], b[2] + c[1], c[2] - a[0] - b[1]],
        ]
    )
    return np.linalg.eigh(K)[1][:, -1].tolist()


def written(folder: Path, noise_px: float = 0.05) -> list[str]:
    """The scene, its arm known by poses; words of a command."""
    scene.write(folder, COUNT, noise_px=noise_px)
    cell = scene.cell()
    cell["arms"]["arm"] = {"robot": "pose"}
    (folder / "cell.yaml").write_text(yaml.safe_dump(cell))
    (folder / "arm.yaml").unlink()
    lines = ["arm.x_mm,arm.y_mm,arm.z_mm,arm.qw,arm.qx,arm.qy,arm.qz"]
    for q in scene.postures(COUNT, 1):
        T = scene.flange(q)
        lines.append(",".join(f"{v:.9f}" for v in [*T[:3, 3], *quaternion(T[:3, :3])]))
    (folder / "poses.csv").write_text("\n".join(lines) + "\n")
    return [str(folder / "cell.yaml"), str(folder / "poses.csv"), "--corners", str(folder / "corners.csv")]


def test_from_poses_and_corners_to_page_and_exports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = written(tmp_path)
    out, calib = tmp_path / "out", tmp_path / "wrist.calib"
    assert main(["calibrate", *words, "-o", str(out), "--hand-eye", str(calib)]) == 0
    model = load_robot(out / "model.yaml")
    found = pose(model.description.cameras["wrist"])
    off = np.linalg.inv(scene.WRIST) @ np.block([[found[:3, :3], 1e3 * found[:3, 3:]], [np.zeros((1, 3)), np.ones(1)]])
    assert np.linalg.norm(off[:3, 3]) < 0.1
    result = json.loads((out / "result.json").read_text())
    assert {p["owner"] for p in result["parameters"]} == {"camera wrist", "board plate"}
    assert result["cameras"][0]["with_identified_arm"] is False
    assert "camera wrist on flange: known to" in capsys.readouterr().out
    page = (out / "report.html").read_text()
    assert "The cameras and boards were located" in page
    assert "flange rz" in page
    assert "joint 1" not in page  # it has none
    assert calib.read_text() == hand_eye_texts(hand_eyes(model.description), calib)[calib]


def test_the_model_is_evaluated_and_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, *data = written(tmp_path)
    out = str(tmp_path / "out")
    assert main(["calibrate", str(tmp_path / "cell.yaml"), *data, "-o", out]) == 0
    assert main(["evaluate", f"{out}/model.yaml", *data]) == 0
    assert main(["check", f"{out}/model.yaml", *data]) == 0
    uv = np.array([6.0, 0.0]) + np.array([scene.seen(q) for q in scene.postures(COUNT, 1)])
    scene.write_corners(tmp_path, uv)
    capsys.readouterr()
    assert main(["check", f"{out}/model.yaml", *data]) == 4
    assert "joint" not in capsys.readouterr().out  # it has none


def test_pictures_in_wrong_rows_are_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = written(tmp_path)
    uv = np.array([scene.seen(q) for q in scene.postures(COUNT, 1)])
    uv[[3, 7]] = uv[[7, 3]]
    scene.write_corners(tmp_path, uv)
    assert main(["calibrate", *words, "-o", str(tmp_path / "out")]) == 0
    assert "rows 3 and 7 are exchanged" in capsys.readouterr().err


@pytest.mark.parametrize("focal", [1100.0, 1250.0])
def test_a_lens_that_is_not_as_the_file_says_is_named(
    focal: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nothing moved, though the first pictures are of another part of the picture than the last."""
    words = written(tmp_path)
    file = tmp_path / "cell.yaml"
    cell = yaml.safe_load(file.read_text())
    is_right = focal == cell["cameras"]["wrist"]["focal_px"][0]
    cell["cameras"]["wrist"]["focal_px"] = [focal, focal + 2.0]
    file.write_text(yaml.safe_dump(cell))
    if not is_right:  # by more than any arm is wrong by
        assert main(["calibrate", *words, "-o", str(tmp_path / "out")]) == 2
        assert "focal length" in capsys.readouterr().err
        words = [*words, "--as-read"]
    assert main(["calibrate", *words, "-o", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().err
    assert ("the pictures contradict the lens stated for camera wrist" in said) is not is_right
    assert "from row" not in said
    assert "diagnose" not in said  # it needs joints


def test_a_board_that_was_knocked_is_told_by_the_size_of_a_corner(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = written(tmp_path)
    q = scene.postures(COUNT, 1)
    before = [scene.seen(of) for of in q[:9]]
    monkeypatch.setattr(scene, "PLATE", scene.pose((3.0, -2.0, 0.0), (0.0, 0.0, 0.0)) @ scene.PLATE)
    uv = np.array([*before, *(scene.seen(of) for of in q[9:])])
    uv += 0.1 * np.random.default_rng(0).standard_normal(uv.shape)
    scene.write_corners(tmp_path, uv)
    assert main(["calibrate", *words, "-o", str(tmp_path / "out")]) == 0
    said = re.search(r"from row 9 on the corners are others, by ([\d.]+) px", capsys.readouterr().err)
    assert said is not None
    assert 4.0 < float(said[1]) < 20.0  # 3.6 mm at some 400 mm through 1100 px


@pytest.mark.parametrize(
    ("command", "more", "said"),
    [
        ("diagnose", [], "known only by the poses of its flange"),
        ("calibrate", ["--effects", "joint_compliance"], "no parameters to identify"),
    ],
)
def test_what_needs_joints_is_refused(
    command: str, more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = written(tmp_path)
    assert main([command, *words, *more, "-o", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_column_that_is_missing_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = written(tmp_path)
    poses = tmp_path / "poses.csv"
    poses.write_text(poses.read_text().replace("arm.qz", "arm.turn"))
    assert main(["calibrate", *words, "-o", str(tmp_path / "out")]) == 2
    assert "there is no column arm.qz" in capsys.readouterr().err


LINE = [[float(x), 2.0 * x, 0.0] for x in (0, 10, 25, 40, 70)]


@pytest.mark.parametrize(
    ("board", "said"),
    [
        ({"kind": "points", "points_mm": LINE}, "points on one line do not show how the board is turned"),
        ({"kind": "points", "points_mm": [*LINE, [30, 0, 0]]}, "all points but one are on a line"),
        ({"kind": "points", "points_mm": [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]]}, "must be six at least, got 4"),
        ({"kind": "points", "points_mm": LINE[:3]}, "a list of four points at least"),
        ({"kind": "circles", "columns": 8, "rows": 1, "square_mm": 20}, "circles on one line"),
    ],
)
def test_boards_that_do_not_show_a_pose(
    board: dict[str, object], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = written(tmp_path)
    cell = scene.cell() | {"arms": {"arm": {"robot": "pose"}}}
    cell["boards"]["plate"] = {"on": "world", **board}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    assert main(["calibrate", *words, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_pictures_with_corners_on_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = written(tmp_path)
    uv = np.array([scene.seen(q) for q in scene.postures(COUNT, 1)])
    uv[:, scene.COLUMNS - 1 :] = np.nan  # the first line of corners is left
    scene.write_corners(tmp_path, uv)
    assert main(["calibrate", *words, "-o", str(tmp_path / "out")]) == 3
    assert "four corners of a board that are not on one line" in capsys.readouterr().err
