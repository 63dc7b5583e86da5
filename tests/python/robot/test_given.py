# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What is given for a robot or for data."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

import fastcal
from fastcal.errors import InvalidInput


@pytest.mark.parametrize(
    "use", [fastcal.calibrate, fastcal.diagnose, fastcal.evaluate, fastcal.choose_parameters, fastcal.bootstrap]
)
def test_data_without_rows_are_refused_at_the_door(use: Callable[..., Any]) -> None:
    robot = fastcal.load_robot("ur5e")
    data = replace(fastcal.simulate(robot, fastcal.random_poses(robot, 3, seed=1)), source="monday.csv")
    with pytest.raises(InvalidInput, match=r"^monday\.csv: the data hold no rows; expected at least one$"):
        use(robot, data.select([]))
