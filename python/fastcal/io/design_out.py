# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A design as a table: order, qN_deg (qN_mm), payload_kg and, where a direction matters, approachN."""

from __future__ import annotations

import os

import numpy as np

from fastcal.design.result import PoseDesign
from fastcal.io.tables import write_csv
from fastcal.robot import Robot, length_or_angle_unit
from fastcal.units import from_si


def write_design(path: str | os.PathLike[str], design: PoseDesign, robot: Robot) -> None:
    """Writes the poses as CSV in the order of visiting; `load_measurements` reads the file.

    Raises:
        InvalidInput: The file cannot be written.
    """
    columns: dict[str, list[float] | list[int]] = {"order": list(range(1, len(design) + 1))}
    for joint, spec in enumerate(robot.spec["joints"], start=1):
        unit = length_or_angle_unit(spec)
        columns[f"q{joint}_{unit}"] = np.round(from_si(design.q[:, joint - 1], unit), 6).tolist()
    columns["payload_kg"] = design.payload.tolist()
    if design.approach is not None:
        for joint in np.flatnonzero(design.approach.any(axis=0)):
            columns[f"approach{joint + 1}"] = design.approach[:, joint].astype(int).tolist()
    write_csv(path, columns)
