# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Cells with few pictures: corners share what the joints err, and the geometry is held by what is most likely."""

from pathlib import Path

import numpy as np
import pytest

from fastcal.cells.calibrate import CellResult, calibrate_cell
from fastcal.cells.errors import kind_errors
from fastcal.importers.corners import load_seen_readings
from fastcal.io.tree_file import load_cell

from . import track_scene as track

REPEATS = 0.003  # [deg]


def calibrated(folder: Path, scene: track.Scene, count: int, repeats_deg: float = REPEATS) -> CellResult:
    scene.write(folder, count, repeats_deg=repeats_deg)
    cell = load_cell(folder / "cell.yaml")
    return calibrate_cell(cell, load_seen_readings(folder / "poses.csv", cell, folder / "corners.csv"))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_the_joints_repeat_to_is_told_from_the_noise_of_pixels(tmp_path: Path, seed: int) -> None:
    found = calibrated(tmp_path, track.Scene(seed), 30)
    assert found.shared is not None
    assert np.degrees(found.shared.repeats) == pytest.approx(REPEATS, rel=0.35)
    assert found.to_json_dict()["joints_repeat_deg"] == pytest.approx(np.degrees(found.shared.repeats))


def test_joints_that_repeat_exactly_are_seen_to(tmp_path: Path) -> None:
    found = calibrated(tmp_path, track.Scene(4), 30, 0.0)
    assert found.shared is not None
    assert np.degrees(found.shared.repeats) < REPEATS / 5


def test_few_pictures_cost_little(tmp_path: Path) -> None:
    """What the model itself is off; with corners that err alone and a free geometry it is 0.41 px."""
    off = []
    for seed in range(5):
        scene = track.Scene(10 + seed)
        found = calibrated(tmp_path, scene, 12)
        scene.write(tmp_path, 40, noise_px=0.0, prefix="test_")
        exact = load_seen_readings(tmp_path / "test_poses.csv", found.cell, tmp_path / "test_corners.csv")
        rms = kind_errors(found.cell, exact)["corner"].rms
        assert rms is not None
        off.append(rms)
    assert np.mean(off) < 0.25  # [px]; 0.20 when written
