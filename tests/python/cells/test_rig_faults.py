# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Late pictures, rolling shutters, sagging mounts and knocks are named, each by its own name alone, with their size."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fastcal.calibration.evaluation import evaluate
from fastcal.calibration.moving_rig import speeds_of_times
from fastcal.diagnosis import Diagnosis, diagnose
from fastcal.importers.corners import load_seen
from fastcal.io.robot_file import load_robot

from . import rig_faults

POSES = 36
FAULTS: dict[str, dict[str, Any]] = {
    "bracket_sag@wrist": {"bracket_deg": 0.1},
    "time_offset@wrist": {"delay_s": 0.006},
    "rolling_shutter@wrist": {"readout_s": 0.02},
    "placement_step@wrist": {"at_row": 14, "camera_mm": np.array([0.5, 0.0, 0.3])},
    "placement_step@plate": {"at_row": 20, "board_mm": np.array([-0.5, 0.6, 0.2])},
}


def found(folder: Path, seed: int = 1, **fault: Any) -> Diagnosis:
    rig_faults.write(folder, POSES, seed, **fault)
    robot = load_robot(folder / "cell.yaml")
    return diagnose(robot, load_seen([folder / "poses.csv"], robot, folder / "corners.csv"))


@pytest.mark.parametrize("hidden", FAULTS)
def test_a_fault_of_the_rig_is_named_and_mended(tmp_path: Path, hidden: str) -> None:
    result = found(tmp_path, **FAULTS[hidden])
    assert [(finding.label, finding.grade) for finding in result.effects] == [(hidden, "A")]
    after = result.train.kinds["corner"].statistics[1]
    assert after is not None
    assert after.rms < 0.1 * 2**0.5 * 1.1


def test_a_rig_as_its_file_says_has_none(tmp_path: Path) -> None:
    assert found(tmp_path).verdict == "none"


def test_a_delay_is_found_with_its_sign_and_predicts_other_pictures(tmp_path: Path) -> None:
    result = found(tmp_path, delay_s=-0.02)
    value = result.effects[0].parameters["time_offset_s"]
    assert value.value == pytest.approx(-0.02, abs=5e-4)
    result.model.save(tmp_path / "model.yaml")
    (tmp_path / "other").mkdir()
    rig_faults.write(tmp_path / "other", 12, 7, delay_s=-0.02)
    model = load_robot(tmp_path / "model.yaml")
    data = load_seen([tmp_path / "other/poses.csv"], model, tmp_path / "other/corners.csv")
    after = evaluate(model, data).kinds["corner"].statistics[1]
    assert after is not None
    assert after.rms < 0.1 * 2**0.5 * 1.3


def test_two_faults_are_both_named(tmp_path: Path) -> None:
    result = found(tmp_path, bracket_deg=0.1, delay_s=0.006)
    assert {finding.label for finding in result.effects} == {"bracket_sag@wrist", "time_offset@wrist"}


def test_a_shutter_and_a_delay_are_one_name(tmp_path: Path) -> None:
    """The line at which joints were read is one more number of a rolling shutter."""
    result = found(tmp_path, readout_s=0.02, delay_s=0.01)
    assert [finding.label for finding in result.effects] == ["rolling_shutter@wrist"]
    numbers = {name: of.value for name, of in result.effects[0].parameters.items()}
    assert numbers == {"time_offset_s": pytest.approx(0.01, abs=2e-4), "readout_s": pytest.approx(0.02, abs=6e-4)}


def test_the_row_of_a_knock_is_found(tmp_path: Path) -> None:
    result = found(tmp_path, **FAULTS["placement_step@plate"])
    assert result.effects[0].parameters["at_row"].value == 20


def test_speeds_come_from_times_where_rows_are_near() -> None:
    time = np.array([0.0, 0.1, 0.2, 9.0, 9.05])
    q = 0.5 * time[:, np.newaxis] * np.array([1.0, -2.0])
    speed = speeds_of_times(q, time)
    assert speed is not None
    assert speed[1] == pytest.approx([0.5, -1.0])
    assert not speed[[0, 2, 3, 4]].any()
    assert speeds_of_times(q, 10 * time) is None
