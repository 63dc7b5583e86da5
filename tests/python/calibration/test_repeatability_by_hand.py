# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""ISO 9283 repeatability of five visits, worked out by hand."""

import math

import numpy as np
import pytest

import fastcal
from fastcal.calibration.repeatability import repeatability

# Visits in mm about the commanded point; their mean is (1, 0, 0), their distances from it 2, 2, 1, 1 and 0.
VISITS = np.array([[3.0, 0, 0], [-1.0, 0, 0], [1.0, 1, 0], [1.0, -1, 0], [1.0, 0, 0]])
MEAN = (2 + 2 + 1 + 1 + 0) / 5
S = math.sqrt((2 * (2 - MEAN) ** 2 + 2 * (1 - MEAN) ** 2 + MEAN**2) / 4)  # n - 1 in the standard's formula


def test_rp_is_the_mean_distance_and_three_deviations_with_n_less_one() -> None:
    robot = fastcal.load_robot("ur5")
    q = np.tile([0.3, -1.0, 1.2, 0.4, 0.9, -0.2], (5, 1))
    error = 1e-3 * VISITS
    data = fastcal.Dataset.from_arrays(q, position=robot.forward(q)[:, :3, 3] - error)
    found = repeatability(data, error)
    assert found is not None
    np.testing.assert_allclose(found.repeatability, 1e-3 * (MEAN + 3 * S), rtol=1e-12)
    np.testing.assert_allclose(found.accuracy, 1e-3, rtol=1e-12)
    # 12 degrees of freedom: five visits of three coordinates, less the three of their mean.
    assert found.sigma == pytest.approx(1e-3 * math.sqrt((4 + 4 + 1 + 1) / 12), rel=1e-12)
