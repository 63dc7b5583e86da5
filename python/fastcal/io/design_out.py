# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A design as a table: order, qN_deg (jN_deg where a controller counts otherwise), payload_kg, approachN, plane."""

from __future__ import annotations

import os

import numpy as np

from fastcal.design.candidates import Candidates
from fastcal.design.result import PoseDesign
from fastcal.io.tables import write_csv
from fastcal.robot.pendant import controller_columns
from fastcal.robot.robot import Robot


def write_design(path: str | os.PathLike[str], design: PoseDesign, robot: Robot) -> None:
    """Writes the poses as CSV in the order of visiting; `load_measurements` reads the file.

    Raises:
        InvalidInput: The file cannot be written.
    """
    planes = None if design.plane is None else np.array(design.plane, dtype=object)
    write_poses(path, Candidates(design.q, design.payload, design.approach, planes), robot)


def write_poses(path: str | os.PathLike[str], poses: Candidates, robot: Robot) -> None:
    """The same for poses that do not come from a design."""
    columns: dict[str, list[float] | list[int] | list[str]] = {"order": list(range(1, len(poses) + 1))}
    for name, values in controller_columns(robot.spec, poses.q).items():
        columns[name] = np.round(values, 6).tolist()
    columns["payload_kg"] = poses.payload.tolist()
    if poses.approach is not None:
        for index in np.flatnonzero(poses.approach.any(axis=0)):
            columns[f"approach{index + 1}"] = poses.approach[:, index].astype(int).tolist()
    if poses.plane is not None:
        columns["plane"] = [str(name) for name in poses.plane]
    write_csv(path, columns)
