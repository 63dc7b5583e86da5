# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""`--mend` identifies a lens that the pictures contradict, and no other."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from fastcal.calibration.calibrate import CalibrationResult, calibrate
from fastcal.calibration.freed_lenses import predicts_better
from fastcal.cli.app import main
from fastcal.importers.corners import load_seen
from fastcal.io.robot_file import load_robot
from fastcal.robot.rig import board_corners

from . import camera_scene as scene
from .picture_mistakes import ERROR_MM, of_camera, two_cameras

WRONG = (1094.0, 1096.0)  # [px] in place of scene.FOCAL
FREED = "the pictures contradict the lens stated for camera"


def calibrated(folder: Path, **options: Any) -> CalibrationResult:
    robot = load_robot(folder / "cell.yaml")
    given = load_seen([folder / "poses.csv"], robot, folder / "corners.csv")
    return calibrate(robot, given, **options)


def test_a_wrong_lens_is_identified(tmp_path: Path) -> None:
    uv = scene.write(tmp_path, 20, error_mm=ERROR_MM, joint_noise_deg=0.001)
    of_camera(focal_px=list(WRONG))(tmp_path, uv)
    found = calibrated(tmp_path, mend=True)
    assert [note.split(":")[0] for note in found.notes if FREED in note] == [f"{FREED} wrist"]
    camera = found.model.description.cameras["wrist"]
    assert camera["focal_px"] == pytest.approx(scene.FOCAL, rel=1e-3)
    assert camera["intrinsics"] == "identify"
    assert found.train.kinds["corner"].rms == pytest.approx(0.1 * 2**0.5, rel=0.15)
    for kept in (calibrated(tmp_path), calibrated(tmp_path, mend=True, as_read=True)):
        assert kept.model.description.cameras["wrist"]["focal_px"] == list(WRONG)
        assert any(FREED in note and note.endswith("--mend identifies it") for note in kept.notes)


@pytest.mark.parametrize("seed", range(4))
def test_a_right_lens_is_kept(tmp_path: Path, seed: int) -> None:
    """The arm is off by half a millimetre, its joints repeat to 0.01 degrees, and in two of four the board is bent."""
    bent = board_corners({"kind": "checkerboard", "columns": 7, "rows": 5, "square_mm": 25, "bend_mm": [1, 0, 0.5]})
    flat = scene.corners
    try:
        scene.corners = (lambda: 1000 * bent) if seed % 2 else flat
        scene.write(tmp_path, 24, seed, error_mm=ERROR_MM, joint_noise_deg=0.01)
    finally:
        scene.corners = flat
    assert not any(FREED in note for note in calibrated(tmp_path, mend=True).notes)


@pytest.mark.parametrize("wrong", [("right",), ("left", "right")])
def test_of_two_cameras_the_wrong_ones_are_identified(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], wrong: tuple[str, ...]
) -> None:
    scene.write(tmp_path, 18, error_mm=ERROR_MM)
    two_cameras(tmp_path, [])
    file = tmp_path / "cell.yaml"
    content = yaml.safe_load(file.read_text())
    for name in wrong:
        content["cameras"][name]["focal_px"] = list(WRONG)
    file.write_text(yaml.safe_dump(content))
    words = [str(file), str(tmp_path / "poses.csv"), "--corners", str(tmp_path / "corners.csv")]
    assert main(["calibrate", *words, "--mend", "-o", str(tmp_path / "out")]) == 0
    assert f"{FREED} {' and camera '.join(wrong)}:" in capsys.readouterr().err
    assert FREED in (tmp_path / "out/report.html").read_text()
    model = yaml.safe_load((tmp_path / "out/model.yaml").read_text())
    for name in ("left", "right"):
        camera = model["cameras"][name]
        assert camera["intrinsics"] == ("identify" if name in wrong else "known")
        assert camera["focal_px"] == pytest.approx(scene.FOCAL, rel=2e-3)


def test_no_picture_that_is_far_off_decides() -> None:
    before, after = np.full(12, 0.3), np.full(12, 0.31)
    before[0] = 30.0
    assert not predicts_better(before, after)
    after = np.linspace(0.1, 0.2, 12)
    before[0] = after[0] = 30.0
    assert predicts_better(before, after)
    assert not predicts_better(before[:6], after[:6])  # too few postures
