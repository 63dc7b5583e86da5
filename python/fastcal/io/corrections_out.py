# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""A table of corrections: by how much each target was changed, for a person or for a controller's own offsets."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping

from fastcal.arrays import FloatArray
from fastcal.io.tables import write_csv
from fastcal.robot.pendant import axis_columns, joint_columns
from fastcal.robot.robot import Robot
from fastcal.units import from_si


def write_corrections(
    path: str | os.PathLike[str],
    robot: Robot,
    labels: Mapping[str, Iterable[int | str]],
    shift: FloatArray,
    joints: FloatArray,
    error: FloatArray,
    sigma: FloatArray,
) -> None:
    """Writes a row a target, as CSV.

    Args:
        path: The file.
        robot: Its joints have the units of the columns.
        labels: Columns that say which target a row is of.
        shift: (N, 6) m and rad (a rotation vector) by which the tool is sent elsewhere.
        joints: (N, n) rad or m by which the chain's joints change; the controller's follow as djN where they differ.
        error: (N,) m that the correction takes away.
        sigma: (N,) m, standard deviation of a coordinate of what the model predicts there; NaN where not known.

    Raises:
        InvalidInput: The file cannot be written.
    """
    columns: dict[str, Iterable[float | int | str]] = dict(labels)
    columns["error_mm"] = from_si(error, "mm")
    for axis, along, about in zip("xyz", shift[:, :3].T, shift[:, 3:].T, strict=True):
        columns[f"shift_{axis}_mm"], columns[f"turn_{axis}_deg"] = from_si(along, "mm"), from_si(about, "deg")
    columns.update(joint_columns(robot.description, joints, "dq"))
    if not robot.pendant.is_chain:
        columns.update(axis_columns(robot.description, robot.pendant.shown(joints + robot.pendant.zero), "dj"))
    columns["sigma_mm"] = from_si(sigma, "mm")
    write_csv(path, columns)
