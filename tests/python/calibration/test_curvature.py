# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Intervals of a fit that is not straight within them are said to be too narrow, of others not."""

from __future__ import annotations

import pytest

from fastcal import calibrate, load_robot, perturbed, random_poses, simulate
from fastcal.calibration.calibrate import CalibrationResult


def calibrated(name: str, seed: int, noise: float = 5e-5) -> CalibrationResult:
    nominal = load_robot(name)
    real = perturbed(nominal, seed=seed)
    data = simulate(real, random_poses(real, 100, seed=seed + 100), noise=noise, seed=seed + 200)
    return calibrate(nominal, data, loss="none", priors=False)


def are_too_narrow(found: CalibrationResult) -> bool:
    return "the fit is not straight" in found.bent and found.bent in found.caveats


@pytest.mark.parametrize("seed", [900, 902])
def test_a_printer_whose_tool_is_known_to_millimetres_is_no_straight_fit(seed: int) -> None:
    found = calibrated("delta_printer", seed)
    assert are_too_narrow(found)
    assert found.bent in found.notes
    assert not found.lacks_effect


@pytest.mark.parametrize("name", ["delta", "hexapod", "five_bar", "palletizer"])
def test_intervals_that_hold_are_not_doubted(name: str) -> None:
    assert not are_too_narrow(calibrated(name, 902))


def test_of_a_serial_arm_nothing_is_asked() -> None:
    assert not are_too_narrow(calibrated("ur5", 903))


@pytest.mark.parametrize("name", ["palletizer", "delta"])
def test_of_what_priors_hold_nothing_reaches_far(name: str) -> None:
    nominal = load_robot(name)
    real = perturbed(nominal, seed=902)
    data = simulate(real, random_poses(real, 60, seed=1002), noise=5e-5, seed=1102)
    found = calibrate(nominal, data, priors=True)
    assert found.status == "converged"
    assert not found.bent
