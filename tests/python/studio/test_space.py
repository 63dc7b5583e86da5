# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The boxes of the plan's view."""

from __future__ import annotations

import fastcal
from fastcal.studio.space import column, floor


def test_a_floor_and_a_column_begin_beside_the_arm() -> None:
    robot = fastcal.load_robot("ur5e").with_(base={"xyz_mm": [1000.0, 0.0, 500.0], "rpy_deg": [0.0, 0.0, 30.0]})
    (low, high), (left, right) = floor(robot), column(robot)
    assert low[0] < 1000 - 1000 * robot.reach < 1000 + 1000 * robot.reach < high[0]
    assert low[2] < high[2] < 500
    assert 1000 < left[0] < right[0] < 1000 + 1000 * robot.reach
    assert left[2] <= high[2] < 500 < right[2]
