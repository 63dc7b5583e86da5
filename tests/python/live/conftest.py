# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A simulated arm and the lines that a session gets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import fastcal
from fastcal.io.measurements_out import file_columns


@dataclass
class Lines:
    """A header line and rows; `shift` (N, 3) [m] is added to the points, NaN drops them."""

    robot: fastcal.Robot
    data: fastcal.Dataset

    def text(self, shift: Any = 0.0, q: Any = None) -> tuple[str, list[str]]:
        assert self.data.position is not None
        joints = self.data.q if q is None else q
        columns = file_columns(
            replace(self.data, q=joints, position=self.data.position + shift), self.robot.joint_types
        )
        cells = [["" if value != value else repr(float(value)) for value in column] for column in columns.values()]
        return ",".join(columns), [",".join(row) for row in zip(*cells, strict=True)]


def made(arm: str, seed: int) -> Lines:
    """Forty poses of an arm that is off by half a millimetre and half a milliradian, with a tracker's noise."""
    nominal = fastcal.load_robot(arm)
    true = fastcal.perturbed(nominal, seed=seed)
    poses = fastcal.random_poses(nominal, 40, seed=seed + 2)
    return Lines(nominal, fastcal.simulate(true, poses, noise=3e-5, seed=seed + 3))


@pytest.fixture(scope="session")
def lines_of() -> Callable[[str, int], Lines]:
    """Makes the lines of an arm."""
    return made


@pytest.fixture(scope="session")
def simulated() -> Lines:
    """Those of a UR5."""
    return made("ur5", 3)


@pytest.fixture
def shift() -> Any:
    """(40, 3) [m] with one row that slipped by 1.2 mm and one without a point."""
    out = np.zeros((40, 3))
    out[15] = np.nan
    out[25] = [0.0009, -0.0006, 0.0004]
    return out
