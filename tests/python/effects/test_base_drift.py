# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A drift of the base is known while it was measured: before and after the base stands still."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.extrapolation_notes import range_notes
from fastcal.calibration.prediction import predict
from fastcal.calibration.simulation import simulate
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot

RATE = 2e-8  # [m/s] along z


@pytest.fixture(scope="module")
def drifting(arm: Robot, poses: Dataset, with_effects: Any) -> Dataset:
    """Measured from 100 to 7300 s."""
    timed = replace(poses, time=np.random.default_rng(5).permutation(np.linspace(100.0, 7300.0, len(poses))))
    drift = {"effect": "base_drift", "owner": "base", "parameters": {"rate_z_mm_s": 1e3 * RATE}}
    return simulate(with_effects(arm, drift), timed, noise=1e-6, seed=3)


def height(model: Robot, data: Dataset, time: float) -> float:
    """Of the first pose at a time [m], over that at 3700 s."""
    rows = replace(data.select(np.zeros(2, dtype=np.intp)), time=np.array([3700.0, time]))
    z = model.poses(rows)[:, 2, 3]
    return float(z[1] - z[0])


def test_it_goes_on_while_it_was_measured_and_stands_still_beyond(arm: Robot, drifting: Dataset) -> None:
    model = calibrate(arm, drifting, effects="geometry,base_drift").model
    (entry,) = model.spec["effects"]
    assert (entry["first_s"], entry["last_s"]) == (100.0, 7300.0)
    end = 3600.0 * RATE
    assert height(model, drifting, 7300.0) == pytest.approx(end, abs=5e-6)
    assert height(model, drifting, 1e6) == height(model, drifting, 7300.0)
    assert height(model, drifting, -1e6) == height(model, drifting, 100.0)
    assert range_notes(model, drifting) == []
    later = replace(drifting, time=drifting.time + 10.0)
    (note,) = predict(model, later).notes
    assert note == (
        "the time is outside the 100 to 7300 s that base_drift@base was fitted on in 1 rows; there it is held constant"
    )


def test_fitted_to_further_rows_it_covers_them_too(arm: Robot, drifting: Dataset) -> None:
    early, late = (drifting.select(np.flatnonzero(part)) for part in (drifting.time < 4000, drifting.time >= 4000))
    first = calibrate(arm, early, effects="geometry,base_drift").model
    (entry,) = calibrate(first, late, effects="geometry,base_drift").model.spec["effects"]
    assert (entry["first_s"], entry["last_s"]) == (100.0, 7300.0)
    assert entry["parameters"]["rate_z_mm_s"]["value"] == pytest.approx(1e3 * RATE, abs=3e-6)


def test_a_file_without_times_lets_it_go_on(arm: Robot, drifting: Dataset, with_effects: Any) -> None:
    drift = {"effect": "base_drift", "owner": "base", "parameters": {"rate_z_mm_s": 1e3 * RATE}}
    assert height(with_effects(arm, drift), drifting, 1e6) == pytest.approx((1e6 - 3700.0) * RATE)
