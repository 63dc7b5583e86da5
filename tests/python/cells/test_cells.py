# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""An arm, a camera and a board from corners in pictures: files, what is identified, and pictures in the wrong place."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.pictures import judged_pictures
from fastcal.cli.app import main
from fastcal.diagnosis import diagnose
from fastcal.errors import ParseError
from fastcal.importers.corners import load_seen
from fastcal.io.robot_file import load_robot, write_spec
from fastcal.measurements.dataset import Dataset
from fastcal.robot.core_model import pose
from fastcal.robot.robot import Robot

from . import camera_scene as camera


def loaded(folder: Path) -> tuple[Robot, Dataset]:
    robot = load_robot(folder / "cell.yaml")
    return robot, load_seen([folder / "poses.csv"], robot, folder / "corners.csv")


def test_camera_and_board_are_found_from_no_guess(tmp_path: Path) -> None:
    camera.write(tmp_path)
    robot, data = loaded(tmp_path)
    # Where the file has them is of no importance.
    robot.spec["cameras"]["wrist"] |= {"xyz_mm": [500, 300, -200], "rpy_deg": [90, 40, -120]}
    found = calibrate(robot, data, parameters=[], checks=False)
    assert found.status == "converged"
    for entry, truth in (
        (found.model.spec["cameras"]["wrist"], camera.WRIST),
        (found.model.spec["boards"]["plate"], camera.PLATE),
    ):
        T = pose(entry)
        assert np.linalg.norm(1000 * T[:3, 3] - truth[:3, 3]) < 0.2
        assert np.linalg.norm(T[:3, :3] - truth[:3, :3]) < 5e-4
        assert len(entry["identified"]["std_mm"]) == 3
    after = found.train.kinds["corner"].statistics[1]
    assert after is not None
    assert after.rms == pytest.approx(0.1 * 2**0.5, rel=0.05)  # of u and v together


def test_the_arm_is_identified_with_them_and_predicts_other_poses(tmp_path: Path) -> None:
    (tmp_path / "test").mkdir()
    camera.write(tmp_path, 40, error_mm=1.5)
    camera.write(tmp_path / "test", 10, seed=7, error_mm=1.5)
    found = calibrate(*loaded(tmp_path), checks=False)
    before, after = found.train.kinds["corner"].statistics
    assert before is not None
    assert after is not None
    assert before.rms > 3 * after.rms
    write_spec(found.model.spec, tmp_path / "model.yaml")
    model = load_robot(tmp_path / "model.yaml")
    seen = evaluate(model, load_seen([tmp_path / "test/poses.csv"], model, tmp_path / "test/corners.csv"))
    on_test = seen.kinds["corner"].statistics[1]
    assert on_test is not None
    assert on_test.rms < 0.1 * 2**0.5 * 1.3


def test_the_lens_is_identified_where_that_is_asked(tmp_path: Path) -> None:
    camera.write(tmp_path, 40)
    wrong = camera.cell(intrinsics="identify", focal_px=[1120, 1080], centre_px=[650, 470], distortion=[0, 0, 0, 0, 0])
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(wrong))
    found = calibrate(*loaded(tmp_path), parameters=[], checks=False)
    lens = found.model.spec["cameras"]["wrist"]
    assert lens["focal_px"] == pytest.approx(camera.FOCAL, abs=1)
    assert lens["centre_px"] == pytest.approx(camera.CENTRE, abs=1.5)
    assert lens["distortion"][0] == pytest.approx(camera.LENS[0], abs=0.02)
    assert {p.unit for p in found.parameters if p.name.startswith("fx")} == {"px"}


def test_what_is_known_within_a_sigma_is_held_there(tmp_path: Path) -> None:
    camera.write(tmp_path)
    held = camera.cell(sigma_mm=1e-4, sigma_deg=1e-5)
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(held))
    found = calibrate(*loaded(tmp_path), parameters=[], checks=False, as_read=True)
    assert found.model.spec["cameras"]["wrist"]["xyz_mm"] == pytest.approx([0, -70, 50], abs=0.05)
    fixed = camera.cell(fixed=True)
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(fixed))
    found = calibrate(*loaded(tmp_path), parameters=[], checks=False, as_read=True)
    assert found.model.spec["cameras"]["wrist"]["xyz_mm"] == [0, -70, 50]
    assert not any(p.owner == "camera wrist" for p in found.parameters)


