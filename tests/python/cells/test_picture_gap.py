# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The gap of a diagnosis from pictures is in pixels of a corner, and so is the noise, that of the joints included."""

import re
from pathlib import Path

import numpy as np
import pytest

from fastcal.diagnosis.diagnosis import diagnose
from fastcal.importers.corners import load_seen
from fastcal.io.robot_file import load_robot

from . import camera_scene as scene

COUNT, SEED = 60, 1


@pytest.mark.parametrize("joint_noise_deg", [0.0, 0.01])
def test_what_remains_is_what_the_true_cell_leaves(tmp_path: Path, joint_noise_deg: float) -> None:
    """Nothing is missing: held-out pictures are off by what the true cell is, drawn by numpy at commanded joints."""
    seen = scene.write(tmp_path, COUNT, seed=SEED, joint_noise_deg=joint_noise_deg)
    drawn = np.array([scene.seen(q) for q in scene.postures(COUNT, SEED)])
    true = float(np.sqrt(np.mean(np.sum((seen - drawn) ** 2, axis=2))))
    robot = load_robot(tmp_path / "cell.yaml")
    found = diagnose(robot, load_seen([tmp_path / "poses.csv"], robot, tmp_path / "corners.csv"))
    assert found.verdict == "none"
    gap = found.judged_gap
    assert gap.unit == "px"
    assert 0.9 * true < gap.sizes[-1] < 1.3 * true
    assert gap.floor == pytest.approx(true, rel=0.1)
    told = re.search(r"repeat to about (\S+) mrad", found.sigma_note)
    if joint_noise_deg:
        assert told is not None
        assert float(told[1]) == pytest.approx(1e3 * np.radians(joint_noise_deg), rel=0.15)
    else:
        assert told is None
    assert found.to_json_dict()["noise"]["corner"]["value"] * 2**0.5 == pytest.approx(gap.floor)
