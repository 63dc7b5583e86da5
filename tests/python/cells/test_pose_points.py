# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Points that a 3-D camera reads of a ball, beside the controller's poses alone: found without an initial guess."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from fastcal.calibration.point_hand_eye import point_hand_eye
from fastcal.cli.app import main

Array = NDArray[np.float64]
NOISE_MM = 0.2
BALL_MM = np.array([40.0, -25.0, 130.0])
EYE = Rotation.from_euler("xyz", [-76.0, 4.6, -4.7], degrees=True)
EYE_MM = np.array([-1180.0, 820.0, 500.0])


def session(rows: int = 14) -> tuple[Array, Array, Array]:
    """Angles of the arm (N, 3) as rx, ry, rz [deg], places (N, 3) [mm], and the ball in the camera (N, 3) [mm]."""
    rng = np.random.default_rng(7)
    angles = np.array([170.0, 5.0, 160.0]) + rng.uniform(-20, 20, (20, 3))
    places = np.array([-1150.0, 1400.0, 720.0]) + rng.uniform(-90, 90, (20, 3))
    ball = Rotation.from_euler("xyz", angles, degrees=True).apply(BALL_MM) + places
    seen = EYE.inv().apply(ball - EYE_MM) + rng.normal(0, NOISE_MM, (20, 3))
    return angles[:rows], places[:rows], seen[:rows]


def written(
    folder: Path, seen: Array, *, eye: str = "world", ball: str = "arm", name: str = "", turned: bool = True
) -> list[str]:
    """The cell and the poses, their columns with `name` before them, by angles or by quaternions."""
    angles, places, _ = session(len(seen))
    turns = Rotation.from_euler("xyz", angles, degrees=True).as_quat()[:, [3, 0, 1, 2]]
    titles = [*(f"{name}{axis}_mm" for axis in "xyz")]
    titles += [f"{name}r{axis}_deg" for axis in "xyz"] if turned else [f"{name}q{part}" for part in "wxyz"]
    (folder / "cell.yaml").write_text(
        f"arms: {{arm: {{robot: pose}}}}\nsensors: {{eye: {{on: {eye}}}}}\ntargets: {{ball: {{on: {ball}}}}}\n"
    )
    with (folder / "poses.csv").open("w", encoding="utf-8", newline="") as file:
        rows = np.hstack([places, angles if turned else turns, seen])
        csv.writer(file).writerows([[*titles, *(f"{axis}_mm@ball:eye" for axis in "xyz")], *rows.tolist()])
    return [str(folder / "cell.yaml"), str(folder / "poses.csv"), "-o", str(folder / "out")]


@pytest.mark.parametrize(("name", "turned"), [("", True), ("arm.", True), ("", False), ("arm.", False)])
def test_camera_and_ball_are_found_from_points(name: str, turned: bool, tmp_path: Path) -> None:
    assert main(["calibrate", *written(tmp_path, session()[2], name=name, turned=turned)]) == 0
    found = json.loads((tmp_path / "out/result.json").read_text(encoding="utf-8"))
    value = {f"{of['owner']} {of['name']}": (of["value"], of["std"]) for of in found["parameters"]}
    true = dict(zip((f"ball {axis}_mm" for axis in "xyz"), BALL_MM, strict=True))
    true |= dict(zip((f"eye {axis}_mm" for axis in "xyz"), EYE_MM, strict=True))
    assert value.keys() >= true.keys()
    for key, of in true.items():
        assert value[key][0] == pytest.approx(of, abs=4 * value[key][1]), key
    assert found["train"]["kinds"]["position"]["after"]["rms"] < 1.5 * NOISE_MM * 3**0.5


def test_which_end_stands_and_slipped_rows_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seen = session()[2]
    assert main(["calibrate", *written(tmp_path, seen, eye="arm", ball="world")]) == 2
    told = "points of ball as eye saw them: does the sensor stand where the file has the target"
    assert told in capsys.readouterr().err
    main(["calibrate", *written(tmp_path, seen, eye="arm", ball="world"), "--as-read"])
    assert told not in capsys.readouterr().err
    assert main(["calibrate", *written(tmp_path, session(15)[2][1:])]) == 2
    assert "are the points shifted by" in capsys.readouterr().err


def test_columns_of_a_pose_that_are_missing_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = written(tmp_path, session()[2])
    text = (tmp_path / "poses.csv").read_text(encoding="utf-8")
    (tmp_path / "poses.csv").write_text(text.replace("rz_deg", "rz"), encoding="utf-8")
    assert main(["calibrate", *files]) == 2
    assert "column 'rz' needs a unit of angle at its end" in capsys.readouterr().err
    (tmp_path / "poses.csv").write_text(text.replace("rz_deg", "other"), encoding="utf-8")
    assert main(["calibrate", *files]) == 2
    assert "there is no column arm.rz_deg; the pose of arm 'arm' is arm.x_mm ... arm.qz, or" in capsys.readouterr().err


def test_too_few_points_say_nothing() -> None:
    assert point_hand_eye(np.tile(np.eye(4), (3, 1, 1)), np.zeros((3, 3))) is None