def test_a_board_read_from_its_other_end_is_renumbered(tmp_path: Path) -> None:
    uv = camera.write(tmp_path)
    robot, whole = loaded(tmp_path)
    turned = [2, 5, 11, 20]
    uv[turned] = uv[turned, ::-1]
    camera.write_corners(tmp_path, uv)
    looked = judged_pictures(robot, loaded(tmp_path)[1])
    assert np.array_equal(looked.data.observed["corner"], whole.observed["corner"])
    assert "rows 2, 5, 11, 20 it was read from its other end" in looked.notes[0]


@pytest.mark.parametrize("mend", [False, True])
def test_exchanged_and_slipped_pictures_are_named_and_mended(tmp_path: Path, mend: bool) -> None:
    uv = camera.write(tmp_path)
    robot, whole = loaded(tmp_path)
    uv[[3, 8]] = uv[[8, 3]]
    camera.write_corners(tmp_path, uv)
    looked = judged_pictures(robot, loaded(tmp_path)[1], mend=mend)
    assert "the pictures of rows 3 and 8 are exchanged" in looked.notes[0]
    expected = whole.observed["corner"].copy()
    if not mend:
        expected[[3, 8]] = np.nan
    assert np.array_equal(looked.data.observed["corner"], expected, equal_nan=True)
    uv = whole.observed["corner"].reshape(uv.shape).copy()
    uv[10:13] = uv[9:12]
    uv[9] = np.nan
    camera.write_corners(tmp_path, uv)
    assert "slipped to the next row" in judged_pictures(robot, loaded(tmp_path)[1], mend=mend).notes[0]


def test_of_two_pictures_in_a_row_the_one_that_fits_is_used(tmp_path: Path) -> None:
    uv = camera.write(tmp_path)
    robot, whole = loaded(tmp_path)
    lines = (tmp_path / "corners.csv").read_text().splitlines()
    moved = [line.replace("4,", "5,", 1) for line in lines if line.startswith("4,")]
    kept = [line for line in lines if not line.startswith("4,")]
    (tmp_path / "corners.csv").write_text("\n".join([kept[0], *moved, *kept[1:]]) + "\n")
    looked = judged_pictures(robot, loaded(tmp_path)[1])
    assert "the picture of row 5 fits the posture of row 4" in looked.notes[0]
    expected = whole.observed["corner"].copy()
    expected[4] = np.nan
    assert np.array_equal(looked.data.observed["corner"], expected, equal_nan=True)
    assert uv.shape == (30, 24, 2)


def test_nothing_is_said_of_pictures_that_are_right(tmp_path: Path) -> None:
    camera.write(tmp_path, error_mm=3.0)
    robot, data = loaded(tmp_path)
    assert judged_pictures(robot, data).notes == ()


def test_a_diagnosis_of_a_good_arm_names_nothing_though_its_joints_are_not_exact(tmp_path: Path) -> None:
    camera.write(tmp_path, 40, joint_noise_deg=2e-3)
    found = diagnose(*loaded(tmp_path))
    assert found.verdict == "none"
    start = found.state.fit.problem
    assert start.repeatability == pytest.approx(np.radians(2e-3) / 0.1, rel=0.35)


