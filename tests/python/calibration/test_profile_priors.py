# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Curves whose priors differ by many orders of magnitude are fitted as well as any."""

import numpy as np
import pytest

from fastcal.calibration.calibrate import calibrate
from fastcal.calibration.simulation import random_poses
from fastcal.measurements.dataset import Dataset
from fastcal_studies.simulated import Unmodelled, measure
from fastcal_studies.staubli_rx160l import TOOL_KG, WAVES_RAD, nominal_arm, true_arm

NOISE_M = 1e-5
CURVATURES = (1e-6, 3.16e-4, 1e-3, 1e-6, 3.16e-3, 1e-3)  # as cross-validation chose them for one arm


@pytest.mark.parametrize("seed", [1, 4])
def test_profiles_leave_less_than_geometry_alone(seed: int) -> None:
    """Their smoothest coefficients have priors of 1e-10 rad: beside such pivots those of geometry seemed to be nothing.

    All coefficients at 0 are the fit without profiles, so the fit with them leaves less.
    """
    nominal = nominal_arm()
    q = random_poses(nominal, 90, seed=seed)
    sent = Dataset.from_arrays(q, payload=np.full(len(q), TOOL_KG))
    data = measure(true_arm(seed), sent, Unmodelled(WAVES_RAD, 1.0, 0.0, seed), NOISE_M, seed)
    effects = [f"joint_profile@joint{j}:curvature={c}" for j, c in enumerate(CURVATURES, start=1)]
    alone = calibrate(nominal, data, loss="none", checks=False)
    both = calibrate(nominal, data, effects=["geometry", *effects], loss="none", checks=False)
    assert both.status == alone.status == "converged"
    assert both.train.after is not None
    assert alone.train.after is not None
    assert both.train.after.rms < alone.train.after.rms
