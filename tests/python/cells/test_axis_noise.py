# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Positions that a camera reads are coarser along its view: each axis weighs by its own noise, where that is sure."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fastcal.cells import calibrate, fit
from fastcal.cells.axis_noise import axis_noise
from fastcal.io.tree_file import load_cell
from fastcal.io.tree_readings import load_readings
from fastcal.robot.core_model import pose as pose_of

from .test_hand_eye import X, write_poses

FloatArray = NDArray[np.float64]


def test_alike_axes_are_rarely_told_apart_and_others_mostly() -> None:
    random = np.random.default_rng(1)
    r = random.standard_normal((1000, 30, 3))
    alike = sum(axis_noise(of) is not None for of in r)
    apart = [axis_noise(of * [1.0, 1.0, 4.0]) for of in r]
    assert alike < 50  # three pairs at 2.5 deviations: 2 to 4 %
    assert sum(of is not None for of in apart) > 900
    assert np.median([of[2] / of[0] for of in apart if of is not None]) == pytest.approx(4.0, rel=0.1)


def test_few_or_exact_rows_say_nothing() -> None:
    random = np.random.default_rng(2)
    assert axis_noise(random.standard_normal((11, 3)) * [1, 1, 9]) is None
    assert axis_noise(np.zeros((30, 3))) is None
    half = random.standard_normal((40, 3)) * [1, 1, 9]
    half[::2] = np.nan
    found = axis_noise(half)
    assert found is not None
    np.testing.assert_array_equal(found, axis_noise(half[1::2]))


def test_a_camera_is_found_better_with_the_noise_of_each_axis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def off(seed: int) -> float:
        cell, poses = write_poses(tmp_path, 30)
        lines = Path(poses).read_text().splitlines()
        at = [lines[0].split(",").index(f"{axis}_mm@board:camera") for axis in "xyz"]
        random = np.random.default_rng(seed)
        rows = [line.split(",") for line in lines[1:]]
        for row in rows:
            for column, sigma in zip(at, (1.0, 1.0, 6.0), strict=True):
                row[column] = str(float(row[column]) + sigma * random.standard_normal())
        Path(poses).write_text("\n".join([lines[0], *(",".join(row) for row in rows)]) + "\n")
        of = load_cell(cell)
        found = calibrate.calibrate_cell(of, load_readings(poses, of))
        is_told = "axis by axis" in found.noise["position"].note
        assert is_told is (fit.with_axis_noise is real)
        camera = next(point for point in found.cell.points if point.name == "camera")
        return float(np.linalg.norm(1e3 * pose_of(camera.place)[:3, 3] - X[:3, 3]))

    real = fit.with_axis_noise
    monkeypatch.setattr(fit, "settled_poses", lambda *given: None)  # which weighs each axis by itself
    weighed = [off(seed) for seed in range(8)]
    monkeypatch.setattr(fit, "with_axis_noise", lambda readings, views: (readings, []))
    alike = [off(seed) for seed in range(8)]
    assert np.mean(weighed) < 0.8 * np.mean(alike)