def test_the_commands_read_cells_and_corners(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    camera.write(tmp_path)
    files = [str(tmp_path / "poses.csv"), "--corners", str(tmp_path / "corners.csv")]
    assert main(["calibrate", str(tmp_path / "cell.yaml"), *files, "-o", str(tmp_path / "out")]) == 0
    result = json.loads((tmp_path / "out/result.json").read_text())
    assert result["train"]["kinds"]["corner"]["unit"] == "px"
    assert result["train"]["kinds"]["corner"]["count"] == 30 * 24
    assert main(["evaluate", str(tmp_path / "out/model.yaml"), *files, "-o", str(tmp_path / "e.json")]) == 0
    figures = json.loads((tmp_path / "e.json").read_text())["kinds"]["corner"]["after"]
    assert figures["rms"] == pytest.approx(result["train"]["kinds"]["corner"]["after"]["rms"], rel=1e-6)
    assert "cameras and boards are where the model places them" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("99,wrist,plate,0,100,100", "row must be 0 to 29, as the poses have 30 rows, got 99"),
        ("0,head,plate,0,100,100", "there is no camera 'head'; expected wrist"),
        ("0,wrist,tray,0,100,100", "there is no board 'tray'; expected plate"),
        ("0,wrist,plate,24,100,100", "corner must be 0 to 23 on board plate, got 24"),
        ("0,wrist,plate,1.5,100,100", "expected a whole number"),
        ("0,wrist,plate,1,100,9000", "lies outside the pictures of camera wrist (1280 x 960)"),
        ("0,wrist,plate,1,,100", "expected a number"),
    ],
)
def test_a_wrong_corner_is_refused_with_its_line(tmp_path: Path, line: str, sentence: str) -> None:
    camera.write(tmp_path)
    path = tmp_path / "corners.csv"
    path.write_text(path.read_text() + line + "\n")
    with pytest.raises(ParseError) as refused:
        loaded(tmp_path)
    assert sentence in str(refused.value)
    assert refused.value.line == 1 + 30 * 24 + 1


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"on": "arm.link9"},
            "cameras.wrist.on: there is no frame 'arm.link9'; expected world, arm, arm.base or arm.link1",
        ),
        ({"on": "ceiling"}, "there is no frame 'ceiling'"),
        ({"size_px": [1.28, 0.96]}, "cameras.wrist.size_px: expected width and height in whole pixels"),
        ({"focal_px": [8.0, 8.0]}, "expected focal lengths in pixels, 64 to 64000"),
        ({"centre_px": [1300, 480]}, "expected a pixel of a picture of 1280 x 960"),
        ({"distortion": [0] * 9}, "a list of at most 8 coefficients"),
        ({"sigma_mm": 0}, "a standard deviation above 0"),
        ({"focus": 1}, "the key 'focus' is not known"),
    ],
)
def test_a_wrong_camera_is_refused_with_its_place(tmp_path: Path, change: dict[str, object], sentence: str) -> None:
    camera.write(tmp_path, 1)
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(camera.cell(**change)))
    with pytest.raises(ParseError) as refused:
        load_robot(tmp_path / "cell.yaml")
    assert sentence in str(refused.value)


def test_two_things_of_one_name_and_two_arms_are_refused(tmp_path: Path) -> None:
    camera.write(tmp_path, 1)
    cell = camera.cell()
    cell["boards"]["wrist"] = cell["boards"].pop("plate")
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    with pytest.raises(ParseError, match="the name is given to two things, here and in cameras"):
        load_robot(tmp_path / "cell.yaml")
    cell = camera.cell()
    cell["arms"]["other"] = cell["arms"]["arm"]
    (tmp_path / "cell.yaml").write_text(yaml.safe_dump(cell))
    with pytest.raises(ParseError, match="expected one arm, got 2"):
        load_robot(tmp_path / "cell.yaml")


def test_a_corner_that_is_given_three_times_is_refused(tmp_path: Path) -> None:
    camera.write(tmp_path)
    path = tmp_path / "corners.csv"
    path.write_text(path.read_text() + 2 * "0,wrist,plate,0,100,100\n")
    with pytest.raises(ParseError, match="row 0, corner 0 of this camera and board is given three times"):
        loaded(tmp_path)


def test_corners_without_a_camera_are_refused(tmp_path: Path) -> None:
    camera.write(tmp_path)
    robot = load_robot(tmp_path / "arm.yaml")
    with pytest.raises(ParseError, match="the file has no cameras or no boards"):
        load_seen([tmp_path / "poses.csv"], robot, tmp_path / "corners.csv")
