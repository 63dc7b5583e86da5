# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""External axes as members of a cell: an arm on a track looks at a board on a turntable."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fastcal.cells.calibrate import calibrate_cell
from fastcal.cells.errors import kind_errors
from fastcal.cells.rig_start import judged_readings
from fastcal.cli.app import main
from fastcal.errors import InvalidInput, ParseError
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import cell_text, is_cell, load_cell

from . import camera_scene as camera
from . import track_scene as track

NOISE = 0.1 * 2**0.5  # [px] of a corner, u and v together


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_track_arm_table_camera_and_board_are_found_from_no_guess(tmp_path: Path, seed: int) -> None:
    scene = track.Scene(seed)
    scene.write(tmp_path, 60)
    scene.write(tmp_path, 15, prefix="test_")
    cell = load_cell(tmp_path / "cell.yaml")
    found = calibrate_cell(cell, load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv"))
    assert found.status == "converged"
    assert {p.owner for p in found.parameters} >= {"arm.base", "arm.joint2", "camera wrist", "board plate"}
    wrist = found.cell.cameras["wrist"]
    assert np.allclose(wrist["xyz_mm"], camera.WRIST[:3, 3], atol=1.0)  # with the last link, it is the arm's tool
    assert len(wrist["identified"]["std_mm"]) == 3
    # What is written and read again predicts other postures, of joints, track and table alike.
    (tmp_path / "model.yaml").write_text(cell_text(found.cell), encoding="utf-8")
    model = load_cell(tmp_path / "model.yaml")
    assert (model.cameras, model.boards) == (found.cell.cameras, found.cell.boards)
    assert np.array_equal(model.core.nominal, found.cell.core.nominal)
    test = load_seen_readings(tmp_path / "test_poses.csv", model, tmp_path / "test_corners.csv")
    after = kind_errors(model, test)["corner"].rms
    assert after is not None
    assert after < 1.1 * NOISE


def test_the_command_and_its_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = track.Scene(4)
    scene.write(tmp_path, 40)
    scene.write(tmp_path, 10, prefix="test_")
    monkeypatch.chdir(tmp_path)
    seen = ["--corners", "corners.csv", "--test", "test_poses.csv", "--test-corners", "test_corners.csv"]
    assert main(["calibrate", "cell.yaml", "poses.csv", *seen, "-o", "out"]) == 0
    result = json.loads(Path("out/result.json").read_text())
    on_test = result["test"]["kinds"]["corner"]
    assert on_test["unit"] == "px"
    assert on_test["count"] == 10 * len(camera.corners())
    assert on_test["after"]["rms"] < 1.2 * NOISE < on_test["before"]["rms"]
    assert main(["evaluate", "out/model.yaml", "test_poses.csv", "--corners", "test_corners.csv", "-o", "e.json"]) == 0
    assert json.loads(Path("e.json").read_text())["kinds"]["corner"]["after"]["rms"] == on_test["after"]["rms"]


def test_pictures_in_the_wrong_place_are_said_and_mended(tmp_path: Path) -> None:
    uv = track.Scene(5).write(tmp_path, 20)
    cell = load_cell(tmp_path / "cell.yaml")
    whole = load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")
    uv[[2, 6]] = uv[[2, 6], ::-1]
    uv[[3, 8]] = uv[[8, 3]]
    camera.write_corners(tmp_path, uv)
    readings = load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")
    left_out, mended = judged_readings(cell, readings), judged_readings(cell, readings, mend=True)
    assert any("rows 2, 6 it was read from its other end" in note for note in left_out.notes)
    assert any("the pictures of rows 3 and 8 are exchanged" in note for note in left_out.notes)
    expected = whole.tables["corner"].copy()
    assert np.array_equal(mended.tables["corner"], expected)
    expected[[3, 8]] = np.nan
    assert np.array_equal(left_out.tables["corner"], expected, equal_nan=True)


def test_cameras_on_two_arms_see_one_board(tmp_path: Path) -> None:
    """Three moving frames carry cameras and boards."""
    scene = track.Scene(6)
    uv = scene.write(tmp_path, 40)
    two = track.cell()
    second = {"robot": "arm.yaml", "xyz_mm": list(track.SECOND[0]), "rpy_deg": list(track.SECOND[1])}
    two["arms"]["second"] = second
    two["cameras"]["other"] = {**two["cameras"]["wrist"], "on": "second", "xyz_mm": [-200, 0, 0]}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(two))
    head, *rows = (tmp_path / "poses.csv").read_text(encoding="utf-8").splitlines()
    lines = (tmp_path / "corners.csv").read_text(encoding="utf-8").splitlines()
    out = [",".join([head, *(f"second.q{k}_deg" for k in range(1, 7))])]
    for i, row in enumerate(rows):
        while True:
            q = np.array([0, 10, 20, 0, 60, 0]) + scene.random.uniform(-1, 1, 6) * [40, 25, 25, 60, 40, 170]
            if (seen := scene.second_picture(q, float(row.split(",")[-1]))) is not None:
                break
        out.append(",".join([row, *(f"{angle:.9f}" for angle in q)]))
        seen = seen + 0.1 * scene.random.standard_normal(seen.shape)
        lines += [f"{i},other,plate,{k},{u:.5f},{v:.5f}" for k, (u, v) in enumerate(seen)]
    (tmp_path / "poses.csv").write_text("\n".join(out) + "\n", encoding="utf-8")
    (tmp_path / "corners.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    found = calibrate_cell(cell, load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv"))
    assert found.status == "converged"
    assert {p.owner for p in found.parameters} >= {"camera wrist", "camera other", "board plate", "second.joint2"}
    assert found.train["corner"].after.size == 2 * uv[..., 0].size
    assert found.train["corner"].rms == pytest.approx(NOISE, rel=0.05)
    assert np.allclose(found.cell.cameras["other"]["xyz_mm"], camera.WRIST[:3, 3], atol=1.0)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"boards": {"plate": {"on": "shelf"}}}, "boards.plate: stands on 'shelf'"),
        ({"cameras": {"wrist": {"time_offset_s": 1e3}}}, "cameras.wrist.time_offset_s: expected at most"),
        ({"boards": {"wrist": {}}}, "the name is given to two things"),
        ({"targets": {"wrist": {"on": "arm"}}}, "two members of the cell are named 'wrist'"),
    ],
)
def test_a_wrong_cell_gets_one_sentence(tmp_path: Path, changes: dict[str, Any], sentence: str) -> None:
    track.Scene().write(tmp_path, 3)
    content = track.cell()
    for key, members in changes.items():
        own = content.setdefault(key, {})
        for name, entry in members.items():
            own[name] = {**own.get(name, content["boards"]["plate"] if key == "boards" else {}), **entry}
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(content))
    assert is_cell(tmp_path / "cell.yaml")
    with pytest.raises(ParseError) as error:
        load_cell(tmp_path / "cell.yaml")
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_too_few_pictures_get_one_sentence(tmp_path: Path) -> None:
    track.Scene().write(tmp_path, 2)
    cell = load_cell(tmp_path / "cell.yaml")
    readings = load_seen_readings(tmp_path / "poses.csv", cell, tmp_path / "corners.csv")
    with pytest.raises(InvalidInput, match="camera wrist and board plate need at least three pictures"):
        calibrate_cell(cell, readings)
    with pytest.raises(ParseError, match="holds no reading; expected columns such as x_mm@TARGET"):
        load_seen_readings(tmp_path / "poses.csv", cell)


def test_the_camera_is_written_for_hand_eye_tools(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    track.Scene(7).write(tmp_path, 25)
    monkeypatch.chdir(tmp_path)
    command = ["calibrate", "cell.yaml", "poses.csv", "--corners", "corners.csv", "--hand-eye", "camera.calib"]
    assert main([*command, "-o", "out"]) == 0
    written = Path("camera.calib").read_text(encoding="utf-8")
    assert "wrist" in written
    assert "plate" in written
