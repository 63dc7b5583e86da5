# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Points of another arm, which a calibration brings nearer but never near: it is asked which arm was measured.

Found with a tracker's file of others, whose arm is not among those included: an arm of the same axes was calibrated
from 139 to 9 mm without a word.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fastcal import calibrate, load_robot, perturbed, random_poses, simulate
from fastcal.calibration.inspection import check_fit

ARM = load_robot("ur5e")


@pytest.mark.parametrize(
    ("before", "after", "is_another"),
    [(5e-2, 2e-3, True), (5e-2, 1e-4, False), (2e-3, 2e-3, False)],
)
def test_an_arm_that_is_far_off_before_and_after_is_asked_about(before: float, after: float, is_another: bool) -> None:
    data = simulate(perturbed(ARM, seed=1), random_poses(ARM, 40, seed=1), noise=5e-5, seed=1)
    train = calibrate(ARM, data).train
    assert check_fit(ARM, train) == []
    off = np.zeros((40, 3))
    off[:, 0] = 1.0
    notes = check_fit(ARM, replace(train, error_before=before * off, error_after=after * off))
    assert [note.endswith("is it this arm that was measured?") for note in notes] == [True] * is_another
