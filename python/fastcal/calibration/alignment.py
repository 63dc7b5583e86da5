# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""What was measured, as the core reads it, and the best rigid fit of base and tool to it."""

from __future__ import annotations

import numpy as np

from fastcal import _core
from fastcal.errors import InvalidInput
from fastcal.measurements.dataset import Dataset
from fastcal.robot.robot import Robot


def measurements(data: Dataset) -> _core.Measurements:
    """What was measured, as the core reads it."""
    if data.position is None and data.rotation is None and data.distance is None:
        raise InvalidInput(
            f"{data.source}: no measured column; expected x_mm y_mm z_mm, an orientation, or distance_mm"
        )
    return _core.Measurements(
        position=data.position,
        rotation=data.rotation,
        distance=data.distance,
        anchor=None if data.anchor is None else data.anchor.astype(np.int32),
        anchor_count=len(data.anchor_names) if data.distance is not None else 0,
        sigma_position=data.sigma_position,
        sigma_rotation=data.sigma_rotation,
    )


def align(robot: Robot, data: Dataset, threads: int = 1) -> _core.Alignment:
    """Best rigid fit of base and tool (and anchors) to the data; closed form, no initial guess."""
    return _core.align(robot.error_model, robot.samples(data), measurements(data), threads)
