# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Causes of error in cameras and boards are named, and the model that is written has their true numbers."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.cli.app import main
from fastcal.diagnosis import diagnose
from fastcal.importers.corners import load_seen
from fastcal.io.hand_eye_read import read_hand_eye
from fastcal.io.robot_file import load_robot
from fastcal.robot.core_model import pose
from fastcal.robot.rig import board_corners

from . import camera_scene as camera

SQUARE_TO_SAY = 24.4
HIDDEN = ("intrinsics@wrist", "board_scale@plate", "board_bend@plate")


def written(folder: Path, hidden: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cell whose file, or whose board, is not as the other says."""
    flat = camera.corners()
    if hidden == "board_bend@plate":
        bent = board_corners({"kind": "checkerboard", "columns": 7, "rows": 5, "square_mm": 25, "bend_mm": [1, 0, 0]})
        monkeypatch.setattr(camera, "corners", lambda: 1000 * bent)
    camera.write(folder, 36, joint_noise_deg=0.001)
    assert flat.shape == camera.corners().shape
    said = camera.cell(**({"focal_px": [1094.0, 1096.0]} if hidden == "intrinsics@wrist" else {}))
    if hidden == "board_scale@plate":
        said["boards"]["plate"]["square_mm"] = SQUARE_TO_SAY
    (folder / "cell.yaml").write_text(yaml.safe_dump(said))


@pytest.mark.parametrize("hidden", HIDDEN)
def test_what_is_wrong_with_the_rig_is_named_and_mended(
    tmp_path: Path, hidden: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, hidden, monkeypatch)
    robot = load_robot(tmp_path / "cell.yaml")
    found = diagnose(robot, load_seen([tmp_path / "poses.csv"], robot, tmp_path / "corners.csv"))
    assert [finding.label for finding in found.effects] == [hidden]
    assert found.verdict == "named"
    assert found.effects[0].gain[0] > 0
    after = found.train.kinds["corner"].statistics[1]
    assert after is not None
    assert after.rms < 0.1 * 2**0.5 * 1.15
    camera_spec, board = found.model.spec["cameras"]["wrist"], found.model.spec["boards"]["plate"]
    assert camera_spec["focal_px"] == pytest.approx(camera.FOCAL, rel=1e-3)
    assert board["square_mm"] == pytest.approx(camera.SQUARE_MM, rel=4e-3)
    if hidden == "board_bend@plate":
        assert board["bend_mm"] == pytest.approx([1.0, 0.0, 0.0], abs=0.1)


def test_the_size_of_a_board_is_no_proof_while_the_arm_could_have_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, "board_scale@plate", monkeypatch)
    robot = load_robot(tmp_path / "cell.yaml")
    found = diagnose(robot, load_seen([tmp_path / "poses.csv"], robot, tmp_path / "corners.csv"))
    assert [finding.grade for finding in found.effects] == ["B"]


def test_a_cell_as_its_file_says_has_no_such_cause(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, "", monkeypatch)
    robot = load_robot(tmp_path / "cell.yaml")
    assert diagnose(robot, load_seen([tmp_path / "poses.csv"], robot, tmp_path / "corners.csv")).verdict == "none"


def test_a_name_that_is_excluded_is_not_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, "intrinsics@wrist", monkeypatch)
    files = [str(tmp_path / name) for name in ("cell.yaml", "poses.csv")]
    corners = ["--corners", str(tmp_path / "corners.csv")]
    eye = ["--hand-eye", str(tmp_path / "eye.calib")]
    main(["diagnose", *files, *corners, "-o", str(tmp_path / "out"), "--exclude", "intrinsics", *eye])
    found = json.loads((tmp_path / "out/diagnosis.json").read_text())
    assert "intrinsics" not in {effect["effect"] for effect in found["effects"]}
    on_flange = pose(load_robot(tmp_path / "out/model.yaml").spec["cameras"]["wrist"])
    np.testing.assert_allclose(read_hand_eye(tmp_path / "eye.calib"), on_flange, atol=1e-9)


def test_a_bent_board_is_round_and_keeps_its_edges() -> None:
    board = {"kind": "circles", "columns": 5, "rows": 3, "square_mm": 10.0}
    flat, bent = board_corners(board), board_corners(board | {"bend_mm": [2.0, 1.0, -1.0]})
    assert np.array_equal(flat[:, :2], bent[:, :2])
    height = 1000 * bent[:, 2].reshape(3, 5)
    assert height[1] == pytest.approx([2.0, 0.5, 0.0, 0.5, 2.0])
    assert height[0] == pytest.approx([2.0, 0.0, -1.0, -1.0, 0.0])
