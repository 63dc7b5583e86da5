# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What joints repeat to is found though some of what is tried leaves nothing of a parameter but rounding."""

import numpy as np
import pytest
from scipy import linalg

from fastcal.cells.evidence import Near, most_likely


def test_noise_that_leaves_nothing_of_a_parameter_is_not_likely() -> None:
    random = np.random.default_rng(1)
    count, variance = 60, 4.0
    J = random.normal(size=(count, 2))
    r = -J @ np.array([1.0, 2.0]) + np.sqrt(1 + variance) * random.normal(size=count)
    # Of the first parameter the other numbers, 200 of size 1, hold nothing; of what rounding leaves the sign is open.
    near = Near(np.diag([-1e-7, 50.0]), np.array([0.0, -100.0]), 400.0, 200, J, r, np.full(count, 1e4))
    with pytest.raises(linalg.LinAlgError):
        near.posterior(1.0, 100.0, np.zeros(2), np.zeros(2))
    found = most_likely(near, np.zeros(2), np.zeros(2), np.zeros(2, dtype=bool))
    assert found.scale == pytest.approx(1.0, rel=0.2)
    assert found.repeats / found.scale == pytest.approx(np.sqrt(variance) / 1e4, rel=0.3)
