# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Sets that are not drawn from the library: the arms of the papers' studies, and some rows of open real sets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fastcal import Robot, load_measurements, load_robot
from fastcal.measurements.dataset import Dataset
from fastcal_studies.diagnosed import Sample, sample
from fastcal_studies.study import NAMES

Random = np.random.Generator

REAL = Path(__file__).resolve().parents[3] / "shared" / "data"  # beside the repository, as the tests have it
REAL_SETS = (("ur5_tracker", "measurements.csv"), ("ur10_tmac", "campaign_b.csv"), ("ur10_tmac", "campaign_c.csv"))
ROWS = (40, 450)


def paper(random: Random) -> tuple[str, Sample]:
    """An arm of a paper, its hidden errors and its rows."""
    name, seed = str(random.choice(NAMES)), int(random.integers(10, 1000))
    return f"{name} {seed}", sample(name, seed)


def real(random: Random) -> tuple[str, Robot, Dataset, Dataset]:
    """Rows of a real set to diagnose, and the others.

    Raises:
        FileNotFoundError: The sets are not beside the repository.
    """
    folder, file = REAL_SETS[int(random.integers(len(REAL_SETS)))]
    robot = load_robot(REAL / folder / "robot.yaml")
    data = load_measurements(REAL / folder / file, robot)
    count = min(int(np.exp(random.uniform(*np.log(ROWS)))), int(0.7 * len(data)))
    rows = random.permutation(len(data))
    return f"{folder} {file}", robot, data.select(np.sort(rows[:count])), data.select(np.sort(rows[count:]))
