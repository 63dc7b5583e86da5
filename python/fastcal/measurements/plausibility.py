# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""Measurements beside the nominal arm: were their columns meant otherwise?"""

from __future__ import annotations

from fastcal.measurements.checks import RobotFacts
from fastcal.measurements.column_check import Points, Suspicion
from fastcal.measurements.dataset import Dataset
from fastcal.measurements.frame_fit import Poses
from fastcal.measurements.orientation_check import Turns


def plausible(dataset: Dataset, robot: RobotFacts, poses: Poses) -> Suspicion | None:
    """Holds measurements against the nominal robot; None where they fit it, or where no other reading fits better.

    Args:
        dataset: Up to 60 of its rows with a whole point, or else with an orientation, are looked at.
        robot: The nominal arm's joint types and reach.
        poses: Poses (N, 4, 4) of the nominal robot at q (N, n), in any base and with any tool.
    """
    points = Points(dataset, robot, poses)
    return points.suspicion() or Turns(points).suspicion()
